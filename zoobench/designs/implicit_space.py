"""The implicit design space (specification H.3): a small network of the place."""

from typing import TYPE_CHECKING

from zoobench.designs.networks import Affine, Network, NetworkSpace
from zoobench.designs.workspace import FEATURES
from zoobench.registry import Kind, register

if TYPE_CHECKING:
    import numpy as np
    from torch import Tensor

    from zoobench.arrays import Array

_WIDTH = 32


@register(Kind.DESIGN, "implicit", tags=("space",))
def implicit_space(*, base: str = "block", connected: bool = True) -> NetworkSpace:
    """A design space in which a small network says for every place how full and stiff it is, and which muscle.

    Two hidden layers of 32 with tanh. Inputs are x, y, z, the distances along the xy, xz and yz planes and the radius
    from the centre, in units of the workspace; outputs are occupancy and stiffness behind sigmoids and the muscles
    behind a softmax; fibres run ahead. The number of parameters does not depend on the fidelity. A draw from the prior
    is a random network, scaled so that the body is nearly full (about 0.8 to 0.95) and of stiffness 0.5 to 0.85, and
    its muscles are random regions with smooth borders, not those of the base.

    * `base`: the fixed design whose particles are the workspace.
    * `connected`: whether only the largest connected piece is built.
    """
    return NetworkSpace(base=base, connected=connected, network=_NETWORK, draw=_draw)


def _draw(rng: "np.random.Generator") -> "Array":
    """Standard normal weights and biases `[hidden_count]`."""
    return rng.normal(size=_NETWORK.hidden_count)


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
