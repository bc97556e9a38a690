"""Velocity gradients that particles see on the grid, on the host: what moves and deforms them, whatever they keep."""

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
    found = np.zeros((len(places), 3, 3))
    for step in np.ndindex(width, width, width):
        node = corner + step
        arm = node - cells
        weighted = spline(arm).prod(axis=1)[:, None] * nodes[tuple(node.T)][:, :3]
        found += weighted[:, :, None] * arm[:, None, :]
    return fidelity.spline.inverse_moment / h * found
