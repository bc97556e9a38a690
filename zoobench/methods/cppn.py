"""Compositional pattern-producing networks (Stanley 2007): genomes of neat-python evaluated on arrays of places."""

from collections.abc import Callable
from typing import Any

import numpy as np

from zoobench.arrays import Array

_LARGEST_EXPONENT = 60.0  # patterns are clipped to [-1, 1] afterwards


def _sigmoid(drive: Array) -> Array:
    return 1.0 / (1.0 + np.exp(-np.clip(5.0 * drive, -_LARGEST_EXPONENT, _LARGEST_EXPONENT)))


def _tanh(drive: Array) -> Array:
    return np.tanh(2.5 * drive)


def _sin(drive: Array) -> Array:
    return np.sin(np.clip(5.0 * drive, -_LARGEST_EXPONENT, _LARGEST_EXPONENT))


def _gaussian(drive: Array) -> Array:
    return np.exp(-5.0 * np.clip(drive, -3.4, 3.4) ** 2)


def _selu(drive: Array) -> Array:
    scale, alpha = 1.0507009873554805, 1.6732632423543772  # Klambauer et al. 2017
    return scale * np.where(drive > 0.0, drive, alpha * np.expm1(np.minimum(drive, 0.0)))


def _abs(drive: Array) -> Array:
    return np.abs(drive)


def _log(drive: Array) -> Array:
    return np.log(np.maximum(drive, 1e-7))


def _exp(drive: Array) -> Array:
    return np.exp(np.clip(drive, -_LARGEST_EXPONENT, _LARGEST_EXPONENT))


ACTIVATIONS: dict[str, Callable[[Array], Array]] = {
    "sigmoid": _sigmoid,
    "tanh": _tanh,
    "sin": _sin,
    "gaussian": _gaussian,
    "selu": _selu,
    "abs": _abs,
    "log": _log,
    "exp": _exp,
}
"""The activation functions of the specification (F.3): neat-python's, for arrays."""


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
