"""Adam (Kingma and Ba 2015) for one vector."""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from torch import Tensor

_FIRST, _SECOND = 0.9, 0.999
"""Decay of the mean and of the mean square of the gradient in a step."""

_SMALLEST = 1e-8
"""Added to the root of the mean square."""


class Adam:
    """Adam's moments of one vector, and its step: bit for bit that of `torch.optim.Adam`.

    The first use of that one loads torch's compiler, which takes longer than many a run's simulation.

    Args:
        rate: learning rate.
    """

    def __init__(self, rate: float) -> None:
        self._rate = rate
        self._steps = 0
        self._mean: Tensor | None = None
        self._square: Tensor | None = None

    def step(self, point: "Tensor", gradient: "Tensor") -> None:
        """Move the point `[parameter_count]` against the gradient `[parameter_count]`, in place."""
        if self._mean is None or self._square is None:
            self._mean, self._square = gradient.new_zeros(gradient.shape), gradient.new_zeros(gradient.shape)
        self._steps += 1
        self._mean.lerp_(gradient, 1 - _FIRST)
        self._square.mul_(_SECOND).addcmul_(gradient, gradient, value=1 - _SECOND)
        rate = self._rate / (1 - _FIRST**self._steps)
        root = (self._square.sqrt() / math.sqrt(1 - _SECOND**self._steps)).add_(_SMALLEST)
        point.addcdiv_(self._mean, root, value=-rate)

    def state(self) -> dict[str, Any]:
        """Plain data to continue from bit for bit, named as in `torch.optim.Adam`; empty before the first step."""
        if self._mean is None:
            return {}
        return {"step": self._steps, "exp_avg": self._mean, "exp_avg_sq": self._square}

    @classmethod
    def from_state(cls, rate: float, state: Mapping[str, Any]) -> "Adam":
        """The inverse of `state`."""
        adam = cls(rate)
        if state:
            adam._steps = int(state["step"])
            adam._mean, adam._square = state["exp_avg"].clone(), state["exp_avg_sq"].clone()
        return adam
