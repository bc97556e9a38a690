"""Waves of bodies whose motion is given, in water by forces on their surface: thrust, and the speed of a fish."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from zoobench import registry
from zoobench.arrays import Array
from zoobench.envs.base import Environment
from zoobench.registry import Kind
from zoobench.sim.model.potential_flow import areas
from zoobench.sim.model.rest_cells import RestCells
from zoobench.sim.model.surface_water import SurfaceWater
from zoobench.spec import Ref
from zoobench_verify.cases import CaseRecorder, Shortfall, case
from zoobench_verify.validate.surface_reference import PanelForces
from zoobench_verify.validate.surface_rig import DENSITY, SPACINGS, Led, TowedSolid, drag_coefficient, in_water, name_of

_INSTANTS = 24
"""Moments of a period, over which forces are averaged."""


@dataclass(frozen=True)
class BodyWave:
    """A wave that runs from head to tail along a body that swims along x.

    Attributes:
        amplitude: sideways, of the distance from the head by the length [m].
        length: of the body [m].
        wavelength: [m].
        frequency: [Hz].
    """

    amplitude: Callable[[Array], Array]
    length: float
    wavelength: float
    frequency: float

    @property
    def speed(self) -> float:
        """Of the wave along the body [m/s]."""
        return self.frequency * self.wavelength

    def aside(self, back: Array, time: float) -> Array:
        """Way sideways [m] at distances from the head [m]."""
        phase = 2 * math.pi * (self.frequency * time - back / self.wavelength)
        return self.amplitude(back / self.length) * np.sin(phase)

    def placed(self, places: Array, head: float, time: float) -> Array:
        """Where matter is `[n, 3]` that is at places at rest, of a body whose head is at x = `head` [m].

        Slices of the body stay plane and across its midline, which keeps its length.
        """
        line = np.linspace(-0.05, 1.05, 2201) * self.length
        z = self.aside(line, time)
        slope = np.gradient(z, line)
        ahead = -np.concatenate([[0.0], np.cumsum(np.sqrt(1 - slope[1:] ** 2) * np.diff(line))])
        ahead += np.interp(0.5 * self.length, line, -line - ahead)
        back, middle = head - places[:, 0], 0.5 * (places[:, 2].min() + places[:, 2].max())
        tilt, off = np.interp(back, line, slope), places[:, 2] - middle
        return np.stack(
            [
                head + np.interp(back, line, ahead) + tilt * off,
                places[:, 1],
                middle + np.interp(back, line, z) + np.sqrt(1 - tilt**2) * off,
            ],
            axis=1,
        )


def mean_force(led: Led, wave: BodyWave, head: float, speed: float) -> tuple[Array, float]:
    """Means over a period of the water's force `[3]` [N] on a body that is led through a wave, and ahead at a speed
    [m/s], and of its work on the water in a second [W].

    Elastic forces do no work in a period, and matter of `surface_rig` has no viscosity.
    """
    brief, forces, work = 1e-3 / wave.frequency, [], 0.0
    for time in np.arange(_INSTANTS) / (_INSTANTS * wave.frequency):
        before, there, after = (wave.placed(led.places, head, time + k * brief) for k in (-1, 0, 1))
        velocity = (after - before) / (2 * brief) + np.array([speed, 0.0, 0.0])
        acceleration = (after - 2 * there + before) / brief**2
        push = led.push(there, velocity)
        forces.append(push.on_body(acceleration))
        nodal = push.force - np.einsum("nab,nb->na", push.added, acceleration)
        work -= float((nodal * velocity).sum()) / _INSTANTS
    return np.mean(forces, axis=0), work


_HIGH, _THICK, _LONG = 0.06, 0.02, 0.3
"""Edges of the slender body [m], which is an ellipse across."""
_NOSE = 0.1
"""Over which it grows to its depth [m]."""
_HEAD = 1.0 + _LONG / 2
"""Place of its head [m]."""


@cache
def _slender() -> TowedSolid:
    """A body with a round head, cut off at its tail, whose slices are ellipses."""

    def distance(points: Array) -> Array:
        nose = np.clip((points[:, 0] - (_LONG / 2 - _NOSE)) / _NOSE, 0.0, None)
        across = np.square((points[:, 1] - _HIGH / 2) / (_HIGH / 2)) + np.square(points[:, 2] / (_THICK / 2))
        radius: Array = (np.sqrt(across + nose**2) - 1.0) * _THICK / 2
        return np.maximum(radius, -_LONG / 2 - points[:, 0])

    return TowedSolid(distance, (_LONG, _HIGH, _THICK))


def lighthill(wave: BodyWave, speed: float) -> tuple[float, float]:
    """Mean thrust [N] of the slender body, and the energy that it leaves in its wake in a second [W], by its tail."""
    h = 1e-4
    ends = np.array([1.0 - h, 1.0])
    amplitude = wave.amplitude(ends)
    growth, a = float(np.diff(amplitude)[0]) / (h * wave.length), float(amplitude[1])
    rate, number = 2 * math.pi * wave.frequency, 2 * math.pi / wave.wavelength
    mass = DENSITY * math.pi / 4 * _HIGH**2
    thrust = 0.25 * mass * ((rate * a) ** 2 - speed**2 * (growth**2 + (number * a) ** 2))
    left = 0.25 * mass * speed * ((rate - speed * number) ** 2 * a**2 + (speed * growth) ** 2)
    return thrust, left


_GROWING = BodyWave(lambda share: 0.015 * share, _LONG, _LONG, 2.0)
"""A wave whose head is at rest, so that Lighthill's thrust is all of the tail."""

