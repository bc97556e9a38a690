"""What a controller is: parameters to muscle activity, in torch.

In an open loop it follows the clock, in a closed one what the robot feels as well. The parameters are one flat vector,
the same for every method. Zeros leave every muscle at rest, if there are parameters at all.
"""

import math
from typing import TYPE_CHECKING, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from torch import Tensor


_OWN = 8
"""Numbers that do not belong to a muscle: velocity, displacement, heading."""

_PER_MUSCLE = 6

WAVE_RATE = 20.0
"""[rad/s] that scales observed velocities, with the body's length: the rate of the slow waves of the sine basis."""


def observation_count(muscle_count: int) -> int:
    """How many numbers an observation has."""
    return _OWN + _PER_MUSCLE * muscle_count


PHASE_COUNT = 2
"""Numbers that tell the phase of the waves."""


def with_phase(observation: "Tensor", time: float) -> "Tensor":
    """The observation, and behind it sine and cosine of 20 rad/s times the time [s]: the phase of the slow waves of the
    sine basis, and so of the fast ones, four times as fast.

    A policy that sets the weights of waves needs it to foresee what its weights will do.
    """
    import torch

    angle = WAVE_RATE * time
    return torch.cat([observation, observation.new_tensor([math.sin(angle), math.cos(angle)])])


class Parametrised(Protocol):
    """What open and closed loops share."""

    def parameter_count(self, muscle_count: int) -> int:
        """Length of the parameter vector for a robot with so many muscles."""
        ...

    def initial(self, rng: np.random.Generator, muscle_count: int) -> NDArray[np.float64]:
        """A draw from the prior `[parameter_count]`, from which every method starts."""
        ...


@runtime_checkable
class OpenLoop(Parametrised, Protocol):
    """A controller that follows the clock alone."""

    def actuation(self, parameters: "Tensor", times: "Tensor", muscle_count: int) -> "Tensor":
        """Activity in [-1, 1] of every muscle `[frames, worlds, muscle_count]`, held constant over a control
        frame.

        Args:
            parameters: `[worlds, parameter_count]`.
            times: start of every frame `[frames]` [s].
            muscle_count: how many muscles the robot has.
        """
        ...


@runtime_checkable
class ClosedLoop(Parametrised, Protocol):
    """A controller that acts by what the robot feels of itself, once a control frame."""

    def response(self, parameters: "Tensor", time: float, observation: "Tensor", muscle_count: int) -> "Tensor":
        """Activity in [-1, 1] of every muscle `[muscle_count]`, held constant over the control frame.

        Args:
            parameters: `[parameter_count]`.
            time: start of the frame [s].
            observation: at that time, see `zoobench.cell.observation.ObservationModel`.
            muscle_count: how many muscles the robot has.
        """
        ...


Controller = OpenLoop | ClosedLoop
