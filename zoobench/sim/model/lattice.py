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


MOST_PARTICLES = 5_000_000
"""Limit of a lattice: five times the particles of the largest scene that was measured."""


def particle_volume(grid_spacing: float, particles_per_cell: int) -> float:
    """The rest volume that one particle stands for [m^3]."""
    return grid_spacing**3 / particles_per_cell


def cell_points(
    sites: Array, middle: Array, grid_spacing: float, particles_per_cell: int, count: int, *, upside_down: bool = False
) -> Array:
    """Points `[site_count, n, 3]` [m] in the part of space nearest to each of the sites `[site_count, 3]` [m].

    That part is a cube; on the face-centred lattice it is a rhombic dodecahedron, and points beyond it are NaN.

    The points of an octant lie on vertical lines by an additive recurrence (Roberts 2018: powers of 1 / the plastic
    number), at heights that differ from line to line. The recurrence is shifted at random from site to site, so that
    errors of cubes do not add up. Octants are mirror images of each other, and so are sites on both sides of the
    middle, so that full cubes have their centre at the site, and symmetric solids symmetric points.

    Args:
        sites: centres of cubes.
        middle: the point `[3]` [m] about which sites are mirrored.
        grid_spacing: of the lattice [m].
        particles_per_cell: of the lattice.
        count: of points to a site, about.
        upside_down: whether sites are mirrored along y, too.
    """
    octant = count / (2 if particles_per_cell == 4 else 8)  # a quarter of them lies in the dodecahedron
    levels = max(1, round(octant ** (1 / 3) / 2))  # few, as heights differ from line to line, and lines must be many
    line = np.repeat(np.arange(max(1, round(octant / levels))), levels)
    edge = grid_spacing / (1 if particles_per_cell == 4 else round(particles_per_cell ** (1 / 3)))
    # sites in quarters of an edge, so that mirror images are equal to the last digit
    x, y, z = np.round(4.0 * (sites - middle) / edge).T
    column = 12.9898 * np.abs(x) + 78.233 * np.abs(z)
    # lines do not depend on y: points above each other share theirs, which makes meshes cheap
    across = [line * step + _scattered(column + n)[:, None] for n, step in ((1.0, 0.754877666), (2.0, 0.569840291))]
    heights = (np.arange(len(line)) % levels + line / (line.max() + 1)) / levels
    up = heights + _scattered(column + 37.719 * (np.abs(y) if upside_down else y))[:, None]
    places = np.stack([across[0], up, across[1]], axis=2) % 1.0
    if particles_per_cell == 4:  # beyond the middle between the site and another at half a cell along two axes
        places[places.sum(axis=2) - places.min(axis=2) > 1.0] = np.nan
    signs = 1.0 - 2.0 * np.indices((2, 2, 2)).reshape(3, -1).T
    found: Array = sites[:, None] + (edge / 2 * signs[:, None] * places[:, None]).reshape(len(sites), -1, 3)
    return found


def _scattered(values: Array) -> Array:
    """Numbers in [0, 1) that look random, from any numbers, the same for the same."""
    found: Array = (43758.5453 * np.sin(values)) % 1.0
    return found


def fill_box(lower: Array, upper: Array, grid_spacing: float, particles_per_cell: int) -> Array:
    """Lattice particles `[particle_count, 3]` [m] inside the box, in grid-cell order (x slowest).

    The lattice starts at `lower`, so that a body seeded on the ground plane has its lowest particles half a particle
    spacing above it, as the first-order wall requires.

    Raises:
        SceneError: the box is thinner than one particle spacing in some direction, or holds more than
            `MOST_PARTICLES`.
    """
    if particles_per_cell not in _SITES:
        raise UsageError(f"{particles_per_cell} particles per cell are not offered. Choose one of {tuple(_SITES)}.")
    lower, upper = np.asarray(lower, float), np.asarray(upper, float)
    cells = np.maximum(np.ceil((upper - lower) / grid_spacing - 1e-9), 0)
    with np.errstate(over="ignore"):
        count = float(np.prod(cells)) * particles_per_cell
    if count > MOST_PARTICLES:
        raise SceneError(
            f"A box of {_size(upper - lower)} m holds {count:.1e} particles at a grid spacing of {grid_spacing:.4g} m, "
            f"and at most {MOST_PARTICLES:.0e} are made. Use a coarser fidelity or a smaller body; lengths are in "
            "metres."
        )
    corners = np.indices(tuple(cells.astype(int))).reshape(3, -1).T
    sites = (corners[:, None, :] + _SITES[particles_per_cell][None]).reshape(-1, 3)
    points = lower + grid_spacing * sites
    inside = points[np.all(points < upper - 1e-9 * grid_spacing, axis=1)]
    if not len(inside):
        raise too_small("box", upper - lower, grid_spacing)
    return inside


def too_small(what: str, extent: Array, grid_spacing: float) -> SceneError:
    """The refusal of a box or body of this extent `[3]` [m], of which no particle is left on a grid."""
    return SceneError(
        f"A {what} of {_size(extent)} m holds no particle at a grid spacing of {grid_spacing:.4g} m. Use a finer "
        "fidelity or a larger body."
    )


def _size(extent: Array) -> tuple[float, ...]:
    return tuple(np.round(extent, 6).tolist())
