"""The sine basis in a closed loop: a small network of the observation changes the weights of its waves."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from zoobench.controllers.base import Senses
from zoobench.controllers.sine_basis import SineBasis
from zoobench.errors import UsageError
from zoobench.registry import Kind, register

if TYPE_CHECKING:
    from torch import Tensor


@register(Kind.CONTROLLER, "sine-feedback", version=2, tags=("closed-loop",))
@dataclass(frozen=True, kw_only=True)
class SineFeedback:
    """The sine basis, whose weights and biases depend on the observation in every control frame.

    They are w + V tanh(U o + c), with the basis' own parameters w, the observation o and one hidden layer. The
    parameter vector is w, V, U, c, row by row. The prior of w is that of the open loop; V has a tenth of its deviation,
    so that feedback is weak at first.

    * `hidden`: size of the hidden layer.
    * `scale`: standard deviation of the initial weights of the basis.
    * `sees`: `all` of the observation, or the own `body` only: neither the task's target nor the time left.
    """

    hidden: int = 8
    scale: float = 0.3
    sees: Senses = "all"

    def __post_init__(self) -> None:
        if self.hidden < 1:
            raise UsageError(f"A network with {self.hidden} hidden units has no output. Give at least 1.")

    @property
    def _waves(self) -> SineBasis:
        return SineBasis(scale=self.scale)

    def _sizes(self, muscle_count: int, observation_count: int) -> list[int]:
        """Lengths of w, V, U and c."""
        basis = self._waves.parameter_count(muscle_count)
        return [basis, basis * self.hidden, self.hidden * observation_count, self.hidden]

    def parameter_count(self, muscle_count: int, observation_count: int) -> int:
        """The parameters of the basis and of the network."""
        return sum(self._sizes(muscle_count, observation_count))

    def initial(self, rng: np.random.Generator, muscle_count: int, observation_count: int) -> NDArray[np.float64]:
        """A draw of the basis, and a network that changes it a little."""
        basis = self._waves.initial(rng, muscle_count)
        _, outer, inner, hidden = self._sizes(muscle_count, observation_count)
        outwards = rng.normal(0.0, 0.1 * self.scale, outer)
        inwards = rng.normal(0.0, 1.0 / math.sqrt(inner / self.hidden), inner)
        return np.concatenate([basis, outwards, inwards, np.zeros(hidden)])

    def response(self, parameters: "Tensor", time: float, observation: "Tensor", muscle_count: int) -> "Tensor":
        """Activity `[muscle_count]`."""
        import torch

        basis, outwards, inwards, offsets = torch.split(parameters, self._sizes(muscle_count, len(observation)))
        hidden = torch.tanh(inwards.reshape(self.hidden, -1) @ observation + offsets)
        weights = basis + outwards.reshape(-1, self.hidden) @ hidden
        return self._waves.actuation(weights[None], parameters.new_tensor([time]), muscle_count)[0, 0]
