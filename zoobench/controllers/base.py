"""The protocols of controllers: from parameters to muscle activity, in torch.

An open loop depends on time, a closed loop on the observation as well. The parameters are one flat vector. Zeros leave
every muscle at rest, if there are parameters.
"""

import math
from typing import TYPE_CHECKING, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from torch import Tensor


_OWN = 8
"""Length of the observation of the body: velocity, displacement, heading."""

_PER_MUSCLE = 6  # displacement and velocity

WAVE_RATE = 20.0
"""[rad/s] that scales observed velocities, with the body's length: the rate of the slow waves of the sine basis."""


def observation_count(muscle_count: int) -> int:
    """Length of an observation."""
    return _OWN + _PER_MUSCLE * muscle_count


PHASE_COUNT = 2
"""Length of the phase of the waves."""


def with_phase(observation: "Tensor", time: float) -> "Tensor":
    """The observation followed by sine and cosine of 20 rad/s times the time [s].

    This is the phase of the slow waves of the sine basis, and determines that of the fast ones, four times as fast. A
    policy that sets the weights of waves needs it.
    """
    import torch

    angle = WAVE_RATE * time
    return torch.cat([observation, observation.new_tensor([math.sin(angle), math.cos(angle)])])


class Parametrised(Protocol):
    """The parameters of open and closed loops."""

    def parameter_count(self, muscle_count: int) -> int:
        """Length of the parameter vector for a robot with so many muscles."""
        ...

    def initial(self, rng: np.random.Generator, muscle_count: int) -> NDArray[np.float64]:
        """A draw from the prior `[parameter_count]`, from which every method starts."""
        ...


@runtime_checkable
class OpenLoop(Parametrised, Protocol):
    """A controller that depends on time only."""

    def actuation(self, parameters: "Tensor", times: "Tensor", muscle_count: int) -> "Tensor":
        """Activity in [-1, 1] of every muscle `[frames, worlds, muscle_count]`, constant over a control frame.

        Args:
            parameters: `[worlds, parameter_count]`.
            times: start of every frame `[frames]` [s].
            muscle_count: of the robot.
        """
        ...


@runtime_checkable
class ClosedLoop(Parametrised, Protocol):
    """A controller that depends on time and on the observation at the start of every control frame."""

    def response(self, parameters: "Tensor", time: float, observation: "Tensor", muscle_count: int) -> "Tensor":
        """Activity in [-1, 1] of every muscle `[muscle_count]`, constant over the control frame.

        Args:
            parameters: `[parameter_count]`.
            time: start of the frame [s].
            observation: at that time, see `zoobench.cell.observation.ObservationModel`.
            muscle_count: of the robot.
        """
        ...


Controller = OpenLoop | ClosedLoop
