"""The Diff-CPPN design space (specification H.4): a pattern-producing network with a differentiable topology."""

from typing import TYPE_CHECKING

import numpy as np

from zoobench.arrays import Array
from zoobench.designs.networks import Affine, Network, NetworkSpace
from zoobench.designs.workspace import FEATURES
from zoobench.registry import Kind, register

if TYPE_CHECKING:
    from torch import Tensor

_DEPTH, _NODES = 3, 20
_SWING = 2.0  # deviation of the initial weights: sines of about one period across the workspace
_CHOICE = 2.0  # deviation of the initial choices: most nodes are mainly one of the two functions


@register(Kind.DESIGN, "diff-cppn", tags=("space",))
def cppn_space(*, base: str = "block", connected: bool = True) -> NetworkSpace:
    """A design space of patterns: a network of sines and sigmoids whose topology is optimised by gradients too.

    Compositional pattern-producing networks (Stanley 2007) grow their graph; here a meta graph holds all graphs that
    could grow (after Fernando et al. 2016): three hidden layers of 20 nodes, an edge into every node from every input
    and every node of all layers before it, absent where its weight is 0, and in every node a choice between sine and
    sigmoid, a weighted mean of both. Inputs and outputs are those of `implicit`, and so is the prior: a random network,
    nearly full (0.8 to 0.95) and of stiffness 0.5 to 0.85, with random muscles.

    * `base`: the fixed design whose particles are the workspace.
    * `connected`: whether only the largest connected piece is built.
    """
    return NetworkSpace(base=base, connected=connected, network=_NETWORK, draw=_draw)


def _draw(rng: np.random.Generator) -> Array:
    """Weights, biases and choices of every layer `[hidden_count]`."""
    layers = [
        np.concatenate([rng.normal(0.0, _SWING, layer.parameter_count), rng.normal(0.0, _CHOICE, _NODES)])
        for layer in _LAYERS
    ]
    return np.concatenate(layers)


def _hidden(parameters: "Tensor", places: "Tensor") -> "Tensor":
    """The places `[n, 7]` and all nodes `[n, 67]`; of each layer's parameters the last are its nodes' choices."""
    import torch

    seen = places
    for layer, part in zip(_LAYERS, torch.split(parameters, _COUNTS), strict=True):
        drive, choice = layer(part[:-_NODES], seen), torch.sigmoid(part[-_NODES:])
        nodes = choice * torch.sin(drive) + (1.0 - choice) * torch.sigmoid(drive)
        seen = torch.cat([seen, nodes], dim=1)
    return seen


_LAYERS = tuple(Affine(FEATURES + number * _NODES, _NODES) for number in range(_DEPTH))
_COUNTS = [layer.parameter_count + _NODES for layer in _LAYERS]
_NETWORK = Network(_hidden, hidden_count=sum(_COUNTS), seen_count=FEATURES + _DEPTH * _NODES, pace=0.2)
