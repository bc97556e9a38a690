"""A policy: a network that maps the observation to the weights of the sine basis in every control frame."""

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from zoobench.controllers.base import PHASE_COUNT, Senses, with_phase
from zoobench.controllers.sine_basis import SineBasis
from zoobench.errors import UsageError
from zoobench.registry import Kind, register

if TYPE_CHECKING:
    from torch import Tensor


@register(Kind.CONTROLLER, "policy-network", version=2, tags=("closed-loop", "policy"))
@dataclass(frozen=True, kw_only=True)
class PolicyNetwork:
    """The sine basis, whose weights and biases a network of two hidden layers of tanh units gives in every frame.

    The inputs are the observation and the phase of the waves. The outputs are clipped to [-1, 1] and used as the
    parameters of `sine-basis`. The parameter vector holds weights and biases of each layer, a row of weights for each
    unit. The prior of the last layer's biases is that of the open loop, and its weights have a tenth of their
    deviation, so that feedback is weak at first.

    * `hidden`: units of a hidden layer.
    * `scale`: standard deviation of the initial weights of the basis.
    * `sees`: `all` of the observation, or the own `body` only: neither the task's target nor the time left.
    """

    hidden: int = 64
    scale: float = 0.3
    sees: Senses = "all"

    def __post_init__(self) -> None:
        if self.hidden < 1:
            raise UsageError(f"A network with {self.hidden} hidden units has no output. Give at least 1.")

    @property
    def _waves(self) -> SineBasis:
        return SineBasis(scale=self.scale)

    def _widths(self, muscle_count: int, inputs: int) -> list[int]:
        """Widths of the layers, from the inputs to the outputs."""
        return [inputs, self.hidden, self.hidden, self._waves.parameter_count(muscle_count)]

    def parameter_count(self, muscle_count: int, observation_count: int) -> int:
        """Weights and biases of three layers."""
        widths = self._widths(muscle_count, observation_count + PHASE_COUNT)
        return sum((inputs + 1) * outputs for inputs, outputs in pairwise(widths))

    def initial(self, rng: np.random.Generator, muscle_count: int, observation_count: int) -> NDArray[np.float64]:
        """A draw of the basis as the last biases, and random weights."""
        basis = self._waves.initial(rng, muscle_count)
        layers = pairwise(self._widths(muscle_count, observation_count + PHASE_COUNT))
        parts: list[NDArray[np.float64]] = []
        for (inputs, outputs), deviation in zip(layers, (1.0, 1.0, 0.1 * self.scale), strict=True):
            parts += [rng.normal(0.0, deviation / math.sqrt(inputs), inputs * outputs), np.zeros(outputs)]
        return np.concatenate([*parts[:-1], basis])

    def action(self, parameters: "Tensor", inputs: "Tensor", muscle_count: int) -> "Tensor":
        """The parameters of the basis in a frame, in [-1, 1], from the inputs of the network."""
        import torch

        widths = self._widths(muscle_count, len(inputs))
        sizes = [size for before, after in pairwise(widths) for size in (before * after, after)]
        inner, inner_bias, middle, middle_bias, outer, outer_bias = torch.split(parameters, sizes)
        first = torch.tanh(inner.reshape(self.hidden, -1) @ inputs + inner_bias)
        second = torch.tanh(middle.reshape(self.hidden, -1) @ first + middle_bias)
        return (outer.reshape(-1, self.hidden) @ second + outer_bias).clamp(-1.0, 1.0)

    def response(self, parameters: "Tensor", time: float, observation: "Tensor", muscle_count: int) -> "Tensor":
        """Activity `[muscle_count]`."""
        weights = self.action(parameters, with_phase(observation, time), muscle_count)
        return self._waves.actuation(weights[None], parameters.new_tensor([time]), muscle_count)[0, 0]
