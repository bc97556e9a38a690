"""Particles on a lattice, whose quadrature error converges (that of random seeding does not).

Each particle stands for the cell volume divided by the particles per cell, so that mass is density times volume at any
sampling.
"""

import numpy as np

from zoobench.arrays import Array
from zoobench.errors import SceneError, UsageError

_SITES: dict[int, Array] = {
    1: np.array([[0.5, 0.5, 0.5]]),
    # face-centred cubic: the most even way to put four particles into a cell
    4: np.array([[0.25, 0.25, 0.25], [0.75, 0.75, 0.25], [0.75, 0.25, 0.75], [0.25, 0.75, 0.75]]),
    8: (np.indices((2, 2, 2)).reshape(3, -1).T + 0.5) / 2,
    27: (np.indices((3, 3, 3)).reshape(3, -1).T + 0.5) / 3,
}


def particle_volume(grid_spacing: float, particles_per_cell: int) -> float:
    """The rest volume that one particle stands for [m^3]."""
    return grid_spacing**3 / particles_per_cell


def fill_box(lower: Array, upper: Array, grid_spacing: float, particles_per_cell: int) -> Array:
    """Lattice particles `[particle_count, 3]` [m] inside the box, in grid-cell order (x slowest).

    The lattice starts at `lower`, so that a body seeded on the ground plane has its lowest particles half a particle
    spacing above it, as the first-order wall requires.

    Raises:
        SceneError: the box is thinner than one particle spacing in some direction.
    """
    if particles_per_cell not in _SITES:
        raise UsageError(f"{particles_per_cell} particles per cell are not offered. Choose one of {tuple(_SITES)}.")
    lower, upper = np.asarray(lower, float), np.asarray(upper, float)
    cells = np.maximum(np.ceil((upper - lower) / grid_spacing - 1e-9), 0).astype(int)
    corners = np.indices(tuple(cells)).reshape(3, -1).T
    sites = (corners[:, None, :] + _SITES[particles_per_cell][None]).reshape(-1, 3)
    points = lower + grid_spacing * sites
    inside = points[np.all(points < upper - 1e-9 * grid_spacing, axis=1)]
    if not len(inside):
        raise SceneError(
            f"A box of {tuple(np.round(upper - lower, 6))} m holds no particle at a grid spacing of "
            f"{grid_spacing:.4g} m. Use a finer fidelity or a larger body."
        )
    return inside
