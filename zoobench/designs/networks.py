"""Networks of the place as design spaces, whose parameters are one flat vector: hidden layers, and a head that is the
same for all."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from zoobench.arrays import Array
from zoobench.designs.base import Body
from zoobench.designs.fields import FIRM, FULL, SPREAD, grow, width_of
from zoobench.designs.space import Form
from zoobench.designs.workspace import base_design, features, workspace
from zoobench.sim.model.fidelity import Fidelity

if TYPE_CHECKING:
    from torch import Tensor

_MUSCLE_SPREAD = 3.0  # of the muscles' numbers over the workspace: in most places one of them leads


@dataclass(frozen=True)
class Affine:
    """A layer y = x W / sqrt(inputs) + b, whose parameters are W, row by row, then b.

    With the root outside, parameters are of order one however wide the layer is (Jacot et al. 2018).
    """

    inputs: int
    outputs: int

    @property
    def parameter_count(self) -> int:
        """Weights and biases."""
        return (self.inputs + 1) * self.outputs

    def __call__(self, parameters: "Tensor", places: "Tensor") -> "Tensor":
        """`[n, outputs]` from `parameters` `[parameter_count]` and `places` `[n, inputs]`."""
        weights, bias = parameters[: -self.outputs], parameters[-self.outputs :]
        return places @ weights.reshape(self.inputs, self.outputs) / math.sqrt(self.inputs) + bias


@dataclass(frozen=True)
class Network:
    """A design space as a network: its hidden layers, and behind them an affine head with a row for each particle.

    Attributes:
        hidden: its parameters `[hidden_count]` and places `[n, 7]` to what the head sees `[n, seen_count]`.
        hidden_count, seen_count: see there.
        pace: the network's numbers are its parameters times this. All numbers bear on every particle, so that steps of
            an optimiser add up: it makes a step of Adam move the body about as far as in the particle-based space.
    """

    hidden: Callable[["Tensor", "Tensor"], "Tensor"]
    hidden_count: int
    seen_count: int
    pace: float

    def parameter_count(self, body: Body) -> int:
        """Parameters of the hidden layers, then of the head."""
        return self.hidden_count + self._head(body).parameter_count

    def form(self, parameters: "Tensor", body: Body) -> Form:
        """The forms for `parameters` `[worlds, parameter_count]`."""
        import torch

        places, head = torch.as_tensor(features(body)), self._head(body)

        def field(row: "Tensor") -> "Tensor":
            numbers = self.pace * row
            return head(numbers[self.hidden_count :], self.hidden(numbers[: self.hidden_count], places))

        return grow(parameters, body, field)

    def initial(self, numbers: Array, rng: np.random.Generator, body: Body) -> Array:
        """The parameters of hidden layers with these numbers `[hidden_count]` and a random head.

        Every output of the head is shifted and scaled to a mean and a deviation over the workspace: nearly full and
        firm, as the other spaces' priors are, and muscles that differ from place to place, each of them somewhere in
        the lead. Where all muscles were alike, a body could only swell and shrink.
        """
        import torch

        seen = self.hidden(torch.as_tensor(numbers), torch.as_tensor(features(body))).numpy()
        muscle_count = body.muscle_count
        weights = rng.normal(size=(self.seen_count, 2 + muscle_count))
        outputs = seen @ weights / math.sqrt(self.seen_count)
        deviations = outputs.std(axis=0)
        wanted = np.array([SPREAD, SPREAD, *[_MUSCLE_SPREAD] * muscle_count])
        scale = wanted / np.where(deviations > 0.0, deviations, 1.0)
        bias = np.array([FULL, FIRM, *[0.0] * muscle_count]) - scale * outputs.mean(axis=0)
        return np.concatenate([numbers, (scale * weights).ravel(), bias]) / self.pace

    def _head(self, body: Body) -> Affine:
        return Affine(self.seen_count, width_of(body))


@dataclass(frozen=True, kw_only=True)
class NetworkSpace:
    """A design space that a network describes in the workspace of a base.

    Attributes:
        base: the fixed design whose particles are the workspace.
        connected: whether only the largest connected piece is built.
        network: gives every particle its row.
        draw: numbers of the network's hidden layers from their prior `[hidden_count]`.

    Raises:
        UnknownNameError, UsageError: as `base_design`.
    """

    base: str
    connected: bool
    network: Network
    draw: Callable[[np.random.Generator], Array]

    def __post_init__(self) -> None:
        base_design(self.base)  # one that cannot be used is refused now

    def body(self, fidelity: Fidelity) -> Body:
        """The workspace."""
        return workspace(self.base, fidelity)

    def parameter_count(self, body: Body) -> int:
        """Parameters of the hidden layers, then of the head."""
        return self.network.parameter_count(body)

    def initial(self, rng: np.random.Generator, body: Body) -> Array:
        """A random network that is nearly full and firm."""
        return self.network.initial(self.draw(rng), rng, body)

    def form(self, parameters: "Tensor", body: Body) -> Form:
        """The forms for `parameters` `[worlds, parameter_count]`."""
        return self.network.form(parameters, body)
