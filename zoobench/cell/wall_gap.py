"""How near a robot comes to the sides of its arena: nearer than three cells, they have a part in its score."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from zoobench.arrays import Array

_SIDES = (0, 2)
"""The axes along which the arena has sides; the ground and the ceiling do not count."""


def wall_gaps(
    positions: Array, present: NDArray[np.bool_], lower: ArrayLike, upper: ArrayLike, grid_spacing: float
) -> Array:
    """Distance of a robot's nearest particle from a side of the arena, after every frame `[frames + 1]` [cells].

    Args:
        positions: `[frames + 1, particle_count, 3]` [m].
        present: `[particle_count]` which particles the robot has; without any it is infinitely far away.
        lower, upper: corners of the arena, `[3]` or, of one that moves, `[frames + 1, 3]` [m].
        grid_spacing: length of a cell [m].
    """
    low, high = np.asarray(lower), np.asarray(upper)
    gaps = np.full(len(positions), np.inf)
    for axis in _SIDES:
        places = positions[:, :, axis]
        least = places.min(axis=1, where=present, initial=np.inf) - low[..., axis]
        most = high[..., axis] - places.max(axis=1, where=present, initial=-np.inf)
        gaps = np.minimum(gaps, np.minimum(least, most))
    return np.asarray(gaps / grid_spacing, dtype=np.float64)
