"""Solids by their signed distance: ellipsoids, tapered capsules, lofted trunks, flat fins, and their smooth unions.

A distance is negative inside. It is zero on the surface with a gradient of about 1, as blending and sampling require;
only that of capsules is the exact Euclidean distance.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from zoobench.arrays import Array

Point = tuple[float, float, float]
Distance = Callable[[Array], Array]
"""Points `[n, 3]` [m] to signed distances `[n]` [m]."""

_LEAST_RADIUS = 1e-4  # [m] of a cross-section, instead of 0 at a trunk's tips


def ellipsoid(centre: Point, radii: Point) -> Distance:
    """An ellipsoid along the axes; the distance is that of Quilez, k0 (k0 - 1) / k1 with k0 = |p/r|, k1 = |p/r^2|."""

    def distance(points: Array) -> Array:
        scaled = (points - centre) / radii
        size = np.linalg.norm(scaled, axis=1)
        gradient = np.linalg.norm(scaled / radii, axis=1)
        return np.where(gradient > 0.0, size * (size - 1.0) / np.maximum(gradient, 1e-12), -min(radii))

    return distance


def capsule(start: Point, end: Point, start_radius: float, end_radius: float) -> Distance:
    """A rod with round ends whose radius [m] changes linearly from start to end."""
    foot = np.array(start)
    axis = np.array(end) - foot

    def distance(points: Array) -> Array:
        offset = points - foot
        share = np.clip(np.ascontiguousarray(offset) @ axis / (axis @ axis), 0.0, 1.0)
        radius = start_radius + share * (end_radius - start_radius)
        found: Array = np.linalg.norm(offset - np.multiply.outer(axis, share).T, axis=1) - radius
        return found

    return distance


def loft(stations: Sequence[tuple[float, float, float, float]]) -> Distance:
    """A trunk along x through elliptic cross-sections (x, height of the centre, half height, half width) [m].

    Centre and squared radii are monotone cubic functions of x, so that a tip of radius 0 is round.
    """
    rows = np.array(sorted(stations))

    @cache
    def sections() -> Any:
        from scipy.interpolate import PchipInterpolator  # late: it takes long to load

        return PchipInterpolator(rows[:, 0], np.hstack([rows[:, [1]], rows[:, 2:] ** 2]))

    def distance(points: Array) -> Array:
        x = np.clip(points[:, 0], rows[0, 0], rows[-1, 0])
        centre, *squares = sections()(x).T.copy()  # columns, as numpy is slow along an axis of two
        high, wide = (np.maximum(np.sqrt(np.maximum(square, 0.0)), _LEAST_RADIUS) for square in squares)
        size = np.sqrt(((points[:, 1] - centre) / high) ** 2 + (points[:, 2] / wide) ** 2)
        across = (size - 1.0) * np.minimum(high, wide)
        beyond = np.abs(points[:, 0] - x)
        found: Array = np.where(beyond > 0.0, np.hypot(np.maximum(across, 0.0), beyond), across)
        return found

    return distance


@dataclass(frozen=True)
class Plane:
    """The plane of a flat fin: `origin` [m], and the axes of its outline, which are made orthonormal."""

    origin: Point
    along: Point
    across: Point

    def project(self, points: Array) -> Array:
        """Coordinates (along, across, off the plane) `[n, 3]` [m]."""
        along = np.array(self.along) / np.linalg.norm(self.along)
        across = np.array(self.across) - np.dot(self.across, along) * along
        across /= np.linalg.norm(across)
        found: Array = np.subtract(points, self.origin, order="C") @ np.stack(
            [along, across, np.cross(along, across)], axis=1
        )
        return found


UPRIGHT = Plane((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
"""The plane of symmetry: outlines are drawn as (x, y)."""


def fin(plane: Plane, outline: Sequence[tuple[float, float]], thickness: float) -> Distance:
    """A plate of constant `thickness` [m] with a polygonal outline [m] in a plane."""
    corners = np.array(outline)

    def distance(points: Array) -> Array:
        local = plane.project(points)
        return np.maximum(_polygon(corners, local[:, :2]), np.abs(local[:, 2]) - thickness / 2)

    return distance


def _polygon(corners: Array, points: Array) -> Array:
    """Signed distance `[n]` of points `[n, 2]` to a closed polygon `[m, 2]`: nearest edge, sign by crossing number."""
    nearest = np.full(len(points), np.inf)  # squared
    inside = np.zeros(len(points), bool)
    across, up = points.T.copy()  # one coordinate at a time is twice as fast as points of two
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        edge, x, y = end - start, across - start[0], up - start[1]
        if edge[1] != 0.0:
            crosses = (up < start[1]) != (up < end[1])
            inside ^= crosses & (x < y * (edge[0] / edge[1]))
        share = x * edge[0]  # in place from here on, which is a third faster
        share += y * edge[1]
        share /= edge @ edge
        np.minimum(np.maximum(share, 0.0, out=share), 1.0, out=share)
        x -= share * edge[0]
        y -= np.multiply(share, edge[1], out=share)
        np.square(x, out=x)
        x += np.square(y, out=y)
        np.minimum(nearest, x, out=nearest)
    distance: Array = np.sqrt(nearest)
    return np.where(inside, -distance, distance)


def mirrored(solid: Distance) -> Distance:
    """A solid of the right side (z > 0) on both sides."""

    def distance(points: Array) -> Array:
        folded = points.copy(order="K")
        np.abs(points[:, 2], out=folded[:, 2])
        return solid(folded)

    return distance


def above_and_below(solid: Distance, height: float) -> Distance:
    """A solid above a height [m], and its mirror image below."""

    def distance(points: Array) -> Array:
        folded = points.copy(order="K")
        folded[:, 1] = height + np.abs(points[:, 1] - height)
        return solid(folded)

    return distance


def smooth_union(distances: Sequence[Array], blend: float) -> Array:
    """The distance `[n]` to the union of solids, with fillets where two surfaces are nearer than `blend` [m].

    The polynomial smooth minimum min(a, b) - k/4 max(1 - |a - b| / k, 0)^2 raises a surface by at most a quarter of the
    blend k.
    """
    found = distances[0]
    for other in distances[1:]:
        near = np.maximum(1.0 - np.abs(found - other) / blend, 0.0)
        found = np.minimum(found, other) - blend / 4.0 * near**2
    return found
