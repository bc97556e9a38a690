"""A fish that swims with its own muscles: its speed, and how its body moves."""

import math
from dataclasses import dataclass, replace

import numpy as np
import torch

from zoobench import registry
from zoobench.arrays import Array
from zoobench.cell.motion import motion_of
from zoobench.cell.muscle_places import muscle_places
from zoobench.controllers.travelling_wave import TravellingWave
from zoobench.designs.base import Body, Design
from zoobench.envs.base import Environment
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.solver import Solver
from zoobench.spec import FRAME_SECONDS, Ref
from zoobench.tasks.base import Motion
from zoobench.tasks.swimming_readings import swimming_readings
from zoobench_verify.cases import CaseRecorder, Shortfall, case
from zoobench_verify.validate.speed_control import TOLERANCE
from zoobench_verify.validate.swimming import FREQUENCIES

_WAVELENGTH = 1.0
"""Wavelength of muscle activity, by the body's length [-]."""

_STRENGTH, _GROWTH = 2.0, 0.0
"""Parameters of the wave: all muscles reach tanh(2) = 0.96 of their strength."""

TANK = "ocean[length=0.4375,depth=0.15625,width=0.1875]"
"""The tank of water, whatever the environment's own size is: the figures are those of this one."""

_PERIODS = 6
"""The wave grows from nothing in the first: at full strength at once it turns the fish by 20 degrees."""


@dataclass(frozen=True)
class Swim:
    """How a fish swam.

    Attributes:
        times: at the beginning of every period and at the end [periods].
        strides: way ahead in every period, by the body's length `[periods]` [-].
        beat: frequency at which the body swings, by that of its muscles [-].
        tail, head: amplitudes [body lengths].
        phase: by which the tail lags behind the head [rad].
        turn, pitch: of the heading in the last period, to the side and upwards, against that at rest [degrees].
    """

    times: Array
    strides: Array
    beat: float
    tail: float
    head: float
    phase: float
    turn: float
    pitch: float

    @property
    def stride(self) -> float:
        """The mean over the last two periods: U / (f L)."""
        return float(self.strides[-2:].mean())

    @property
    def strouhal(self) -> float:
        """Twice the tail's amplitude by the stride."""
        return 2.0 * self.tail / max(self.stride, 1e-9)

    @property
    def text(self) -> str:
        """The kinematics on one line."""
        return (
            f"amplitudes of tail and head {self.tail:.3f} and {self.head:.3f} L, phase {self.phase:.2f} rad, Strouhal "
            f"number {self.strouhal:.2f}, turn {self.turn:.0f} and pitch {self.pitch:.0f} degrees"
        )


def swim(frequency: float, way: float = 1.0, level: str = "standard", name: str = "fish", ocean: str = TANK) -> Swim:
    """A swimmer in the ocean at a fidelity, driven by a wave that runs to the tail (`way` 1) or to the head (-1)."""
    env: Environment = registry.create(Kind.ENV, Ref.parse(ocean))
    fidelity: Fidelity = env.simulated(registry.create(Kind.FIDELITY, Ref(level)))
    design: Design = registry.create(Kind.DESIGN, Ref(name))
    body = design.body(fidelity)
    wave = TravellingWave(frequency=frequency, wavelength=way * _WAVELENGTH).placed(muscle_places(body))
    frames = math.ceil(_PERIODS / (frequency * FRAME_SECONDS))
    times = torch.arange(frames, dtype=torch.float64) * FRAME_SECONDS
    parameters = torch.tensor([[0.0, 0.0, _STRENGTH, _GROWTH]], dtype=torch.float64)
    beginning = torch.clamp(times * frequency, max=1.0)[:, None, None]
    activity = (beginning * wave.actuation(parameters, times, body.muscle_count)).numpy()
    scene = env.scene(body, fidelity)
    rollout = Solver(scene, fidelity, frame_seconds=FRAME_SECONDS).run(activity)
    return _measured(motion_of(rollout, body, scene, swims=True), body, frequency)


