"""Animals that swim with their own muscles: how far a beat takes them, and how they swing."""

import math
from dataclasses import dataclass, replace

import numpy as np
import torch

from zoobench import registry
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

_WAVELENGTH = 1.0
"""Wavelength of muscle activity, by the body's length [-]."""

_STRENGTH, _GROWTH = 2.0, 0.0
"""Parameters of the wave: all muscles reach tanh(2) = 0.96 of their strength."""

_TANK = "ocean[water=grid,length=0.4375,depth=0.15625,width=0.1875]"
"""A tank of water on a grid, whatever the environment's own size is: the figures are those of this one."""

_PERIODS = 6
"""The wave grows from nothing in the first: at full strength at once it turns them."""


@dataclass(frozen=True)
class Swim:
    """How a swimmer swam.

    Attributes:
        stride: way ahead in a beat, by the body's length, over the last two [-]: U / (f L).
        tail, head: amplitudes [body lengths].
        turn, pitch: of the heading in the last period, to the side and upwards, against that at rest [degrees].
    """

    stride: float
    tail: float
    head: float
    turn: float
    pitch: float

    @property
    def strouhal(self) -> float:
        """Twice the tail's amplitude by the stride."""
        return 2.0 * self.tail / max(self.stride, 1e-9)


def swim(name: str, level: str, frequency: float, way: float = 1.0) -> Swim:
    """A swimmer in water by forces on its surface, by a wave that runs to the tail (`way` 1) or to the head (-1)."""
    env: Environment = registry.create(Kind.ENV, Ref.parse("ocean"))
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
        float(strides[-2:].mean()), found["tail_amplitude"] / length, found["head_amplitude"] / length,
        math.degrees(math.atan2(-headings[-1, 2], headings[-1, 0])), pitch,
    )  # fmt: skip


_SWIMMERS = ("fish", "tuna", "shark", "clownfish", "orca")
_FREQUENCIES = (2.0, 3.0, 4.0, 6.0, 8.0)
"""[Hz]"""


@case("swimmers", "strides of fish: Bainbridge 1958, Videler 1993; Strouhal numbers: Triantafyllou et al. 1993",
      "five animals, 2 to 8 Hz, draft and paper", is_fast=False, precision=32)  # fmt: skip
def swimmers(record: CaseRecorder) -> None:
    """Waves of all muscles drive five animals by as many lengths a beat as real ones, straight ahead."""
    figure = record.plot("Five swimmers", "frequency [Hz]", "lengths a beat [-]")
    for level in ("draft", "paper"):
        for name in _SWIMMERS:
            swims = {frequency: swim(name, level, frequency) for frequency in _FREQUENCIES}
            for frequency, found in swims.items():
                _check(record, found, name, frequency, level)
            strides = np.array([found.stride for found in swims.values()])
            figure.computed(f"{name}, {level}", np.array(_FREQUENCIES), strides)
            if level == "paper":
                turned = swim(name, level, _SLOW, -1.0).stride / swims[_SLOW].stride
                record.within(f"lengths a beat by a wave to the head by that of the other, {name}, paper", turned, -1.0,
                              1 / 3)  # fmt: skip


_SLOW = 4.0
"""Frequency up to which waves are slow [Hz]."""
_RECOIL = Shortfall("waves that hardly bend the body swing its head by more of the tail's amplitude than in real fish",
                    0.95)  # fmt: skip
_SHORT = Shortfall("flippers far behind the middle, which hold the orca level, hold it back in slow waves", 0.299)
_SWINGING = {"fish": 3.0, "tuna": 8.0, "shark": 4.0, "clownfish": 6.0, "orca": 6.0}
"""Frequencies up to which they do [Hz]: tuna, clownfish and orca are stiff, so that coarse grids bend them alike."""


def _check(record: CaseRecorder, found: Swim, name: str, frequency: float, level: str) -> None:
    """The bounds of one swimmer at one frequency."""
    which = f"{name}, {frequency:g} Hz, {level}"
    recoil = _RECOIL if frequency <= _SWINGING[name] else None
    short = _SHORT if (name, frequency, level) == ("orca", 2.0, "draft") else None
    record.within(f"lengths a beat, {which}", found.stride, 0.3, 0.8, shortfall=short)
    record.within(f"Strouhal number, {which}", found.strouhal, 0.2, 0.7)
    record.at_most(f"amplitude of the head by the tail's, {which}", found.head / found.tail, 0.5, shortfall=recoil)
    record.at_most(f"turn, {which}", abs(found.turn), 15.0, "degrees")
    record.at_most(f"pitch, {which}", abs(found.pitch), 15.0, "degrees")


_LEVELS = ("draft", "standard", "paper")
_PLACES = (0.0, 0.25, 0.5)
"""Shifts of the fish from its own place, across the grid [cells]."""
_IN_PART = "a fish one to three cells thick covers the faces of cells in part, and water passes: less on finer grids"
_SHARES = {"draft": 0.23, "standard": 0.27, "paper": 0.34}
"""Shortfalls by the level; the worst that is known."""


def _added_mass(level: str, place: float) -> tuple[float, float]:
    """Added mass sideways by the mass displaced, and the same by strips of the fish (Lighthill 1960).

    A body that is set in motion at once keeps a share of its speed: its mass by that with the water's. Of a slender
    body a slice of depth d takes pi d^2 / 4 of water along, a length of it.
    """
    fidelity: Fidelity = registry.create(Kind.FIDELITY, Ref(level))
    env: Environment = registry.create(Kind.ENV, Ref.parse(_TANK))
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
        spread = Shortfall(_IN_PART, 0.15) if level == "draft" else None
        share = Shortfall(_IN_PART, _SHARES[level])
        record.within(f"added mass by that of strips at {level}", mean / strips, 0.75, 1.0, shortfall=share)
        record.at_most(f"spread over three places by the mean at {level}", np.ptp(masses) / mean, 0.1, shortfall=spread)
    record.at_most(
        "added mass, the largest of three levels by the least", means.max() / means.min(), 1.1,
        shortfall=Shortfall(_IN_PART, 1.7),
    )  # fmt: skip
    spacings = np.array([registry.create(Kind.FIDELITY, Ref(level)).grid_spacing for level in _LEVELS])
    figure.computed("fish", spacings, means, points=True)
    figure.reference("strips", spacings, np.full_like(spacings, strips))
