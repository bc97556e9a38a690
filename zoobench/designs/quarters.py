"""Hanging limbs: their base, and muscles in their quarters, front and back, left and right."""

from collections.abc import Iterable

import numpy as np

from zoobench.arrays import Array
from zoobench.errors import UsageError

BASE = 1 / 16
"""[m] Thickness of a base that is held: two cells of the coarsest fidelity."""

BASE_CHANNELS = ("base-ahead", "base-up", "base-right")
"""Channels that move a base, after the muscles."""


def with_base(muscles: tuple[str, ...], shares: Array, speed: float) -> tuple[tuple[str, ...], Array]:
    """Muscles and their shares of the points `[n, muscles]`, with the channels of a base of this speed after them.

    A base that is held, with a speed of 0, has none. Nothing contracts with them.
    """
    if not speed:
        return muscles, shares
    return (*muscles, *BASE_CHANNELS), np.pad(shares, ((0, 0), (0, len(BASE_CHANNELS))))


def check_base_speed(speed: float) -> None:
    """Raise a `UsageError` if a base cannot move at this speed [m/s]."""
    if not 0.0 <= speed <= _FASTEST:
        raise UsageError(
            f"A base_speed of {speed:g} m/s is not possible. Give 0 for a base that is held, or up to {_FASTEST:g}."
        )


_FASTEST = 1.0

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
