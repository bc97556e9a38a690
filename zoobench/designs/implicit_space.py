"""The implicit design space (specification H.3): a small network of the place."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from zoobench.designs.base import Array, Body
from zoobench.designs.networks import Affine, Network
from zoobench.designs.space import Form
from zoobench.designs.workspace import FEATURES, base_design, workspace
from zoobench.registry import Kind, register
from zoobench.sim.fidelity import Fidelity

if TYPE_CHECKING:
    from torch import Tensor

_WIDTH = 32


@register(Kind.DESIGN, "implicit", tags=("space",))
@dataclass(frozen=True, kw_only=True)
class ImplicitSpace:
    """A design space in which a small network says for every place how full and stiff it is, and which muscle.

    Two hidden layers of 32 with tanh. Inputs are x, y, z, the distances along the xy, xz and yz planes and the radius
    from the centre, in units of the workspace; outputs are occupancy and stiffness behind sigmoids and the muscles
    behind a softmax; fibres run ahead. The number of parameters does not depend on the fidelity. A draw from the prior
    is a random network, scaled so that the body is nearly full (about 0.8 to 0.95) and of stiffness 0.5 to 0.85, and
    its muscles are random regions with smooth borders, not those of the base.

    * `base`: the fixed design whose particles are the workspace.
    * `connected`: whether only the largest connected piece is built.
    """

    base: str = "block"
    connected: bool = True

    def __post_init__(self) -> None:
        base_design(self.base)  # one that cannot be used is refused now

    def body(self, fidelity: Fidelity) -> Body:
        """The workspace."""
        return workspace(self.base, fidelity)

    def parameter_count(self, body: Body) -> int:
        """Weights and biases of three layers."""
        return _NETWORK.parameter_count(body)

    def initial(self, rng: np.random.Generator, body: Body) -> Array:
        """A random network that is nearly full and firm."""
        return _NETWORK.initial(rng.normal(size=_NETWORK.hidden_count), rng, body)

    def form(self, parameters: "Tensor", body: Body) -> Form:
        """The forms for `parameters` `[worlds, parameter_count]`."""
        return _NETWORK.form(parameters, body)


def _hidden(parameters: "Tensor", places: "Tensor") -> "Tensor":
    """Two layers `[n, 32]` over places `[n, 7]`."""
    import torch

    seen = places
    for layer, part in zip(_LAYERS, torch.split(parameters, _COUNTS), strict=True):
        seen = torch.tanh(layer(part, seen))
    return seen


_LAYERS = (Affine(FEATURES, _WIDTH), Affine(_WIDTH, _WIDTH))
_COUNTS = [layer.parameter_count for layer in _LAYERS]
_NETWORK = Network(_hidden, hidden_count=sum(_COUNTS), seen_count=_WIDTH, pace=0.07)
