"""A fixed sine basis, with which a design space is optimised alone."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from zoobench.controllers.sine_basis import SineBasis
from zoobench.errors import UsageError
from zoobench.registry import Kind, register

if TYPE_CHECKING:
    from torch import Tensor


@register(Kind.CONTROLLER, "fixed-sine", tags=("open-loop", "fixed"))
@dataclass(frozen=True, kw_only=True)
class FixedSine:
    """A sine basis drawn from its prior and then fixed: no parameters, so that only the body is optimised.

    It has no state of rest.

    * `seed`: of the draw.
    """

    seed: int = 0

    def __post_init__(self) -> None:
        if self.seed < 0:
            raise UsageError(f"The seed {self.seed} is negative. Give a whole number from 0 upwards.")

    def parameter_count(self, muscle_count: int) -> int:
        """None."""
        return 0

    def initial(self, rng: np.random.Generator, muscle_count: int) -> NDArray[np.float64]:
        """The empty vector."""
        return np.zeros(0)

    def actuation(self, parameters: "Tensor", times: "Tensor", muscle_count: int) -> "Tensor":
        """Activity `[frames, worlds, muscle_count]` for `parameters` `[worlds, 0]`, the same in every world."""
        import torch

        basis = SineBasis()
        drawn = times.new_tensor(basis.initial(np.random.default_rng(self.seed), muscle_count))
        # joined to the empty parameters, so that the derivative by them exists and is empty
        weights = torch.cat([parameters, drawn.expand(len(parameters), -1)], dim=1)
        return basis.actuation(weights, times, muscle_count)
