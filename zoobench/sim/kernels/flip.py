"""AFLIP: particles keep the part of their velocity that the grid does not resolve (Fei et al. 2021), with its adjoint.

A particle takes the change of velocity from the grid, and a small share of the velocity itself: v_p <- share (v_p +
sum w (v_i - v_i before)) + (1 - share) sum w v_i. The affine field is as in APIC, and particles move with the grid:
the correction of positions of Fei et al. is left out. The nodes' velocity before forces and contact comes from a second
slab `before`, into which the particles' motion is scattered without stress.

Momentum is conserved to round-off. Angular momentum is not quite: the velocity that stays with the particles does not
move them, and the angular momentum of a tumbling cube of 3 cells drifts by some 5e-4 in 100 substeps.
"""

import taichi as ti

from zoobench.sim.kernels.splines import base_node, pick, weight_derivatives, weights
from zoobench.sim.kernels.transfer import node

FLIP_SHARE = 0.99
"""Share of the unresolved velocity that is kept in a substep [-]; the rest is damped as in PIC."""


@ti.func
def divide_node(before: ti.template(), target: ti.template(), g, i, j, k):
    """Momentum to velocity, from `before` to `target` (maybe the same)."""
    q = before[g, i, j, k]
    if q[3] > 0.0:
        target[g, i, j, k] = ti.Vector([q[0] / q[3], q[1] / q[3], q[2] / q[3], q[3]])


@ti.func
def divide_node_adjoint(before: ti.template(), before_adjoint: ti.template(), g, i, j, k):
    """Adjoint of `divide_node`, with `before` holding its result; an empty node has no derivative."""
    q = before[g, i, j, k]
    adjoint = ti.Vector([0.0, 0.0, 0.0, 0.0])
    if q[3] > 0.0:
        stored = before_adjoint[g, i, j, k]
        q_adjoint = ti.Vector([stored[0], stored[1], stored[2]]) / q[3]
        # v = q / m: dv/dq = 1 / m and dv/dm = -v / m
        adjoint = ti.Vector([q_adjoint[0], q_adjoint[1], q_adjoint[2], -q_adjoint.dot(ti.Vector([q[0], q[1], q[2]]))])
    before_adjoint[g, i, j, k] = adjoint


@ti.func
def gather_velocity(grid: ti.template(), g, position, inverse_spacing, width: ti.template()):
    """Velocity sum w v_i at a place."""
    base = base_node(position, inverse_spacing, grid, width)
    offset = position * inverse_spacing - base
    w = weights(offset, width)
    velocity = 0.0 * offset
    for i in range(width):
        for j in range(width):
            w_ij = pick(w, i, 0, width) * pick(w, j, 1, width)
            for k in ti.static(range(width)):
                velocity += (w_ij * w[k, 2]) * node(grid, g, base, i, j, k)
    return velocity


@ti.func
def gather_velocity_adjoint(
    grid: ti.template(), grid_adjoint: ti.template(), g, position, v_adjoint, inverse_spacing, width: ti.template()
):  # fmt: skip
    """Adjoint of `gather_velocity`: adds to the nodes' velocity adjoint, returns the position's adjoint."""
    base = base_node(position, inverse_spacing, grid, width)
    offset = position * inverse_spacing - base
    w, dw = weights(offset, width), weight_derivatives(offset, width)
    offset_adjoint = 0.0 * offset
    for i in range(width):
        w_i, dw_i = pick(w, i, 0, width), pick(dw, i, 0, width)
        for j in range(width):
            w_j, dw_j = pick(w, j, 1, width), pick(dw, j, 1, width)
            work, work_z = 0.0, 0.0
            for k in ti.static(range(width)):
                share = w_i * w_j * w[k, 2]
                added = ti.Vector([share * v_adjoint[0], share * v_adjoint[1], share * v_adjoint[2], 0.0])
                grid_adjoint[g, base[0] + i, base[1] + j, base[2] + k] += added
                along = node(grid, g, base, i, j, k).dot(v_adjoint)
                work += w[k, 2] * along
                work_z += dw[k, 2] * along
            offset_adjoint += ti.Vector([dw_i * w_j * work, w_i * dw_j * work, w_i * w_j * work_z])
    return inverse_spacing * offset_adjoint
