"""AFLIP: particles keep what of their velocity the grid does not resolve, and the adjoint of that.

A particle takes from the grid the change of its velocity, and a little of the velocity itself, v_p <- share (v_p +
sum w (v_i - v_i before)) + (1 - share) sum w v_i, and the affine field as in APIC; it moves with the grid (Fei et al.
2021, without the correction of positions). The nodes' velocity before forces and contact is that of a second slab
`before`, into which the particles' own motion is scattered without stress.

Momentum is kept to round-off. Angular momentum is not quite: the part that stays with the particles is not moved
along its own direction, and that of a tumbling cube of 3 cells drifts by some 5e-4 in 100 substeps.
"""

import taichi as ti

from zoobench.sim.kernels.splines import base_node, pick, weight_slopes, weights
from zoobench.sim.kernels.transfer import node

FLIP_SHARE = 0.99
"""How much of the velocity that the grid does not resolve outlives a substep [-]; the rest is damped as in PIC."""


@ti.func
def divide_node(before: ti.template(), target: ti.template(), g, i, j, k):
    """Momentum to velocity, from `before` to `target` (maybe the same)."""
    q = before[g, i, j, k]
    if q[3] > 0.0:
        target[g, i, j, k] = ti.Vector([q[0] / q[3], q[1] / q[3], q[2] / q[3], q[3]])


@ti.func
def divide_node_adjoint(before: ti.template(), before_adjoint: ti.template(), g, i, j, k):
    """Adjoint of `divide_node`, with `before` as it is after it; an empty node has no derivative."""
    q = before[g, i, j, k]
    back = ti.Vector([0.0, 0.0, 0.0, 0.0])
    if q[3] > 0.0:
        stored = before_adjoint[g, i, j, k]
        pull = ti.Vector([stored[0], stored[1], stored[2]]) / q[3]
        back = ti.Vector([pull[0], pull[1], pull[2], -pull.dot(ti.Vector([q[0], q[1], q[2]]))])
    before_adjoint[g, i, j, k] = back


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
    grid: ti.template(), grid_adjoint: ti.template(), g, position, pull, inverse_spacing, width: ti.template()
):  # fmt: skip
    """Adjoint of `gather_velocity`: adds to the nodes' velocity adjoint, returns the position's adjoint."""
    base = base_node(position, inverse_spacing, grid, width)
    offset = position * inverse_spacing - base
    w, slopes = weights(offset, width), weight_slopes(offset, width)
    back = 0.0 * offset
    for i in range(width):
        w_i, slope_i = pick(w, i, 0, width), pick(slopes, i, 0, width)
        for j in range(width):
            w_j, slope_j = pick(w, j, 1, width), pick(slopes, j, 1, width)
            work, work_z = 0.0, 0.0
            for k in ti.static(range(width)):
                share = w_i * w_j * w[k, 2]
                added = ti.Vector([share * pull[0], share * pull[1], share * pull[2], 0.0])
                grid_adjoint[g, base[0] + i, base[1] + j, base[2] + k] += added
                along = node(grid, g, base, i, j, k).dot(pull)
                work += w[k, 2] * along
                work_z += slopes[k, 2] * along
            back += ti.Vector([slope_i * w_j * work, w_i * slope_j * work, w_i * w_j * work_z])
    return inverse_spacing * back
