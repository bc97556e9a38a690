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

_APART, _SLAB = 3.0, 0.75
"""Distance of the slices whose widths are compared, and half their thickness [edges]."""


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


def slender_growth(triangles: Array, edge: float) -> Array:
    """By how much a body's slices grow ahead, along x, across each triangle's normal `[n]` [-].

    A slice of half the width a takes rho pi a^2 of water along where it moves across that width, more and more where it
    widens (Jones 1946). A plate has panels of 4 a in a length: pi / 2 da/dx of each times its area is the growth of
    a^2 pi; of a round body it is four fifths of that. A slope is that between places three edges [m] ahead and behind,
    beyond the ends of the body, too, where there is no width. Of an edge across the flow three quarters are found, as a
    slice's width is the largest in its thickness.
    """
    middles, vectors = triangles.mean(axis=1), areas(triangles)
    across = np.cross(vectors, (1.0, 0.0, 0.0))
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-12 * edge**2)
    corners = triangles.reshape(-1, 3)
    corners = corners[np.argsort(corners[:, 0], kind="stable")]
    widths = np.zeros((2, len(triangles)))
    for side, place in enumerate((-_APART, _APART)):
        first = np.searchsorted(corners[:, 0], middles[:, 0] + (place - _SLAB) * edge)
        last = np.searchsorted(corners[:, 0], middles[:, 0] + (place + _SLAB) * edge, side="right")
        for n in np.flatnonzero(first < last):
            widths[side, n] = 0.5 * np.ptp(corners[first[n] : last[n]] @ across[n])
    return cast("Array", np.pi / 2 * (widths[1] - widths[0]) / (2 * _APART * edge))