def _measured(motion: Motion, body: Body, frequency: float) -> Swim:
    """The strides along the body's mean heading in each period, as a fish turns while it begins, and the readings."""
    places, length = motion.positions[:, 0].numpy(), float(body.size[0])
    axis = places[:, body.head].mean(axis=1) - places[:, body.tail].mean(axis=1)
    ahead = axis * (1.0, 0.0, 1.0)
    centre = motion.centre_of_mass()[:, 0].numpy()
    beats, ends = np.arange(len(centre)) * FRAME_SECONDS * frequency, np.arange(_PERIODS + 1.0)
    stops = np.stack([np.interp(ends, beats, centre[:, axis]) for axis in range(3)], axis=1)
    headings = np.stack([ahead[(beats >= n) & (beats <= n + 1)].mean(axis=0) for n in range(_PERIODS)])
    headings /= np.linalg.norm(headings, axis=1, keepdims=True)
    strides = (np.diff(stops, axis=0) * headings).sum(axis=1) / length
    pitches = np.degrees(np.arctan2(axis[:, 1], np.hypot(axis[:, 0], axis[:, 2])))
    pitch = float(pitches[beats >= _PERIODS - 1].mean() - pitches[0])
    found = {name: float(value[0]) for name, (value, _) in swimming_readings(motion).items()}
    return Swim(
        ends, strides, found["beat_frequency"] / frequency, found["tail_amplitude"] / length,
        found["head_amplitude"] / length, found["wave_phase"],
        math.degrees(math.atan2(-headings[-1, 2], headings[-1, 0])), pitch,
    )  # fmt: skip


_STEADY_HEAD = 0.5
"""Head's amplitude by the tail's, at most: 0.2 to 0.4 in fish that swim with body and tail (Videler 1993)."""
_ASTRAY = 15.0
"""Change of heading and of pitch in six periods, at most, of a fish that nothing steers [degrees]."""

_RECOIL = "the fish is as deep in front as behind, so that its head recoils from the tail"
_HEADS = {2.0: 1.3, 3.0: 1.2, 4.0: 1.25, 6.0: 0.95, 8.0: 0.75}
"""Head's amplitude by the tail's, by the frequency; the worst that is known."""
_UNSTEERED = "the fish turns while it begins, and nothing steers it back"
_TURNS = {("draft", frequency): Shortfall(_UNSTEERED, worst) for frequency, worst in ((2.0, 45), (3.0, 24), (8.0, 34))}
_BACKWARD = "not explained: a wave to the head drives the fish by more than one to the tail"
_UNEVEN = "not explained: the fish is one to two cells thick"
_SPREADS = {"standard": Shortfall(_UNEVEN, 0.85), "draft": Shortfall(_UNEVEN, 0.65)}


@case("swimming-fish", "proportion to the frequency, wave to the tail: Bainbridge 1958; Videler 1993",
      "0.15 m in 14 cells, and in 9", is_fast=False, precision=32)  # fmt: skip
def swimming_fish(record: CaseRecorder) -> None:
    """Its own muscles drive it forward by a wave from head to tail, and backward by one from tail to head.

    It goes as far in a period at every frequency, and cannot outrun its wave, which runs by a length in one.
    """
    figure = record.plot("A fish with its own muscles", "time in periods", "way ahead [lengths]")
    swims = {(level, frequency): swim(frequency, level=level) for level in _SPREADS for frequency in FREQUENCIES}
    for (level, frequency), found in swims.items():
        _check_swim(record, found, level, frequency)
        figure.computed(f"{frequency:g} Hz, {level}", found.times, np.concatenate([[0.0], found.strides.cumsum()]))
    for level, spread in _SPREADS.items():
        strides = [swims[level, frequency].stride for frequency in FREQUENCIES]
        record.at_most(
            f"spread of the lengths per period by their mean, {level}", np.ptp(strides) / np.mean(strides), 0.3,
            shortfall=spread,
        )  # fmt: skip
    turned = swim(4.0, -1.0)
    figure.computed("4 Hz, to the head", turned.times, np.concatenate([[0.0], turned.strides.cumsum()]))
    record.within(
        "lengths per period by a wave to the head by that of the other", turned.stride / swims["standard", 4.0].stride,
        -1.0, 1 / 3, shortfall=Shortfall(_BACKWARD, -1.35),
    )  # fmt: skip


