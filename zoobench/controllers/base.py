"""The protocols of controllers: from parameters to muscle activity, in torch.

An open loop depends on time, a closed loop on the observation as well. The parameters are one flat vector. Zeros leave
every muscle at rest, if there are parameters.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array

if TYPE_CHECKING:
    from torch import Tensor


Senses = Literal["all", "body"]
"""The observation that a closed loop receives: all of it, or the robot's own body without task and clock."""

WAVE_RATE = 20.0
"""[rad/s] that scales observed velocities, with the body's length: the rate of the slow waves of the sine basis."""

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


@runtime_checkable
class OpenLoop(Protocol):
    """A controller that depends on time only."""

    def parameter_count(self, muscle_count: int) -> int:
        """Length of the parameter vector for a robot with so many muscles."""

    def initial(self, rng: np.random.Generator, muscle_count: int) -> NDArray[np.float64]:
        """A draw from the prior `[parameter_count]`, from which every method starts."""

    def actuation(self, parameters: "Tensor", times: "Tensor", muscle_count: int) -> "Tensor":
        """Activity in [-1, 1] of every muscle `[frames, worlds, muscle_count]`, constant over a control frame.

        Args:
            parameters: `[worlds, parameter_count]`.
            times: start of every frame `[frames]` [s].
            muscle_count: of the robot.
        """


@runtime_checkable
class ClosedLoop(Protocol):
    """A controller that depends on time and on the observation at the start of every control frame.

    One with an attribute `sees` of type `Senses` is given that part of the observation, any other all of it.
    """

    def parameter_count(self, muscle_count: int, observation_count: int) -> int:
        """Length of the parameter vector for a robot with so many muscles, and observations of this length."""

    def initial(self, rng: np.random.Generator, muscle_count: int, observation_count: int) -> NDArray[np.float64]:
        """A draw from the prior `[parameter_count]`, from which every method starts."""

    def response(self, parameters: "Tensor", time: float, observation: "Tensor", muscle_count: int) -> "Tensor":
        """Activity in [-1, 1] of every muscle `[muscle_count]`, constant over the control frame.

        Args:
            parameters: `[parameter_count]`.
            time: start of the frame [s].
            observation: at that time `[observation_count]`, see `zoobench.cell.observation.ObservationModel`.
            muscle_count: of the robot.
        """


@dataclass(frozen=True)
class MusclePlaces:
    """Where the muscles of a body are.

    Attributes:
        back: distance of each muscle's centre behind the foremost point, by the body's length `[muscle_count]` [-].
        side: to which side it bends the body, in [-1, 1] `[muscle_count]` [-]: 1 for one that lies on the first side
            with fibres along the body, -1 for its antagonist, 0 for one that does not bend the body. The sides are
            those of the plane in which the body bends most.
        right: the same where the sides are right and left.
        up: the same where they are back and belly.
    """

    back: Array
    side: Array
    right: Array
    up: Array


@runtime_checkable
class Placed(Protocol):
    """A controller whose activity depends on where the muscles are."""

    def placed(self, places: MusclePlaces) -> OpenLoop:
        """The controller for a body with its muscles there."""


Controller = OpenLoop | ClosedLoop
