"""Compositional pattern-producing networks (Stanley 2007): genomes of neat-python evaluated on arrays of places."""

from collections.abc import Callable
from typing import Any

import numpy as np

from zoobench.arrays import Array

_LARGEST_EXPONENT = 60.0  # patterns are clipped to [-1, 1] afterwards
_SELU_SCALE, _SELU_ALPHA = 1.0507009873554805, 1.6732632423543772  # Klambauer et al. 2017


def _held(drive: Array) -> Array:
    return np.clip(drive, -_LARGEST_EXPONENT, _LARGEST_EXPONENT)


def _selu(drive: Array) -> Array:
    return _SELU_SCALE * np.where(drive > 0.0, drive, _SELU_ALPHA * np.expm1(np.minimum(drive, 0.0)))


ACTIVATIONS: dict[str, Callable[[Array], Array]] = {
    "sigmoid": lambda drive: 1.0 / (1.0 + np.exp(-_held(5.0 * drive))),
    "tanh": lambda drive: np.tanh(2.5 * drive),
    "sin": lambda drive: np.sin(_held(5.0 * drive)),
    "gaussian": lambda drive: np.exp(-5.0 * np.clip(drive, -3.4, 3.4) ** 2),
    "selu": _selu,
    "abs": lambda drive: np.abs(drive),
    "log": lambda drive: np.log(np.maximum(drive, 1e-7)),
    "exp": lambda drive: np.exp(_held(drive)),
}
"""The activation functions of SoftZoo's paper (F.3): neat-python's, for arrays."""


def patterns(genome: Any, config: Any, places: Array) -> Array:
    """Outputs `[n, outputs]` of a genome's network at places `[n, inputs]`, all finite.

    `ACTIVATIONS` must be registered in the configuration.
    """
    from neat.nn import FeedForwardNetwork

    network = FeedForwardNetwork.create(genome, config)
    with np.errstate(over="ignore"):
        outputs = network.activate(list(places.T))
    # a node without connections gives one value for all places
    found = np.stack([np.broadcast_to(output, len(places)) for output in outputs], axis=1)
    return np.nan_to_num(found.astype(np.float64), nan=0.0)
