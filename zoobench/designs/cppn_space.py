"""The Diff-CPPN design space (SoftZoo's paper, H.4): a pattern-producing network with a differentiable topology."""

from typing import TYPE_CHECKING

import numpy as np

from zoobench.arrays import Array
from zoobench.designs.networks import Affine, Network, NetworkSpace
from zoobench.designs.parts import EVERYTHING, Optimised
from zoobench.designs.workspace import FEATURES
from zoobench.registry import Kind, register

if TYPE_CHECKING:
    from torch import Tensor

_DEPTH, _NODES = 3, 20
_WEIGHT_DEVIATION = 2.0  # of the initial weights: sines of about one period across the workspace
_CHOICE_DEVIATION = 2.0  # of the initial choices: in most nodes one of the two functions dominates


@register(Kind.DESIGN, "diff-cppn", version=5, tags=("space",))
def cppn_space(*, base: str = "block", connected: bool = True, optimise: Optimised = EVERYTHING) -> NetworkSpace:
    """A design space of patterns: a network of sines and sigmoids whose topology is optimised by gradients too.

    Compositional pattern-producing networks (Stanley 2007) grow their graph. Here a meta graph contains all graphs that
    could grow (after Fernando et al. 2016): three hidden layers of 20 nodes; an edge to every node from every input and
    from every node of the layers before it, which is absent if its weight is 0; in every node a weighted mean of sine
    and sigmoid. Inputs, outputs and prior are those of `implicit`: random shapes, stiffness 0.5 to 0.85, and random
    muscles. Weights are the parameters times 0.2, with the effect described there.

    * `base`: the fixed design whose particles are the workspace.
    * `connected`: whether only the largest connected piece is built.
    * `optimise`: the parts with parameters, joined by +; the others are the base's.
    """
    return NetworkSpace(base=base, connected=connected, optimise=optimise, network=_NETWORK)


def _draw(rng: np.random.Generator) -> Array:
    """Weights, biases and choices of every layer `[hidden_count]`."""
    layers = [
        np.concatenate(
            [rng.normal(0.0, _WEIGHT_DEVIATION, layer.parameter_count), rng.normal(0.0, _CHOICE_DEVIATION, _NODES)]
        )
        for layer in _LAYERS
    ]
    return np.concatenate(layers)


def _hidden(parameters: "Tensor", places: "Tensor") -> "Tensor":
    """The inputs `[n, 7]` and all nodes `[n, 67]`; each layer's last parameters are the choices of its nodes."""
    import torch

    nodes = places
    for layer, part in zip(_LAYERS, torch.split(parameters, _COUNTS), strict=True):
        drive, choice = layer(part[:-_NODES], nodes), torch.sigmoid(part[-_NODES:])
        values = choice * torch.sin(drive) + (1.0 - choice) * torch.sigmoid(drive)
        nodes = torch.cat([nodes, values], dim=1)
    return nodes


_LAYERS = tuple(Affine(FEATURES + number * _NODES, _NODES) for number in range(_DEPTH))
_COUNTS = [layer.parameter_count + _NODES for layer in _LAYERS]
_NETWORK = Network(_hidden, _draw, hidden_count=sum(_COUNTS), head_inputs=FEATURES + _DEPTH * _NODES, rate_scale=0.2)
