"""Design spaces by networks over space, with one flat parameter vector for hidden layers and an affine head."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from zoobench.arrays import Array
from zoobench.designs.base import Body
from zoobench.designs.fields import FIRM, FIRM_SPREAD, SHARES, SPREAD, grow, width_of
from zoobench.designs.parts import columns_of
from zoobench.designs.space import Form
from zoobench.designs.workspace import BasedSpace, features_at

if TYPE_CHECKING:
    from torch import Tensor

_MUSCLE_SPREAD = 0.75  # of the muscles' numbers over the workspace: in most places one of them dominates


@dataclass(frozen=True)
class Affine:
    """A layer y = x W / sqrt(inputs) + b, whose parameters are W, row by row, then b.

    With this scaling, parameters are of order one for any width of the layer (Jacot et al. 2018).
    """

    inputs: int
    outputs: int

    @property
    def parameter_count(self) -> int:
        """Number of weights and biases."""
        return (self.inputs + 1) * self.outputs

    def __call__(self, parameters: "Tensor", places: "Tensor") -> "Tensor":
        """`[n, outputs]` from `parameters` `[parameter_count]` and `places` `[n, inputs]`."""
        weights, bias = parameters[: -self.outputs], parameters[-self.outputs :]
        return places @ weights.reshape(self.inputs, self.outputs) / math.sqrt(self.inputs) + bias


@dataclass(frozen=True)
class Network:
    """Hidden layers of a network over space, and the size of the affine head that gives a row of numbers.

    Attributes:
        hidden: maps parameters `[hidden_count]` and features `[n, 7]` to the inputs of the head `[n, head_inputs]`.
        draw: gives parameters of the hidden layers from their prior `[hidden_count]`.
        hidden_count, head_inputs: see `hidden`.
        rate_scale: factor from the parameters to the network's weights, and so of an optimiser's learning rate. Every
            weight acts on all particles, so that their steps add up; with this factor a step of Adam changes the body
            about as much as in the particle-based space.
    """

    hidden: Callable[["Tensor", "Tensor"], "Tensor"]
    draw: Callable[[np.random.Generator], Array]
    hidden_count: int
    head_inputs: int
    rate_scale: float


@dataclass(frozen=True, kw_only=True)
class NetworkSpace(BasedSpace):
    """A design space given by a network in the workspace of a base.

    Attributes:
        network: gives every particle its row of numbers.
    """

    network: Network

    def parameter_count(self, body: Body) -> int:
        """Number of parameters of hidden layers and head."""
        return self.network.hidden_count + self._head(body).parameter_count

    def initial(self, rng: np.random.Generator, body: Body) -> Array:
        """A draw from the prior `[parameter_count]`: hidden layers from theirs, and a random head.

        Every output of the head is normalised to a mean and a deviation over the workspace: occupancy and stiffness
        as in the priors of the other spaces, and muscles that differ from place to place. With equal muscles everywhere
        a body could only expand and contract. Outputs of parts that are not optimised are left out in the end.
        """
        import torch

        network, muscle_count = self.network, body.muscle_count
        numbers = network.draw(rng)
        inputs = network.hidden(torch.as_tensor(numbers), torch.as_tensor(features_at(body.positions, body))).numpy()
        weights = rng.normal(size=(network.head_inputs, 2 + muscle_count))
        outputs = inputs @ weights / math.sqrt(network.head_inputs)
        deviations = outputs.std(axis=0)
        wanted = np.array([SPREAD, FIRM_SPREAD, *[_MUSCLE_SPREAD] * muscle_count])
        scale = wanted / np.where(deviations > 0.0, deviations, 1.0)
        bias = np.array([0.0, FIRM, *[0.0] * muscle_count]) - scale * outputs.mean(axis=0)
        bias[0] = -np.quantile(scale[0] * outputs[:, 0], 1.0 - rng.uniform(*SHARES))
        columns = columns_of(self.optimise, muscle_count)
        return np.concatenate([numbers, (scale * weights)[:, columns].ravel(), bias[columns]]) / network.rate_scale

    def form(self, parameters: "Tensor", body: Body) -> Form:
        """The forms for `parameters` `[worlds, parameter_count]`."""
        import torch

        network, places, head = self.network, torch.as_tensor(features_at(body.positions, body)), self._head(body)

        def field(row: "Tensor") -> "Tensor":
            numbers = network.rate_scale * row
            return head(numbers[network.hidden_count :], network.hidden(numbers[: network.hidden_count], places))

        return grow(parameters, body, self.optimise, field)

    def _head(self, body: Body) -> Affine:
        return Affine(self.network.head_inputs, width_of(self.optimise, body))
