"""Water on a grid: vortices, bodies that coast and sink, and a plate that swims by a wave from head to tail.

The bounds are those that a robot needs to swim; real water would be at 1 where a share is left.
"""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.model.grid_water import GridWater
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.scene import Scene
from zoobench_verify.cases import CaseRecorder, Shortfall, case
from zoobench_verify.validate.rig import GRAVITY, WEIGHTLESS, Rig, Vector, dust, lattice, passive_body
from zoobench_verify.validate.speed_control import TOLERANCE, SpeedControl, check_motion

_SPACING = 1 / 64
_RUBBER = ElasticMaterial(youngs_modulus=1e5, poissons_ratio=0.2, density=1000.0, viscosity=20.0)
_WATER = GridWater()


def _tank(
    body: ElasticBody, cells: tuple[int, int, int], gravity: Vector = WEIGHTLESS, water: GridWater = _WATER,
    spacing: float = _SPACING,
) -> Scene:  # fmt: skip
    """A body in a closed box of water of so many cells."""
    x, y, z = (spacing * count for count in cells)
    return Scene(body, (0.0, 0.0, 0.0), (x, y, z), gravity=gravity, water=water)


def _vortex(speed: float, cells: int, spacing: float = _SPACING) -> tuple[Array, Array]:
    """Times [s] over 0.25 s, and the share of its speed that a Taylor-Green vortex with 2 `cells` a wave has left."""
    k, wide = math.pi / (cells * spacing), cells * spacing
    face, centre = np.arange(cells) * spacing, (np.arange(cells) + 0.5) * spacing
    velocities = np.zeros((cells, cells, 4, 3))
    velocities[..., 0] = speed * np.outer(np.sin(k * face), np.cos(k * centre))[:, :, None]
    velocities[..., 1] = -speed * np.outer(np.cos(k * centre), np.sin(k * face))[:, :, None]
    speck, water = dust((wide / 2, wide / 2, 2 * spacing), spacing), GridWater(velocities=velocities)
    rig = Rig(_tank(speck, (cells, cells, 4), water=water, spacing=spacing), spacing, 0.25, courant=1e-3)
    flow, shares = rig.solver.matter.flow[0, 0, :, :3].numpy(), [1.0]
    for _ in range(rig.steps):
        rig.advance(1)
        shares.append(math.sqrt(np.square(flow).sum() / np.square(velocities).sum()))
    return rig.times(rig.steps), np.array(shares)


_MOVING = 1.0 - 1e-5
"""Share of a vortex's speed that is left at most: a moving vortex loses some on a grid, one at rest does not."""


@case("taylor-green-vortex", "Taylor & Green 1937, without viscosity", "16 cells a wavelength, 20 and 200 mm/s")
def taylor_green_vortex(record: CaseRecorder) -> None:
    """The vortex is at rest in the frame of its walls, so that all of its loss is numerical."""
    figure = record.plot("Taylor-Green vortex without viscosity", "time [s]", "speed left [-]")
    for speed in (0.02, 0.2):
        times, shares = _vortex(speed, 8)
        record.within(f"speed left after 0.25 s of {1e3 * speed:g} mm/s", shares[-1], 0.97, _MOVING)
        figure.computed(f"{1e3 * speed:g} mm/s", times, shares)
    figure.reference("no viscosity", times, np.ones_like(times))


@case("vortices-of-a-body", "Taylor & Green 1937: the speed decays with 2 nu k^2", "3 and 5 cells a vortex, 50 mm/s")
def vortices_of_a_body(record: CaseRecorder) -> None:
    """Vortices of 0.05 m, which a body of 0.1 m sheds, lose speed as in water of this Reynolds number; real: 5,000."""
    figure = record.plot("Vortices of 50 mm across", "time [s]", "speed left [-]")
    for name, spacing, cells, bound in (("draft", 1 / 64, 3, 200.0), ("standard", 1 / 96, 5, 600.0)):
        times, shares = _vortex(0.05, cells, spacing)
        viscosity = -math.log(shares[-1]) / (2 * (math.pi / (cells * spacing)) ** 2 * times[-1])
        record.at_least(f"Reynolds number of 0.1 m at 50 mm/s at {name}", 0.1 * 0.05 / viscosity, bound)
        figure.computed(name, times, shares)


