"""The pose of a body from a file: which of its directions are ahead and up."""

from collections.abc import Callable
from itertools import permutations
from typing import Literal

import numpy as np

from zoobench.arrays import Array, Mask
from zoobench.errors import UsageError

Direction = Literal["auto", "x", "y", "z", "-x", "-y", "-z"]

_ALIKE = 0.02  # difference of symmetries, and of lengths relative to the longest, that does not count


def check_directions(ahead: Direction, up: Direction) -> None:
    """Check that two directions may go together.

    Raises:
        UsageError: they lie on one line.
    """
    if ahead != "auto" and ahead[-1] == up[-1]:
        raise UsageError(f"ahead={ahead} and up={up} lie on one line. Give two axes of the file.")


def directions(ahead: Direction, up: Direction, size: Array, symmetry: Callable[[int], float]) -> tuple[str, str]:
    """The directions ahead and up, those that are `auto` chosen.

    Bodies look the same from left and right. With `up=auto`, the axis along which the body is most symmetric goes from
    side to side, the longer of the others ahead, and the last up. Of equal axes, z is up if possible, then y,
    and x ahead. With `ahead=auto` alone, the longest axis other than `up` is ahead. Chosen directions are positive: a
    body that faces the other way needs `ahead=-x`.

    Args:
        size: of the box `[3]`.
        symmetry: the share of the body that is its own mirror image along an axis of the file, in [0, 1].
    """
    axes = "xyz"
    asked_ahead, asked_up = (axes if name == "auto" else name[-1] for name in (ahead, up))
    mirrored = [symmetry(axis) if up == "auto" else 0.0 for axis in range(3)]
    found: list[tuple[tuple[float, float, int], str, str]] = []
    for first, second, third in permutations(range(3)):
        if axes[first] in asked_ahead and axes[second] in asked_up:
            rank = (
                _steps(max(mirrored) - mirrored[third]),
                _steps((size.max() - size[first]) / size.max()),
                -2 * second - (first == 0),
            )
            found.append((rank, axes[first], axes[second]))
    _, chosen_ahead, chosen_up = min(found)
    return (chosen_ahead if ahead == "auto" else ahead), (chosen_up if up == "auto" else up)


def _steps(gap: float) -> float:
    return float(np.floor(gap / _ALIKE))


def mirror_symmetry(points: Array, inside: Callable[[Array], Mask], axis: int) -> float:
    """The share of points `[n, 3]` of a body whose mirror images in the middle of the box along an axis are inside."""
    mirrored = points.copy()
    mirrored[:, axis] = points[:, axis].min() + points[:, axis].max() - points[:, axis]
    return float(inside(mirrored).mean())


def pose_note(ahead: str, up: str, chosen: tuple[str, str], why: str) -> tuple[str, ...]:
    """The directions ahead and up that were not given, as a sentence; none if both were.

    Args:
        ahead, up: as they were given.
        chosen: those that were taken.
        why: of the direction up, if it is not `auto`.
    """
    if ahead == chosen[0] and up == chosen[1]:
        return ()
    reason = "" if up in ("auto", chosen[1]) else f", {why}"
    return (
        f"In the file, {chosen[0]} was taken as ahead and {chosen[1]} as up{reason}. "
        "If that is wrong, give both, as in ahead=x,up=z.",
    )


def turned(points: Array, ahead: str, up: str) -> Array:
    """Points `[n, 3]` of a file with x ahead, y up and z to the right."""
    return points @ _frame(ahead, up).T


def turned_back(points: Array, ahead: str, up: str) -> Array:
    """Points `[n, 3]` in the directions of the file, of those with x ahead, y up and z to the right."""
    return points @ _frame(ahead, up)


def _frame(ahead: str, up: str) -> Array:
    """The unit vectors ahead, up and to the right, a row each `[3, 3]`."""
    axes = np.zeros((2, 3))
    for axis, name in zip(axes, (ahead, up), strict=True):
        axis["xyz".index(name[-1])] = -1.0 if name.startswith("-") else 1.0
    return np.vstack([axes, np.cross(*axes)])
