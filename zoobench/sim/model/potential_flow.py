"""Potential flow about a body that moves in water at rest, by a panel method: the added mass of its surface.

For a unit velocity of the body along an axis e, the potential solves Laplace's equation outside with dphi/dn = n . e on
the surface and vanishes far away. By Green's third identity with G = 1 / r, at the surface,

    2 pi phi(x) + int phi dOmega = -int (n . e) / r dA

where Omega is the solid angle from x. Potentials are constant on triangles, solid angles exact (van Oosterom and
Strackee 1983), and the density of water times -int phi n dA is the tensor of added mass (Lamb 1932, articles 118 to
121).
"""

from typing import cast

import numpy as np

from zoobench.arrays import Array

_BLOCK = 4_000_000
"""Pairs of triangles that are examined at once, which take some 500 MB."""

_NEAR = 3.0
"""Distance up to which a triangle counts as its four quarters [edges of the largest]."""

_ALIKE = 0.5
"""Cosine between normals of neighbours that face alike."""


def areas(triangles: Array) -> Array:
    """Area vectors `[n, 3]` [m^2] of triangles `[n, 3, 3]` [m]."""
    edges = triangles[:, 1:] - triangles[:, :1]
    return 0.5 * np.cross(edges[:, 0], edges[:, 1])


def potentials(triangles: Array) -> Array:
    """Potential `[n, 3]` [m] on triangles `[n, 3, 3]` [m] of a closed surface, for unit velocities along x, y and z."""
    count, vectors = len(triangles), areas(triangles)
    sizes = np.linalg.norm(vectors, axis=1)
    angles, sources = np.empty((count, count)), np.empty((count, count))
    step = max(1, _BLOCK // count)
    for first in range(0, count, step):
        rows = slice(first, first + step)
        at = triangles[rows].mean(axis=1)
        angles[rows] = _solid_angles(at, triangles)
        sources[rows] = _single_layers(at, triangles, sizes)
    np.fill_diagonal(angles, 2.0 * np.pi)
    np.fill_diagonal(sources, 2.0 * np.sqrt(np.pi * sizes))  # of a disc of that size, at its centre
    return np.linalg.solve(angles, -sources @ (vectors / sizes[:, None]))


def _solid_angles(points: Array, triangles: Array) -> Array:
    """Solid angles `[points, n]` of triangles as seen from points `[points, 3]`, positive from within."""
    corners = triangles[None] - points[:, None, None]
    a, b, c = corners[:, :, 0], corners[:, :, 1], corners[:, :, 2]
    size = np.sqrt(np.einsum("pnkd,pnkd->pnk", corners, corners))
    up = np.einsum("pnd,pnd->pn", a, np.cross(b, c))
    across = (
        size.prod(axis=2)
        + np.einsum("pnd,pnd->pn", a, b) * size[:, :, 2]
        + np.einsum("pnd,pnd->pn", b, c) * size[:, :, 0]
        + np.einsum("pnd,pnd->pn", c, a) * size[:, :, 1]
    )
    return cast("Array", 2.0 * np.arctan2(up, across))


def _single_layers(points: Array, triangles: Array, sizes: Array) -> Array:
    """int dA / r `[points, n]` [m] over triangles, by their middles, of near ones by those of their quarters."""
    middles = triangles.mean(axis=1)
    distance = np.linalg.norm(points[:, None] - middles[None], axis=2)
    near = np.nonzero(distance < _NEAR * np.sqrt(sizes.max()))
    found = sizes / np.maximum(distance, 1e-12)
    halves = (triangles + np.roll(triangles, -1, axis=1)) / 2.0
    quarters = [halves.mean(axis=1), *((triangles[:, k] + halves[:, k] + halves[:, k - 1]) / 3.0 for k in range(3))]
    by_quarter = [1.0 / np.linalg.norm(points[near[0]] - each[near[1]], axis=1).clip(1e-12) for each in quarters]
    found[near] = sizes[near[1]] * np.mean(by_quarter, axis=0)
    return cast("Array", found)


def added_per_area(triangles: Array, potential: Array) -> Array:
    """Added mass along each triangle's own normal, per area and density of water `[n]` [m]; where it is negative, 0."""
    vectors = areas(triangles)
    normals = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    return cast("Array", np.maximum(-(normals * potential).sum(axis=1), 0.0))


def added_volume(triangles: Array, potential: Array) -> Array:
    """Tensor of added mass of the body, by the density of water `[3, 3]` [m^3]."""
    return -areas(triangles).T @ potential


def growth(triangles: Array, values: Array, reach: float) -> Array:
    """Gradient along the surface `[n, 3]` of values at the triangles `[n]`, by least squares over neighbours within
    `reach` [m] that face alike.

    The rise at the very edge of a fin, as a square root, is lost in it: the lift of a plate comes out at half of
    Jones's.
    """
    from scipy.spatial import cKDTree

    middles, vectors = triangles.mean(axis=1), areas(triangles)
    sizes = np.linalg.norm(vectors, axis=1)
    normals, found = vectors / sizes[:, None], np.zeros(middles.shape)
    for i, near in enumerate(cKDTree(middles).query_ball_point(middles, reach)):
        near = [j for j in near if normals[j] @ normals[i] > _ALIKE]
        weights = sizes[near] * np.exp(-(((middles[near] - middles[i]) / (0.6 * reach)) ** 2).sum(axis=1))
        away = middles[near] - weights @ middles[near] / weights.sum()
        held = (weights[:, None] * away).T @ away + 1e-2 * reach**2 * weights.sum() * np.eye(3)
        found[i] = np.linalg.solve(held, (weights[:, None] * away).T @ values[near])
    return cast("Array", found - (found * normals).sum(axis=1)[:, None] * normals)