_SLIPS = (0.0, 0.3, 0.6, 0.9, 1.0)
"""Speeds by that of the wave."""

_LIFTS = {"without lift": 0.0, "with lift": SurfaceWater().lift}


@case(
    "thrust-of-a-wave",
    "Lighthill 1960: m (w y_t - w^2 / 2) at the tail, in the mean",
    "1/64, 1/96, 1/128 m",
    is_fast=False,
)
def thrust_of_a_wave(record: CaseRecorder) -> None:
    """A slender body that is led through a wave is driven by the water as Lighthill says, by all of its slip.

    Drag is left out. The added mass ends before the tail does, by water that flows around it.
    """
    figure = record.plot("Thrust of a wave", "speed by that of the wave [-]", "thrust by Lighthill's at rest [-]")
    by_theory = np.array([lighthill(_GROWING, slip * _GROWING.speed) for slip in _SLIPS])
    rest = by_theory[0, 0]
    for lift_name, lift in _LIFTS.items():
        for h in SPACINGS:
            water = SurfaceWater(density=DENSITY, normal_drag=0.0, friction=0.0, lift=lift)
            led = Led(*in_water(_slender(), h, water=water))
            means = [mean_force(led, _GROWING, _HEAD, slip * _GROWING.speed) for slip in _SLIPS]
            found, what = np.array([force[0] for force, _ in means]) / rest, f"{lift_name}, {name_of(h)}"
            _check_thrust(record, what, found, by_theory[:, 0] / rest)
            if not lift:
                _check_work(record, what, means, by_theory)
            figure.computed(what, np.array(_SLIPS), found)
    figure.reference("Lighthill", np.array(_SLIPS), by_theory[:, 0] / rest)


def _check_work(record: CaseRecorder, what: str, means: list[tuple[Array, float]], by_theory: Array) -> None:
    """The bounds of work by Lighthill's, at a third and two thirds of the slip: thrust alone does not see how the water
    resists what turns."""
    for k in (1, 2):
        speed = _SLIPS[k] * _GROWING.speed
        aside, exact = means[k][1] + speed * means[k][0][0], by_theory[k, 1] + speed * by_theory[k, 0]
        record.within(f"work of sideways motion by Lighthill's, slip {_SLIPS[k]:g}, {what}", aside / exact, 0.75, 1.05)
    left = means[1][1] / by_theory[1, 1]
    record.within(f"energy left in the wake by Lighthill's, slip {_SLIPS[1]:g}, {what}", left, 0.7, 1.05)


