"""Compositional pattern-producing networks (Stanley 2007): genomes of neat-python as patterns over many places at
once."""

from collections.abc import Callable
from typing import Any

import numpy as np

from zoobench.arrays import Array

_STEEPEST = 60.0  # e^60 is far beyond all that is painted


def _sigmoid(drive: Array) -> Array:
    return 1.0 / (1.0 + np.exp(-np.clip(5.0 * drive, -_STEEPEST, _STEEPEST)))


def _tanh(drive: Array) -> Array:
    return np.tanh(2.5 * drive)


def _sin(drive: Array) -> Array:
    return np.sin(np.clip(5.0 * drive, -_STEEPEST, _STEEPEST))


def _gaussian(drive: Array) -> Array:
    return np.exp(-5.0 * np.clip(drive, -3.4, 3.4) ** 2)


def _selu(drive: Array) -> Array:
    scale, slope = 1.0507009873554805, 1.6732632423543772  # Klambauer et al. 2017
    return scale * np.where(drive > 0.0, drive, slope * np.expm1(np.minimum(drive, 0.0)))


def _abs(drive: Array) -> Array:
    return np.abs(drive)


def _log(drive: Array) -> Array:
    return np.log(np.maximum(drive, 1e-7))


def _exp(drive: Array) -> Array:
    return np.exp(np.clip(drive, -_STEEPEST, _STEEPEST))


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
"""Those of the specification F.3, of the same steepness as neat-python's own, but for arrays."""


def patterns(genome: Any, config: Any, places: Array) -> Array:
    """What a genome's network makes of places `[n, inputs]`: `[n, outputs]`, all finite.

    The configuration must have `ACTIVATIONS` among its activation functions.
    """
    from neat.nn import FeedForwardNetwork

    network = FeedForwardNetwork.create(genome, config)
    with np.errstate(over="ignore"):
        outputs = network.activate(list(places.T))
    # a node without connections has one value for all places
    found = np.stack([np.broadcast_to(output, len(places)) for output in outputs], axis=1)
    return np.nan_to_num(found.astype(np.float64), nan=0.0)
