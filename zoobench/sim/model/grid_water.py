"""Water on a grid: its constants, the matrices of its pressure's solver, and how far a body's particles cover faces."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from zoobench.arrays import Array
from zoobench.errors import SceneError

SOLID_SHARE = 0.6
"""Share of volume at a particle's own place from which matter counts as solid by itself [-]: see `cover`."""

LIGHTEST = 0.5
"""Density of matter in water on a grid, relative to the water's, at least. Water that is set going with lighter matter
has more inertia than that, and their exchange of momentum would grow from step to step: a fish of 0.45 diverges at
`paper`."""

LEAST_CELLS = 2
"""Cells between walls in each direction, which the stencils of advection need."""


@dataclass(frozen=True)
class GridWater:
    """Incompressible water that fills the arena from wall to wall, without a free surface.

    Attributes:
        density: [kg/m^3].
        viscosity: kinematic [m^2/s]; the grid adds its own, in proportion to the speed.
        velocities: on the lower faces of the arena's cells `[nx, ny, nz, 3]` [m/s], zero on the walls; None for rest.
        constants: names of those that kernels have.
    """

    constants: ClassVar[tuple[str, ...]] = ("density", "viscosity")

    density: float = 1000.0
    viscosity: float = 1e-6
    velocities: Array | None = None

    @property
    def lightest(self) -> float:
        """Least density of matter in this water [kg/m^3], see `LIGHTEST`."""
        return LIGHTEST * self.density

    def check(self) -> None:
        """Refuse constants that no water has.

        Raises:
            SceneError: a density that is not positive, a negative viscosity, or velocities that are not finite.
        """
        if not 0.0 < self.density < math.inf or not 0.0 <= self.viscosity < math.inf:
            raise SceneError(
                f"Water with a density of {self.density:g} kg/m^3 and a viscosity of {self.viscosity:g} m^2/s is not "
                "possible. Give a positive density and a viscosity of 0 or more."
            )
        if self.velocities is not None and not np.isfinite(self.velocities).all():
            raise SceneError("The water's velocities hold values that are not finite. Check their source.")


def cosine_transform(count: int) -> Array:
    """The orthonormal DCT-II of `count` numbers `[mode, place]`."""
    mode, place = np.arange(count)[:, None], np.arange(count)[None] + 0.5
    found: Array = np.sqrt(2.0 / count) * np.cos(np.pi * mode * place / count)
    found[0] /= math.sqrt(2.0)
    return found


def solver_modes(cells: tuple[int, int, int]) -> Array:
    """The rows `[rows, 4]` by which the pressure of so many cells is found, see `kernels.water_grid.pressure`."""
    rows = []
    padded = [4 * math.ceil(n / 4) for n in cells]
    for n, wide in zip(cells, padded, strict=True):
        matrix = np.zeros((wide, wide))
        matrix[:n, :n] = cosine_transform(n)
        rows += [matrix.T.reshape(-1, 4), matrix.reshape(-1, 4)]
    values = [-4.0 * np.sin(0.5 * np.pi * np.arange(n) / n) ** 2 for n in cells]
    x, y, z = np.meshgrid(*values, indexing="ij")
    total = x + y + z
    total[0, 0, 0] = 1.0
    inverse = np.zeros(padded)
    inverse[tuple(slice(n) for n in cells)] = 1.0 / total
    inverse[0, 0, 0] = 0.0  # the pressure is found but for a constant
    return np.concatenate([*rows, inverse.reshape(-1, 4)])


def cover(positions: Array, volumes: Array, grid_spacing: float) -> Array:
    """Factor `[n]` of particles' volumes by which faces count as solid: 1 in the midst of a body.

    A layer thinner than a cell fills no face, and water would pass through a fin. Its particles at `positions` `[n, 3]`
    [m] with `volumes` `[n]` [m^3] count for more, in proportion, so that at their own place they fill `SOLID_SHARE`.
    """
    from scipy.sparse import coo_matrix

    scaled = positions / grid_spacing
    first = np.floor(scaled - 0.5).astype(int)
    offset = scaled - first
    weights = np.stack([0.5 * (1.5 - offset) ** 2, 0.75 - (offset - 1.0) ** 2, 0.5 * (offset - 0.5) ** 2])
    low = first.min(0)
    shape = first.max(0) + 3 - low
    stencil = np.stack(np.meshgrid(*[np.arange(3)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    nodes = np.stack([np.ravel_multi_index((first - low + step).T, tuple(shape)) for step in stencil])
    shares = np.stack([weights[step, :, np.arange(3)].prod(0) for step in stencil])
    particles = np.broadcast_to(np.arange(len(positions)), nodes.shape)
    scatter = coo_matrix((shares.ravel(), (nodes.ravel(), particles.ravel()))).tocsr()
    filled = scatter.T @ (scatter @ volumes) / grid_spacing**3
    found: Array = np.maximum(1.0, SOLID_SHARE / np.maximum(filled, 1e-3))
    return found