def _check_thrust(record: CaseRecorder, what: str, found: Array, exact: Array) -> None:
    """The bounds of thrusts by Lighthill's at rest, at `_SLIPS`."""
    for slip, thrust, theory in zip(_SLIPS, found, exact, strict=True):
        if slip < 0.9:
            record.within(f"thrust by Lighthill's, slip {slip:g}, {what}", thrust / theory, 0.75, 1.05)
        else:
            record.within(
                f"thrust less Lighthill's, by that at rest, slip {slip:g}, {what}", thrust - theory, -0.1, 0.1
            )


_CARANGIFORM = (0.02, -0.08, 0.16)
"""Amplitude by the length: coefficients of a mackerel's by the share of the length from the head (Videler & Hess 1984,
as of Borazjani & Sotiropoulos 2008)."""

_WAVELENGTH, _FREQUENCY = 0.95, 4.0
"""Of a mackerel by its length [-], and of the beat [Hz]."""

_VISCOSITY = 1e-6
"""Kinematic, of water [m^2/s]."""

_RESISTED = "the drag of pressure on a fish that is held straight, of which hardly any is left by real ones"


@case("carangiform-fish", "Videler & Hess 1984, Videler 1993: strides; Gazzola et al. 2014: Re = 0.4 Sw (recalled)",
      "draft, standard, paper")  # fmt: skip
def carangiform_fish(record: CaseRecorder) -> None:
    """The fish, led through a mackerel's wave, swims as fast as a fish that size does: there thrust is drag."""
    figure = record.plot("A fish in a mackerel's wave", "speed in lengths a beat [-]", "mean force ahead [mN]")
    strides, speeds = [], np.array([0.0, 0.2, 0.4, 0.6, 0.8, 1.0])
    for level in ("draft", "standard", "paper"):
        led, length, head = _fish(level)
        wave = BodyWave(lambda share, size=length: size * np.polynomial.Polynomial(_CARANGIFORM)(share), length,  # type: ignore[misc]
                    _WAVELENGTH * length, _FREQUENCY)  # fmt: skip
        unit = length * _FREQUENCY
        forces = np.array([mean_force(led, wave, head, speed * unit)[0][0] for speed in speeds])
        strides.append(float(np.interp(0.0, -forces, speeds)))
        record.within(f"stride at {level}", strides[-1], 0.5, 0.8, "lengths a beat",
                      shortfall=Shortfall(_RESISTED, 0.39))  # fmt: skip
        swimming = 2 * math.pi * _FREQUENCY * 2 * float(wave.amplitude(np.ones(1))[0]) * length / _VISCOSITY
        reynolds = strides[-1] * unit * length / _VISCOSITY
        record.within(f"Reynolds number by 0.4 Sw at {level}", reynolds / (0.4 * swimming), 0.5, 2.0)
        straight = drag_coefficient(-float(led.towed(np.array([0.4, 0.0, 0.0])).on_body()[0]), 0.4, _wetted(led))
        record.within(f"drag coefficient of the straight fish by its surface at {level}", straight, 0.004, 0.025,
                      shortfall=Shortfall(_RESISTED, 0.045))  # fmt: skip
        figure.computed(level, speeds, 1e3 * forces)
    record.at_most("strides, the largest of three levels by the least", max(strides) / min(strides), 1.1)
    figure.reference("steady", speeds, np.zeros(len(speeds)))


def _fish(level: str) -> tuple[Led, float, float]:
    """The fish of this package in its ocean, its length, and the place of its head [m]."""
    env: Environment = registry.create(Kind.ENV, Ref.parse("ocean"))
    fidelity = replace(env.simulated(registry.create(Kind.FIDELITY, Ref(level))), precision=64)
    scene = env.scene(registry.create(Kind.DESIGN, Ref("fish")).body(fidelity), fidelity)
    assert scene.surface_water is not None
    assert scene.surface_water.hull is not None
    along = scene.surface_water.hull.triangles[..., 0]
    return Led(scene, fidelity), float(np.ptp(along)), float(along.max())


def _wetted(led: Led) -> float:
    """Area of the hull [m^2]."""
    water = led.solver.scene.surface_water
    assert water is not None
    assert water.hull is not None
    return float(np.linalg.norm(areas(water.hull.triangles), axis=1).sum())


