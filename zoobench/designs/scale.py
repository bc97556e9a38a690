"""The scale of a body from a file: its unit, or the length that it shall have."""

from typing import Literal

import numpy as np

from zoobench.arrays import Array
from zoobench.errors import SceneError, UsageError

Unit = Literal["auto", "m", "cm", "mm", "in"]

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}
"""A unit in metres."""

_SMALLEST, _LARGEST = 0.01, 1.0  # [m] range of a body's largest extent


def check_scale(length: float, unit: Unit) -> None:
    """Check that a length [m], 0 for none, and a unit may go together.

    Raises:
        UsageError: the length is negative or not finite, or both are given.
    """
    if not 0.0 <= length < np.inf:
        raise UsageError(f"A body of length {length:g} m cannot be. Give a length above 0, or the file's unit.")
    if length and unit != "auto":
        raise UsageError(f"length={length:g} and unit={unit} both give the scale. Leave one of them out.")


def checked_size(name: str, size: Array) -> None:
    """Check the length, height and width `[3]` [m] of a body from a file.

    Raises:
        SceneError: the largest is out of range.
    """
    if not _SMALLEST <= size.max() <= _LARGEST:
        raise SceneError(
            f"The body of {name!r} is {size[0]:g} m long, {size[1]:g} m high and {size[2]:g} m wide; "
            f"{_SMALLEST:g} to {_LARGEST:g} m was expected of the largest. Give the unit of the file, such as unit=mm, "
            "or the intended length, such as length=0.1."
        )


def scale_note(size: Array, scale: float, length: float, unit: Unit, assumed: str) -> str:
    """The size in the file and how it was scaled, as a sentence.

    Args:
        size: length, height and width in the file `[3]`.
        scale: metres per unit of the file.
        length: as it was given [m].
        unit: as it was given.
        assumed: the assumption if neither was given.
    """
    found = " x ".join(f"{edge:.4g}" for edge in size)
    body = f"The body is {found} in its file (length, height, width)"
    if unit != "auto":
        return f"{body}, in {unit}."
    if length:
        return f"{body}, scaled by {scale:.4g} to a length of {length:g} m."
    return f"{body}; {assumed}. If that is wrong, give its unit, as in unit=mm, or its length, as in length=0.15."
