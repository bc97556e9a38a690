"""What a controller is: parameters to muscle activity, in torch."""

from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from torch import Tensor


class Controller(Protocol):
    """A policy whose parameters are one flat vector, the same for every method. Zeros leave every muscle at rest, if
    there are parameters at all."""

    def parameter_count(self, muscle_count: int) -> int:
        """Length of the parameter vector for a robot with so many muscles."""
        ...

    def initial(self, rng: np.random.Generator, muscle_count: int) -> NDArray[np.float64]:
        """A draw from the prior `[parameter_count]`, from which every method starts."""
        ...

    def actuation(self, parameters: "Tensor", times: "Tensor", muscle_count: int) -> "Tensor":
        """Activity in [-1, 1] of every muscle `[frames, worlds, muscle_count]`, held constant over a control
        frame.

        Args:
            parameters: `[worlds, parameter_count]`.
            times: start of every frame `[frames]` [s].
            muscle_count: how many muscles the robot has.
        """
        ...
