"""Points on triangles."""

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array


def points_on(vertices: Array, faces: NDArray[np.int64], distance: float) -> Array:
    """Points on triangles `[n, 3]`, corners included, whose neighbours are no farther apart than this.

    Rows parallel to the shortest edge of each triangle, so that slender triangles take few.

    Args:
        vertices: `[vertex_count, 3]`.
        faces: indices of corners `[face_count, 3]`.
    """
    corners = vertices[faces]
    edges = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    first = edges.argmin(axis=1)[:, None] + np.arange(3)
    corners = np.take_along_axis(corners, (first % 3)[:, :, None], axis=1)
    counts = np.ceil(np.stack([edges.min(axis=1), edges.max(axis=1)], axis=1) / distance).astype(int)
    found = []
    for across, along in np.unique(counts, axis=0):
        a, b, c = corners[(counts == (across, along)).all(axis=1)].swapaxes(0, 1)[:, :, None]
        u, v = np.meshgrid(np.linspace(0.0, 1.0, across + 1), np.linspace(0.0, 1.0, along + 1))
        u, v = u.reshape(-1, 1), v.reshape(-1, 1)
        found.append(((a + u * (b - a)) * (1.0 - v) + v * c).reshape(-1, 3))
    return np.unique(np.concatenate(found), axis=0)
