"""The B-splines once more, by distance from the node, for the tests to compare with."""

import numpy as np

from zoobench.sim.kernels.splines import QUADRATIC


def spline(distance: np.ndarray, width: int) -> np.ndarray:
    """Weight of a node at a distance [cells]: the box function convolved with itself `width` - 1 times."""
    x = np.abs(distance)
    if width == QUADRATIC:
        near, far, edge = 0.75 - x**2, 0.5 * np.maximum(1.5 - x, 0.0) ** 2, 0.5
    else:
        near, far, edge = 2 / 3 - x**2 + x**3 / 2, np.maximum(2.0 - x, 0.0) ** 3 / 6, 1.0
    found: np.ndarray = np.where(x < edge, near, far)
    return found
