"""The implicit design space (SoftZoo's paper, H.3): a small network over space."""

from typing import TYPE_CHECKING

from zoobench.designs.networks import Affine, Network, NetworkSpace
from zoobench.designs.parts import EVERYTHING, Optimised
from zoobench.designs.workspace import FEATURES
from zoobench.registry import Kind, register

if TYPE_CHECKING:
    import numpy as np
    from torch import Tensor

    from zoobench.arrays import Array

_WIDTH = 32


@register(Kind.DESIGN, "implicit", version=5, tags=("space",))
def implicit_space(*, base: str = "block", connected: bool = True, optimise: Optimised = EVERYTHING) -> NetworkSpace:
    """A design space in which a small network gives occupancy, stiffness and muscle at every place.

    Two hidden layers of 32 tanh units. Inputs are x, y, z, the distances from the centre in the xy, xz and yz planes
    and the radius, in units of the workspace; outputs are occupancy and stiffness, mapped by sigmoids, and the muscles,
    mapped by a softmax; fibres run ahead. The number of parameters does not depend on the fidelity. A draw from the
    prior is a random network, scaled to a share of solid matter of 0.4 to 1 and a stiffness of 0.5 to 0.85; its
    muscles are random regions with smooth borders, not those of the base. Weights are the parameters times 0.07, so
    that a step of the optimiser changes the body about as much as in `particle`: 100 steps of 0.01 can fill or empty
    nearly every place.

    * `base`: the fixed design whose particles are the workspace.
    * `connected`: whether only the largest connected piece is built.
    * `optimise`: the parts with parameters, joined by +; the others are the base's.
    """
    return NetworkSpace(base=base, connected=connected, optimise=optimise, network=_NETWORK)


def _draw(rng: "np.random.Generator") -> "Array":
    """Standard normal weights and biases `[hidden_count]`."""
    return rng.normal(size=_NETWORK.hidden_count)


def _hidden(parameters: "Tensor", places: "Tensor") -> "Tensor":
    """Units of the second layer `[n, 32]` for features `[n, 7]`."""
    import torch

    values = places
    for layer, part in zip(_LAYERS, torch.split(parameters, _COUNTS), strict=True):
        values = torch.tanh(layer(part, values))
    return values


_LAYERS = (Affine(FEATURES, _WIDTH), Affine(_WIDTH, _WIDTH))
_COUNTS = [layer.parameter_count for layer in _LAYERS]
_NETWORK = Network(_hidden, _draw, hidden_count=sum(_COUNTS), head_inputs=_WIDTH, rate_scale=0.07)