_HEAD_FIRST = replace(_GROWING, amplitude=lambda share: 0.015 * (1.0 - share))
_EVEN = replace(_GROWING, amplitude=lambda share: np.full_like(share, 0.01))
_YAW = replace(_GROWING, amplitude=lambda share: 0.03 * (1.0 - share), wavelength=1e6)
"""Waves that move the head most or as much as the tail, and a body that turns about its tail."""

_LED = {
    "to the tail": _GROWING, "with a still tail": _HEAD_FIRST, "as large everywhere": _EVEN, "about its tail": _YAW,
}  # fmt: skip


@case(
    "still-water-gives-nothing", "second law: work on water at rest over a period", "1/64, 1/96, 1/128 m", is_fast=False
)
def still_water_gives_nothing(record: CaseRecorder) -> None:
    """Whoever leads a body through still water does work, in whatever way, by the added mass and the lift alone, too.

    The water's forces are computed in numpy. The added mass by itself takes energy from the water where the head swings
    more than the tail: the lift must give it back.
    """
    figure = record.plot("Work on still water without drag", "speed [m/s]", "power [mW]")
    speeds = np.array([0.2, 0.4, 0.6])
    for h in SPACINGS:
        record.at_most(f"force by the kernel less that by numpy, by its size, {name_of(h)}", _apart(h), 1e-9)
        for name, wave in _LED.items():
            powers = np.array([_powers(h, wave, speed) for speed in speeds])
            total, reaction = powers.sum(axis=1), powers[:, 1]
            record.at_least(f"power by all forces, {name}, the least, {name_of(h)}", 1e3 * total.min(), 0.0, "mW")
            record.at_least(f"power without drag, {name}, the least, {name_of(h)}", 1e3 * powers[:, :2].sum(1).min(),
                            0.0, "mW")  # fmt: skip
            if h == SPACINGS[-1]:
                record.remark(f"by the reaction alone, {name}: {1e3 * reaction.min():.3g} mW at the least")
                figure.computed(name, speeds, 1e3 * powers[:, :2].sum(axis=1))
    figure.reference("none", speeds, np.zeros(len(speeds)))


def _apart(spacing: float) -> float:
    """Difference between the kernel's and numpy's force on the slender body at one moment, by its size [-]."""
    scene, fidelity = in_water(_slender(), spacing)
    led, brief = Led(scene, fidelity), 1e-3 / _GROWING.frequency
    before, there, after = (_GROWING.placed(led.places, _HEAD, 0.1 + k * brief) for k in (-1, 0, 1))
    velocity = (after - before) / (2 * brief) + np.array([0.3, 0.0, 0.0])
    wet = PanelForces(scene, fidelity, RestCells.of(scene.robot, fidelity)).at(there, velocity)
    exact = (wet.drag + wet.lift + wet.friction + wet.reaction).sum(axis=0)
    return float(np.linalg.norm(led.push(there, velocity).on_body() - exact) / np.linalg.norm(exact))


def _powers(spacing: float, wave: BodyWave, speed: float) -> Array:
    """Mean work of the slender body on the water in a second, by lift, reaction and drag [W]."""
    scene, fidelity = in_water(_slender(), spacing)
    cells = RestCells.of(scene.robot, fidelity)
    water, brief, found = PanelForces(scene, fidelity, cells), 1e-3 / wave.frequency, np.zeros(3)
    for time in np.arange(_INSTANTS) / (_INSTANTS * wave.frequency):
        before, there, after = (wave.placed(cells.places, _HEAD, time + k * brief) for k in (-1, 0, 1))
        velocity = (after - before) / (2 * brief) + np.array([speed, 0.0, 0.0])
        wet = water.at(there, velocity)
        inertia = np.einsum("nab,nb->na", wet.added, (after - 2 * there + before) / brief**2)
        for k, force in enumerate((wet.lift, wet.reaction - inertia, wet.drag + wet.friction)):
            found[k] -= float((force * velocity).sum()) / _INSTANTS
    return found
