"""A fish that swims with its own muscles: its speed, and how its body moves."""

import math
from dataclasses import dataclass

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
from zoobench.verify.cases import CaseRecorder, case

_WAVELENGTH = 1.0
"""Of the wave of muscle activity, by the body's length [-]."""

_STRENGTH, _GROWTH = 2.0, 0.0
"""Parameters of the wave: muscles reach tanh(2) = 0.96 of their strength, all alike."""

_PERIODS = 6
"""The wave grows from nothing in the first: at full strength at once it turns the fish by 20 degrees."""


@dataclass(frozen=True)
class Swim:
    """How a fish swam.

    Attributes:
        times: at the beginning of every period and at the end [periods].
        strides: way ahead in every period, by the body's length `[periods]` [-].
        tail, head: amplitudes [body lengths].
        phase: by which the tail lags behind the head [rad].
        turn: of the heading, in all [degrees].
    """

    times: Array
    strides: Array
    tail: float
    head: float
    phase: float
    turn: float

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
            f"number {self.strouhal:.2f}, turn {self.turn:.0f} degrees"
        )


def _swim(frequency: float, way: float = 1.0, level: str = "standard") -> Swim:
    """The fish in the ocean at a fidelity, driven by a wave that runs to the tail (`way` 1) or to the head (-1)."""
    fidelity: Fidelity = registry.create(Kind.FIDELITY, Ref(level))
    env: Environment = registry.create(Kind.ENV, Ref("ocean"))
    design: Design = registry.create(Kind.DESIGN, Ref("fish"))
    body = design.body(fidelity)
    wave = TravellingWave(frequency=frequency, wavelength=way * _WAVELENGTH).placed(muscle_places(body))
    frames = math.ceil(_PERIODS / (frequency * FRAME_SECONDS))
    times = torch.arange(frames, dtype=torch.float64) * FRAME_SECONDS
    parameters = torch.tensor([[0.0, 0.0, _STRENGTH, _GROWTH]], dtype=torch.float64)
    beginning = torch.clamp(times * frequency, max=1.0)[:, None, None]
    activity = (beginning * wave.actuation(parameters, times, body.muscle_count)).numpy()
    rollout = Solver(env.scene(body, fidelity), fidelity, frame_seconds=FRAME_SECONDS).run(activity)
    return _measured(motion_of(rollout, body, env.robot.density, swims=True), body, frequency)


def _measured(motion: Motion, body: Body, frequency: float) -> Swim:
    """The strides along the body's mean heading in each period, as a fish turns while it begins, and the readings."""
    places, length = motion.positions[:, 0].numpy(), float(body.size[0])
    ahead = places[:, body.head].mean(axis=1) - places[:, body.tail].mean(axis=1)
    ahead[:, 1] = 0.0
    centre = motion.centre_of_mass()[:, 0].numpy()
    beats, ends = np.arange(len(centre)) * FRAME_SECONDS * frequency, np.arange(_PERIODS + 1.0)
    stops = np.stack([np.interp(ends, beats, centre[:, axis]) for axis in range(3)], axis=1)
    headings = np.stack([ahead[(beats >= n) & (beats <= n + 1)].mean(axis=0) for n in range(_PERIODS)])
    headings /= np.linalg.norm(headings, axis=1, keepdims=True)
    strides = (np.diff(stops, axis=0) * headings).sum(axis=1) / length
    found = {name: float(value[0]) for name, (value, _) in swimming_readings(motion).items()}
    return Swim(
        ends, strides, found["tail_amplitude"] / length, found["head_amplitude"] / length, found["wave_phase"],
        math.degrees(math.atan2(-headings[-1, 2], headings[-1, 0])),
    )  # fmt: skip


@case("swimming-fish", "proportion to the frequency, wave to the tail: Bainbridge 1958; Videler 1993",
      "0.15 m in 14 cells", is_fast=False, precision=32)  # fmt: skip
def swimming_fish(record: CaseRecorder) -> None:
    """Its own muscles drive it forward by a wave from head to tail, and backward by one from tail to head."""
    figure = record.plot("A fish with its own muscles", "time in periods", "way ahead [lengths]")
    swims = {frequency: _swim(frequency) for frequency in (2.0, 4.0, 8.0)}
    turned = _swim(4.0, -1.0)
    for frequency, swim in swims.items():
        figure.computed(f"{frequency:g} Hz", swim.times, np.concatenate([[0.0], swim.strides.cumsum()]))
        at = f"at {frequency:g} Hz"
        record.at_least(f"lengths per period {at}", swim.stride, 0.05)
        change = abs(swim.strides[-1] - swim.strides[-2]) / abs(swim.stride)
        record.at_most(f"change from the last period but one to the last {at}", change, 0.5)
        record.at_least(f"lag of the tail behind the head {at}", swim.phase, math.pi, "rad")
        record.remark(f"{frequency:g} Hz: {swim.text}")
        record.at_least(f"lengths per period {at}, draft", _swim(frequency, level="draft").stride, 0.0)
    figure.computed("4 Hz, to the head", turned.times, np.concatenate([[0.0], turned.strides.cumsum()]))
    ratio = turned.stride / swims[4.0].stride
    record.at_most("lengths per period by a wave to the head by that of the other", ratio, 1 / 3)