def _check_swim(record: CaseRecorder, found: Swim, level: str, frequency: float) -> None:
    """The bounds of a swim at one frequency; at `draft` not those of the body's shape."""
    at, astray = f"at {frequency:g} Hz, {level}", _TURNS.get((level, frequency))
    record.within(f"lengths per period {at}", found.stride, 0.05, _WAVELENGTH)
    record.at_most(f"turn {at}", abs(found.turn), _ASTRAY, "degrees", shortfall=astray)
    record.at_most(f"pitch {at}", abs(found.pitch), _ASTRAY, "degrees")
    record.remark(f"{frequency:g} Hz, {level}: {found.text}")
    if level == "draft":
        return
    change = abs(found.strides[-1] - found.strides[-2]) / abs(found.stride)
    record.at_most(f"change from the last period but one to the last {at}", change, 0.5)
    record.within(f"frequency of the body by that of its muscles {at}", found.beat, 1 - TOLERANCE, 1 + TOLERANCE)
    record.within(f"lag of the tail behind the head {at}", found.phase, math.pi, 3 * math.pi, "rad")
    record.at_most(
        f"amplitude of the head by the tail's {at}", found.head / found.tail, _STEADY_HEAD,
        shortfall=Shortfall(_RECOIL, _HEADS[frequency]),
    )  # fmt: skip


_LEVELS = ("draft", "standard", "paper")
_PLACES = (0.0, 0.25, 0.5)
"""Shifts of the fish from its own place, across the grid [cells]."""
_IN_PART = "a fish one to three cells thick covers the faces of cells in part, and water passes: less on finer grids"
_SHARES = {"draft": 0.23, "standard": 0.27, "paper": 0.34}
_APART = {"draft": 0.5, "paper": 0.13}
"""Shortfalls by the level; the worst that is known."""


def _added_mass(level: str, place: float) -> tuple[float, float]:
    """Added mass sideways by the mass displaced, and the same by strips of the fish (Lighthill 1960).

    A body that is set in motion at once keeps a share of its speed: its mass by that with the water's. Of a slender
    body a slice of depth d takes pi d^2 / 4 of water along, a length of it.
    """
    fidelity: Fidelity = registry.create(Kind.FIDELITY, Ref(level))
    env: Environment = registry.create(Kind.ENV, Ref.parse(TANK))
    body = registry.create(Kind.DESIGN, Ref("fish")).body(fidelity)
    scene, h, speed = env.scene(body, fidelity), fidelity.grid_spacing, 0.01
    aside = np.array([0.0, 0.0, 1.0])
    robot = replace(
        scene.robot, positions=scene.robot.positions + place * h * aside,
        velocities=scene.robot.velocities + speed * aside,
    )  # fmt: skip
    solver = Solver(replace(scene, robot=robot), fidelity)
    solver.reset()
    solver.substeps(1)
    mass = solver.parameters.mass[0].double().numpy()
    kept = float(mass @ solver.matter.v[0, 0, :, 2].double().numpy()) / float(mass.sum() * speed)
    edge = h / 3
    slices = np.rint((body.positions[:, 0] - body.positions[:, 0].min()) / edge)
    depths = np.array([np.ptp(body.positions[slices == n, 1]) + edge for n in np.unique(slices)])
    strips = 1000.0 * math.pi / 4 * float(np.square(depths).sum()) * edge / float(mass.sum())
    return (1.0 / kept - 1.0) * env.robot.density / 1000.0, strips


@case("added-mass-of-a-fish", "strips of a slender body: Lighthill 1960", "0.15 m in 9, 14 and 19 cells", precision=32)
def added_mass_of_a_fish(record: CaseRecorder) -> None:
    """A fish that is set in motion sideways takes along as much water at every level, and wherever it lies.

    Water flows around its ends, so that it is less than that of strips by up to a quarter.
    """
    figure = record.plot("Added mass of the fish, sideways", "grid spacing [m]", "by the mass displaced [-]")
    found = np.array([[_added_mass(level, place) for place in _PLACES] for level in _LEVELS])
    means, strips = found[:, :, 0].mean(axis=1), float(found[-1, 0, 1])
    for level, masses, mean in zip(_LEVELS, found[:, :, 0], means, strict=True):
        spread = Shortfall(_IN_PART, _APART[level]) if level in _APART else None
        share = Shortfall(_IN_PART, _SHARES[level])
        record.within(f"added mass by that of strips at {level}", mean / strips, 0.75, 1.0, shortfall=share)
        record.at_most(f"spread over three places by the mean at {level}", np.ptp(masses) / mean, 0.1, shortfall=spread)
    record.at_most(
        "added mass, the largest of three levels by the least", means.max() / means.min(), 1.1,
        shortfall=Shortfall(_IN_PART, 1.5),
    )  # fmt: skip
    spacings = np.array([registry.create(Kind.FIDELITY, Ref(level)).grid_spacing for level in _LEVELS])
    figure.computed("fish", spacings, means, points=True)
    figure.reference("strips", spacings, np.full_like(spacings, strips))
