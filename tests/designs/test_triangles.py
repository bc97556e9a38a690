"""Points on triangles."""

import numpy as np
from scipy.spatial import KDTree

from zoobench.designs.triangles import points_on


def test_points_cover_slender_triangles_and_large_ones() -> None:
    """Every place on them is within the distance of a point, every point on them, and there are few."""
    vertices = np.array([[0.0, 0, 0], [10, 0, 0], [9, 0.1, 0], [0, 7, 1]])
    faces = np.array([[0, 1, 2], [3, 1, 0]])
    points = points_on(vertices, faces, 0.5)
    weights = np.random.default_rng(0).dirichlet([1, 1, 1], size=2000)
    for face in faces:
        assert KDTree(points).query(weights @ vertices[face])[0].max() < 0.5
        assert (np.abs(points[:, None] - vertices[face]).sum(axis=2).min(axis=0) == 0.0).all()
    assert len(points) < 500
