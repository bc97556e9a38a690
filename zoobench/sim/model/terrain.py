"""Terrain: the ground as a height field."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from zoobench.arrays import Array
from zoobench.errors import SceneError


@dataclass(frozen=True)
class Terrain:
    """A smooth height field over the arena: a bicubic spline through points on a square lattice.

    Attributes:
        heights: `[nx, nz]` [m], none below 0; at least 4 points each way.
        spacing: of the points [m]; the first lies at the arena's lower corner.
        edge: length over which the steepest places rise [m]; infinite where the terrain is smooth. A grid needs a
            column of nodes there, whose normal holds back matter that moves against the rise.
    """

    heights: Array
    spacing: float
    edge: float = np.inf

    def check(self, ceiling: float) -> None:
        """Refuse heights that are no terrain of an arena up to `ceiling` [m].

        Raises:
            SceneError: too few points, or heights that are not finite or outside the arena.
        """
        heights = self.heights
        if heights.ndim != 2 or min(heights.shape) < 4 or not 0.0 < self.spacing < np.inf:
            raise SceneError(
                f"A terrain of shape {heights.shape} and spacing {self.spacing:g} m cannot be interpolated. Give at "
                "least 4 x 4 heights, a positive distance apart."
            )
        if not np.isfinite(heights).all() or heights.min() < 0.0 or heights.max() > ceiling:
            raise SceneError(
                f"The terrain's heights range from {heights.min():.4g} to {heights.max():.4g} m. They must lie between "
                f"0 and the top of the arena at {ceiling:g} m."
            )

    def check_resolved(self, grid_spacing: float) -> None:
        """Refuse a grid of this spacing [m] whose nodes would miss an edge.

        Raises:
            SceneError: it would.
        """
        if grid_spacing > self.edge:
            raise SceneError(
                f"The terrain's edges of {self.edge:g} m are narrower than a cell of {grid_spacing:.4g} m, so that "
                "matter would pass through them. Give a longer edge or a finer fidelity."
            )

    def heights_at(self, x: Array, z: Array) -> Array:
        """Height [m] on the lattice of the coordinates `[nx]`, `[nz]` [m]: `[nx, nz]`."""
        found: Array = self._spline()(*self._inside(x, z))
        return found

    def normals_at(self, x: Array, z: Array) -> Array:
        """Upward unit normal on the lattice of the coordinates `[nx]`, `[nz]` [m]: `[nx, nz, 3]`."""
        return self._normals(x, z, on_lattice=True)

    def heights_below(self, positions: Array) -> Array:
        """Height [m] of the ground under points `[n, 3]` [m]: `[n]`."""
        found: Array = self._spline()(*self._inside(positions[:, 0], positions[:, 2]), grid=False)
        return found

    def normals_below(self, positions: Array) -> Array:
        """Upward unit normal of the ground under points `[n, 3]` [m]: `[n, 3]`."""
        return self._normals(positions[:, 0], positions[:, 2], on_lattice=False)

    def _normals(self, x: Array, z: Array, *, on_lattice: bool) -> Array:
        spline, (x, z) = self._spline(), self._inside(x, z)
        slope_x, slope_z = spline(x, z, dx=1, grid=on_lattice), spline(x, z, dy=1, grid=on_lattice)
        normal = np.stack([-slope_x, np.ones_like(slope_x), -slope_z], axis=-1)
        unit: Array = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
        return unit

    def _inside(self, x: Array, z: Array) -> tuple[Array, Array]:
        """Coordinates clamped to the field, which continues level beyond its edge."""
        size_x, size_z = (self.spacing * (count - 1) for count in self.heights.shape)
        return np.clip(x, 0.0, size_x), np.clip(z, 0.0, size_z)

    def _spline(self) -> Any:
        from scipy.interpolate import RectBivariateSpline

        x, z = (self.spacing * np.arange(count) for count in self.heights.shape)
        return RectBivariateSpline(x, z, self.heights)
