"""Muscles in the quarters of a hanging limb: front and back, left and right."""

from collections.abc import Iterable

import numpy as np

from zoobench.arrays import Array

BASE = 1 / 16
"""[m] Thickness of a base that is held: two cells of the coarsest fidelity."""

_QUARTERS = ("front-left", "front-right", "back-left", "back-right")


def quarter_names(parts: Iterable[str]) -> tuple[str, ...]:
    """Names of the muscles of these parts, four each."""
    return tuple(f"{part}-{quarter}" for part in parts for quarter in _QUARTERS)


def quarters(points: Array) -> Array:
    """Share of each quarter at points `[n, 3]` [m] about the limb's axis, `[n, 4]`; on a border it is divided."""
    ahead, right = (np.clip(0.5 + np.sign(np.round(points[:, axis], 12)) / 2, 0.0, 1.0) for axis in (0, 2))
    found: Array = np.stack(
        [ahead * (1 - right), ahead * right, (1 - ahead) * (1 - right), (1 - ahead) * right], axis=1
    )
    return found