def _ball(cells: int, density: float, speed: float, place: Vector) -> ElasticBody:
    """A ball, `cells` across, about a place [m], moving along x [m/s]."""
    radius, half = 0.5 * cells * _SPACING, _SPACING / 2
    points = lattice((-radius, -radius, -radius), (radius, radius, radius), half)
    points = points[np.linalg.norm(points, axis=1) < radius]
    volume = 4 / 3 * math.pi * radius**3 / len(points)
    return passive_body(replace(_RUBBER, density=density), points + place, volume, np.array([speed, 0.0, 0.0]))


def _momenta(rig: Rig, pieces: int) -> tuple[Array, Array, Array]:
    """Times [s], and place [m] and velocity [m/s] of the centre of mass, along three axes each."""
    weights = rig.mass / rig.mass.sum()
    places, speeds = [weights @ rig.positions], [weights @ rig.v]
    for _ in range(pieces):
        rig.advance(rig.steps // pieces)
        places.append(weights @ rig.positions)
        speeds.append(weights @ rig.v)
    return rig.times(pieces, rig.steps // pieces), np.array(places), np.array(speeds)


@case("coasting-ball", "potential flow: added mass of half the displaced", "6 cells across, in a box of 20")
def coasting_ball(record: CaseRecorder) -> None:
    """A ball of water's density is given 50 mm/s; it keeps 1 / (1 + added mass), and drag takes little more."""
    middle = 10 * _SPACING
    rig = Rig(_tank(_ball(6, 1000.0, 0.05, (middle, middle, middle)), (20, 20, 20)), _SPACING, 0.3)
    times, _, speeds = _momenta(rig, 150)
    share = speeds[:, 0] / 0.05
    record.within("added mass by displaced mass after 2 ms", 1 / np.interp(0.002, times, share) - 1, 0.5, 0.9)
    record.within("speed left after 10 ms", np.interp(0.01, times, share), 0.5, 2 / 3)
    record.within("speed left after 0.3 s", share[-1], 0.45, 2 / 3)
    figure = record.plot("A ball that is given 50 mm/s", "time [s]", "speed left [-]")
    figure.computed("6 cells across", times, share)
    figure.reference("1 / (1 + 0.5)", times, np.full_like(times, 2 / 3))


def _sinking(diameter: float, excess: float, times: Array) -> Array:
    """Way [m] of a sphere, denser than water by a share `excess`, with its added mass and drag."""
    way, speed, ways, dt = 0.0, 0.0, [0.0], (times[1] - times[0]) / 50
    for _ in times[1:]:
        for _ in range(50):
            reynolds = max(speed * diameter / 1e-6, 1.0)
            drag = max(0.44, 24 / reynolds * (1 + 0.15 * reynolds**0.687)) * 0.75 * speed**2 / diameter
            speed += dt * (excess * GRAVITY - drag) / (1.0 + excess + 0.5)
            way += dt * speed
        ways.append(way)
    return np.array(ways)


@case("sinking-ball", "Schiller & Naumann 1935, added mass of a half", "6 cells across, 10 % denser, in a box of 20")
def sinking_ball(record: CaseRecorder) -> None:
    """Released at rest, it falls as far in 0.3 s as the textbook says but for its thicker wake."""
    middle = 10 * _SPACING
    body = _ball(6, 1100.0, 0.0, (middle, 1.4 * middle, middle))
    rig = Rig(_tank(body, (20, 20, 20), (0.0, -GRAVITY, 0.0)), _SPACING, 0.3)
    times, places, _ = _momenta(rig, 50)
    way, exact = places[0, 1] - places[:, 1], _sinking(6 * _SPACING, 0.1, times)
    record.within("way in 0.3 s by the textbook's", way[-1] / exact[-1], 0.7, 1.1)
    figure = record.plot("A ball 10 % denser than water", "time [s]", "way [m]")
    figure.computed("6 cells across", times, way)
    figure.reference("added mass 0.5 and a sphere's drag", times, exact)


def _towed(record: CaseRecorder, reynolds: float) -> Array:
    """Drag coefficients of a ball, 6 cells across, in each of five diameters at 0.2 m/s along a box of 48 x 20 x 20
    cells."""
    wide, speed, h = 6 * _SPACING, 0.2, _SPACING
    water = GridWater(viscosity=speed * wide / reynolds)
    body = _ball(6, 1000.0, speed, (7 * h, 10 * h, 10 * h))
    rig = Rig(_tank(body, (48, 20, 20), water=water), h, wide / speed, precision=32, courant=0.7)
    control, force, places = SpeedControl(rig, 0), np.zeros(5), np.zeros(6)
    for diameter in range(5):
        for _ in range(rig.steps):
            control.advance(speed)
            force[diameter] += control.force / rig.steps
        places[diameter + 1] = control.moved / wide
    check_motion(record, f"Reynolds number {reynolds:g}", places[-1] / 5, np.diff(places))
    found: Array = force / (0.5 * 1000.0 * speed**2 * math.pi * wide**2 / 4)
    return found


@case("towed-ball", "Schiller & Naumann 1935", "6 cells across, in a box of 48 x 20 x 20", is_fast=False, precision=32)
def towed_ball(record: CaseRecorder) -> None:
    """The water resists a ball at constant speed nearly as its viscosity says, on which that of the grid comes."""
    figure = record.plot("A ball that is towed from rest", "way [diameters]", "drag by that of the curve [-]")
    for reynolds in (100.0, 500.0):
        ratios = _towed(record, reynolds) / (24 / reynolds * (1 + 0.15 * reynolds**0.687))
        record.within(f"drag by that of the curve at a Reynolds number of {reynolds:g}", ratios[-1], 0.5, 2.0)
        figure.computed(f"Reynolds number {reynolds:g}", np.arange(5) + 0.5, ratios)


class PlateSwim(NamedTuple):
    """How a driven plate swam.

    Attributes:
        times: [s].
        ahead: way of its middle towards its head at these times [m].
        stride: way ahead in the last of its periods, in lengths [-].
        strouhal: number of that period, by the amplitude that the tail had.
        wave: that which its particles made in that period by that which was wished, amplitude and phase [-].
    """

    times: Array
    ahead: Array
    stride: float
    strouhal: float
    wave: float


_LENGTH, _PERIODS = 0.1, 4
"""Length of the plate [m], and the periods that it swims."""
_SPRING = 1000.0
"""Rate at which the plate is drawn to the wave [1/s]: at a third of it the wave that it makes is off by a tenth."""


def _swim(frequency: float, way: float, place: float) -> PlateSwim:
    """A plate of 0.1 x 0.012 m, bent by a wave 0.2 m long that runs backward (`way` 1) or forward (-1).

    Its amplitude grows from 2 mm at the head to 10 mm at the tail. Its middle lies `place` cells off the faces.
    """
    h, thick, wave = _SPACING, 0.012, 0.2
    corner = np.array([13 * h - _LENGTH / 2, 0.0, (7 + place) * h - thick / 2])
    points = lattice((0.0, 0.0, 0.0), (_LENGTH, 4 * h, thick), (h / 2, h / 2, thick / 2)) + corner
    body = passive_body(_RUBBER, points, _LENGTH * 4 * h * thick / len(points))
    rig = Rig(_tank(body, (26, 4, 14)), h, 1.0 / frequency, precision=32, courant=0.7)
    back = (corner[0] + _LENGTH - points[:, 0]) / _LENGTH
    amplitude, phase = 0.01 * (0.2 + 0.8 * back), -way * 2 * math.pi * back * _LENGTH / wave
    rate, spring = 2 * math.pi * frequency, _SPRING
    places, made, steps = [0.0], np.zeros(len(points), complex), rig.steps
    for step in range(_PERIODS * steps):
        time = step * rig.dt
        swing, aside = amplitude * min(1.0, time * frequency), rig.positions[:, 2] - points[:, 2]
        if step >= (_PERIODS - 1) * steps:
            made += 2j / steps * aside * np.exp(-1j * rate * time)
        there, speed = swing * np.sin(rate * time + phase), rate * swing * np.cos(rate * time + phase)
        push = spring**2 * (there - aside) + 1.4 * spring * (speed - rig.v[:, 2]) - rate**2 * there
        rig.v[:, 2] += rig.dt * push
        rig.advance(1)
        places.append(float((rig.positions[:, 0] - points[:, 0]).mean()))
    wished, ahead = amplitude * np.exp(1j * phase), np.array(places)
    stride = (ahead[-1] - ahead[-1 - steps]) / _LENGTH
    tail = float(np.abs(made[back > back.max() - h / _LENGTH]).mean())
    return PlateSwim(
        rig.times(_PERIODS * steps), ahead, stride, 2 * tail / (_LENGTH * max(stride, 1e-9)),
        float(np.vdot(wished, made).real / np.vdot(wished, wished).real),
    )  # fmt: skip


FREQUENCIES = (2.0, 3.0, 4.0, 6.0, 8.0)
"""Beat frequencies of swimmers [Hz]."""

_BACKWARD = "not explained: a plate whose middle lies on a face of the grid goes backward faster than forward"


@case("swimming-plate", "sign and proportion: Lighthill 1960; Strouhal number: Triantafyllou et al. 1993",
      "0.1 m in 6.4 cells, 0.8 cells thick", is_fast=False, precision=32)  # fmt: skip
def swimming_plate(record: CaseRecorder) -> None:
    """A wave from head to tail drives it forward, in proportion to the frequency, and one from tail to head hardly.

    No swimmer outruns its wave, which runs by two lengths in a period.
    """
    figure = record.plot("A plate that is bent in a wave", "time in periods", "way ahead [m]")
    swims = {way: [[_swim(f, way, place) for place in (0.0, 0.25, 0.5)] for f in FREQUENCIES] for way in (1.0, -1.0)}
    for frequency, row in zip(FREQUENCIES, swims[1.0], strict=True):
        figure.computed(f"{frequency:g} Hz, to the tail", row[-1].times * frequency, row[-1].ahead)
    turned = swims[-1.0][2][-1]
    figure.computed("4 Hz, to the head", turned.times * FREQUENCIES[2], turned.ahead)
    strides, back = (np.array([[swim.stride for swim in row] for row in swims[way]]) for way in (1.0, -1.0))
    waves = np.array([swim.wave for rows in swims.values() for row in rows for swim in row])
    means, slowest = strides.mean(axis=1), max(swim.strouhal for row in swims[1.0] for swim in row)
    words = "at 2, 3, 4, 6, 8 Hz and three places on the grid"
    record.at_most("wave of the particles off that wished, by it, the most", np.abs(waves - 1).max(), TOLERANCE)
    record.at_least(f"lengths per period, the least {words}", strides.min(), 0.05)
    record.at_most(f"lengths per period, the most {words}", strides.max(), 2.0)
    record.at_most("spread over the frequencies, of the mean over the places, by it", np.ptp(means) / means.mean(), 0.3)
    record.at_most(f"Strouhal number, the largest {words}", slowest, 1.5)
    record.at_most("speed by a wave to the head by that of the other, the most", (back / strides).max(), 1 / 3)
    record.at_least(
        "speed by a wave to the head by that of the other, the least", (back / strides).min(), -1.0,
        shortfall=Shortfall(_BACKWARD, -1.6),
    )  # fmt: skip
