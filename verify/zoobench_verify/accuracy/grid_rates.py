"""Velocity gradients that particles see on the grid, on the host: those that deform them, with every transfer."""

import numpy as np
from scipy.interpolate import BSpline

from zoobench.arrays import Array
from zoobench.sim.model.fidelity import Fidelity


def grid_rates(nodes: Array, first: Array, places: Array, fidelity: Fidelity) -> Array:
    """Velocity gradients `[n, 3, 3]` [1/s] by the moments of the nodes' velocities (Jiang et al. 2015, eq. 10).

    Args:
        nodes: velocity [m/s] and mass `[nx, ny, nz, 4]`.
        first: the grid's index of the first of them `[3]`.
        places: of the particles on the grid `[n, 3]` [m].
        fidelity: whose grid and spline these are.
    """
    width, h = fidelity.spline.width, fidelity.grid_spacing
    spline = BSpline.basis_element(np.arange(width + 1) - 0.5 * width)
    cells = places / h - first
    corner = np.floor(cells - (0.5 * width - 1.0)).astype(int)
    # of every node of the stencil in every direction [width, 3, n]
    arms = corner.T + np.arange(width)[:, None, None] - cells.T
    shares = spline(arms)
    _, ny, nz = nodes.shape[:3]
    flat = (corner[:, 0] * ny + corner[:, 1]) * nz + corner[:, 2]
    velocities = nodes[..., :3].reshape(-1, 3).T.copy()
    found = np.zeros((3, 3, len(places)))
    for i, j, k in np.ndindex(width, width, width):
        velocity = velocities.take(flat + ((i * ny + j) * nz + k), axis=1)
        weighted = shares[i, 0] * shares[j, 1] * shares[k, 2] * velocity
        for d, step in enumerate((i, j, k)):
            found[:, d] += weighted * arms[step, d]
    return fidelity.spline.inverse_moment / h * np.ascontiguousarray(np.moveaxis(found, -1, 0))
