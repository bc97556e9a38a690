"""AFLIP: particles keep the part of their velocity that the grid does not resolve (Fei et al. 2021), with its adjoint.

A particle takes the change of velocity from the grid, and a small share of the velocity itself: v_p <- share (v_p +
sum w (v_i - v_i before)) + (1 - share) sum w v_i. The affine field is as in APIC, and particles move with the grid:
the correction of positions of Fei et al. is left out. The nodes' velocity before forces and contact comes from a field
of its own, BEFORE, into which the particles' motion is scattered without stress.

Momentum is conserved to round-off. Angular momentum is not quite: the velocity that stays with the particles does not
move them, and the angular momentum of a tumbling cube of 3 cells drifts by some 5e-4 in 100 substeps.
"""

import taichi as ti

from zoobench.sim.kernels.columns import dot
from zoobench.sim.kernels.layout import BEFORE

FLIP_SHARE = 0.99
"""Share of the unresolved velocity that is kept in a substep [-]; the rest is damped as in PIC."""


@ti.func
def divide_node(grid: ti.template(), node):
    """Momentum to velocity at `node`."""
    q = grid[BEFORE, node]
    if q[3] > 0.0:
        r = 1.0 / q[3]
        grid[BEFORE, node] = ti.Vector([q[0] * r, q[1] * r, q[2] * r, q[3]])


@ti.func
def divide_node_adjoint(grid: ti.template(), node, grid_adjoint: ti.template(), m):
    """Adjoint of `divide_node`, whose result is at `node`, at node m; an empty node has no derivative."""
    q = grid[BEFORE, node]
    adjoint = ti.Vector([0.0, 0.0, 0.0, 0.0])
    if q[3] > 0.0:
        # v = q / m: dv/dq = 1 / m and dv/dm = -v / m
        a = grid_adjoint[BEFORE, m] * (1.0 / q[3])
        adjoint = ti.Vector([a[0], a[1], a[2], -dot(a, q)])
    grid_adjoint[BEFORE, m] = adjoint
