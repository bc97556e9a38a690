"""Particles to grid, grid to particles (MLS-MPM with APIC), and the adjoints of both, for one particle at a time.

The splines' moment matrix is M, h^2/4 or h^2/3, times the identity, so that one affine matrix carries both the APIC
velocity (Jiang et al. 2015) and the stress (Hu et al. 2018, eq. 17-18). Positions are relative to the grid's first
node [m]. The loops over the nodes of the stencil are factored: terms of one index are computed in that index's loop.
"""

import taichi as ti

from zoobench.sim.kernels.linalg import column, matvec, outer
from zoobench.sim.kernels.splines import INVERSE_MOMENT, QUADRATIC, base_node, pick, weight_derivatives, weights

APIC, PIC, AFLIP = 0, 1, 2
"""Transfers, chosen at compile time. With PIC a particle's affine motion is not scattered; for AFLIP see `flip`."""


def is_unrolled(width: int, transfer: int) -> bool:
    """True if the loops over all nodes of a stencil are unrolled, False if only those over the nodes of one plane.

    The time to compile grows with the square of what is unrolled: a minute or more for cubic splines or AFLIP.
    """
    return width == QUADRATIC and transfer != AFLIP


@ti.func
def node(grid: ti.template(), g, base, i: ti.template(), j: ti.template(), k: ti.template()):
    """The first three components stored at a stencil node."""
    q = grid[g, base[0] + i, base[1] + j, base[2] + k]
    return ti.Vector([q[0], q[1], q[2]])


@ti.func
def scatter(
    grid: ti.template(), g, position, momentum, affine, mass, inverse_spacing,
    width: ti.template(), transfer: ti.template(),
):  # fmt: skip
    """Add w (momentum + affine (x_i - x_p)) and w mass to the stencil of world slab g.

    `affine` is m C - dt V tau / M [kg/s].
    """
    base = base_node(position, inverse_spacing, grid, width)
    offset = position * inverse_spacing - base
    w = weights(offset, width)
    # momentum at node (i, j, k) of the stencil: origin + i, j, k times the columns of per_cell
    per_cell = affine * (1.0 / inverse_spacing)
    origin = momentum - matvec(per_cell, offset)
    if ti.static(is_unrolled(width, transfer)):
        for i in ti.static(range(width)):
            scatter_plane(grid, g, base, i, w[i, 0], w, origin, per_cell, mass, width)
    else:
        for i in range(width):
            scatter_plane(grid, g, base, i, pick(w, i, 0, width), w, origin, per_cell, mass, width)


@ti.func
def scatter_plane(
    grid: ti.template(), g, base: ti.template(), i: ti.template(), w_i, w: ti.template(),
    origin: ti.template(), per_cell: ti.template(), mass, width: ti.template(),
):  # fmt: skip
    """The part of `scatter` for the nodes of plane i."""
    plane = origin + i * column(per_cell, 0)
    for j in ti.static(range(width)):
        line = plane + j * column(per_cell, 1)
        w_ij = w_i * w[j, 1]
        for k in ti.static(range(width)):
            share = w_ij * w[k, 2]
            value = share * (line + k * column(per_cell, 2))
            added = ti.Vector([value[0], value[1], value[2], share * mass])
            grid[g, base[0] + i, base[1] + j, base[2] + k] += added


@ti.func
def gather(grid: ti.template(), g, position, inverse_spacing, width: ti.template(), transfer: ti.template()):
    """Velocity v = sum w v_i and APIC matrix C = sum w v_i (x_i - x_p)^T / M."""
    base = base_node(position, inverse_spacing, grid, width)
    offset = position * inverse_spacing - base
    w = weights(offset, width)
    zero = 0.0 * offset
    velocity, moment_x, moment_y, moment_z = zero, zero, zero, zero
    if ti.static(is_unrolled(width, transfer)):
        for i in ti.static(range(width)):
            gather_plane(grid, g, base, i, w[i, 0], w, velocity, moment_x, moment_y, moment_z, width)
    else:
        for i in range(width):
            gather_plane(grid, g, base, i, pick(w, i, 0, width), w, velocity, moment_x, moment_y, moment_z, width)
    # first moments about the base node, then about the particle: sum w v_i (x_i - x_p)^T
    moments = ti.Matrix.cols([moment_x, moment_y, moment_z])
    return velocity, (ti.static(INVERSE_MOMENT[width]) * inverse_spacing) * (moments - outer(velocity, offset))


@ti.func
def gather_plane(
    grid: ti.template(), g, base: ti.template(), i: ti.template(), w_i, w: ti.template(),
    velocity: ti.template(), moment_x: ti.template(), moment_y: ti.template(), moment_z: ti.template(),
    width: ti.template(),
):  # fmt: skip
    """Adds the contributions of the nodes of plane i to the sums of `gather`."""
    zero = 0.0 * velocity
    plane, plane_y, plane_z = zero, zero, zero
    for j in ti.static(range(width)):
        row = w[0, 2] * node(grid, g, base, i, j, 0)
        near = w[1, 2] * node(grid, g, base, i, j, 1)
        row, row_z = row + near, near
        # k = 0 and 1 are written out: their factors 0 and 1 in the first moment cost nothing
        for k in ti.static(range(2, width)):
            far = w[k, 2] * node(grid, g, base, i, j, k)
            row += far
            row_z += k * far
        line = w[j, 1] * row
        plane += line
        plane_z += w[j, 1] * row_z
        if ti.static(j > 0):
            plane_y += j * line
    velocity += w_i * plane
    moment_x += (i * w_i) * plane
    moment_y += w_i * plane_y
    moment_z += w_i * plane_z


@ti.func
def gather_adjoint(
    grid: ti.template(), grid_adjoint: ti.template(), g, position, velocity, velocity_adjoint, affine_adjoint,
    inverse_spacing, width: ti.template(), transfer: ti.template(),
):  # fmt: skip
    """Adjoint of `gather`: adds to the nodes' velocity adjoint, returns the position's adjoint.

    `grid` holds the node velocities of the forward pass, `velocity` is the gathered one.
    """
    base = base_node(position, inverse_spacing, grid, width)
    offset = position * inverse_spacing - base
    w, dw = weights(offset, width), weight_derivatives(offset, width)
    moment = (ti.static(INVERSE_MOMENT[width]) * inverse_spacing) * affine_adjoint
    # adjoint of the velocity at node (i, j, k) by its weight: origin + i, j, k times the columns of moment
    origin = velocity_adjoint - matvec(moment, offset)
    offset_adjoint = 0.0 * offset
    if ti.static(is_unrolled(width, transfer)):
        for i in ti.static(range(width)):
            gather_plane_adjoint(
                grid, grid_adjoint, g, base, i, w[i, 0], dw[i, 0], w, dw, origin, moment, offset_adjoint, width
            )
    else:
        for i in range(width):
            w_i, dw_i = pick(w, i, 0, width), pick(dw, i, 0, width)
            gather_plane_adjoint(
                grid, grid_adjoint, g, base, i, w_i, dw_i, w, dw, origin, moment, offset_adjoint, width
            )
    # the offset also stands in C = moments - velocity offset^T
    return inverse_spacing * (offset_adjoint - matvec(moment.transpose(), velocity))


@ti.func
def gather_plane_adjoint(
    grid: ti.template(), grid_adjoint: ti.template(), g, base: ti.template(), i: ti.template(), w_i, dw_i,
    w: ti.template(), dw: ti.template(), origin: ti.template(), moment: ti.template(), offset_adjoint: ti.template(),
    width: ti.template(),
):  # fmt: skip
    """Adjoint of `gather_plane`; adds to the offset's adjoint."""
    plane = origin + i * column(moment, 0)
    sum_0, sum_y, sum_z = 0.0, 0.0, 0.0
    for j in ti.static(range(width)):
        line = plane + j * column(moment, 1)
        w_ij = w_i * w[j, 1]
        line_0, line_z = 0.0, 0.0
        for k in ti.static(range(width)):
            value = line + k * column(moment, 2)
            # derivative by the node's weight; those by the offset follow from dw, direction by direction
            work = node(grid, g, base, i, j, k).dot(value)
            share = w_ij * w[k, 2]
            added = share * ti.Vector([value[0], value[1], value[2], 0.0])
            grid_adjoint[g, base[0] + i, base[1] + j, base[2] + k] += added
            line_0 += w[k, 2] * work
            line_z += dw[k, 2] * work
        sum_0 += w[j, 1] * line_0
        sum_y += dw[j, 1] * line_0
        sum_z += w[j, 1] * line_z
    offset_adjoint += ti.Vector([dw_i * sum_0, w_i * sum_y, w_i * sum_z])


@ti.func
def scatter_adjoint(
    grid_adjoint: ti.template(), g, position, momentum, affine, mass, inverse_spacing,
    width: ti.template(), transfer: ti.template(),
):  # fmt: skip
    """Adjoint of `scatter`: adjoints of (position, momentum, affine, mass).

    `grid_adjoint` holds the adjoints of the nodes' momentum (0..2) and mass (3).
    """
    base = base_node(position, inverse_spacing, grid_adjoint, width)
    offset = position * inverse_spacing - base
    w, dw = weights(offset, width), weight_derivatives(offset, width)
    per_cell = affine * (1.0 / inverse_spacing)
    origin = momentum - matvec(per_cell, offset)
    zero = 0.0 * offset
    offset_adjoint, total, first_x, first_y, first_z, mass_adjoint = zero, zero, zero, zero, zero, 0.0
    if ti.static(is_unrolled(width, transfer)):
        for i in ti.static(range(width)):
            scatter_plane_adjoint(
                grid_adjoint, g, base, i, w[i, 0], dw[i, 0], w, dw, origin, per_cell, mass,
                offset_adjoint, total, first_x, first_y, first_z, mass_adjoint, width,
            )  # fmt: skip
    else:
        for i in range(width):
            w_i, dw_i = pick(w, i, 0, width), pick(dw, i, 0, width)
            scatter_plane_adjoint(
                grid_adjoint, g, base, i, w_i, dw_i, w, dw, origin, per_cell, mass,
                offset_adjoint, total, first_x, first_y, first_z, mass_adjoint, width,
            )  # fmt: skip
    # x_p acts through the weights and through x_i - x_p
    position_adjoint = inverse_spacing * (offset_adjoint - matvec(per_cell.transpose(), total))
    affine_adjoint = (ti.Matrix.cols([first_x, first_y, first_z]) - outer(total, offset)) * (1.0 / inverse_spacing)
    return position_adjoint, total, affine_adjoint, mass_adjoint


@ti.func
def scatter_plane_adjoint(
    grid_adjoint: ti.template(), g, base: ti.template(), i: ti.template(), w_i, dw_i,
    w: ti.template(), dw: ti.template(), origin: ti.template(), per_cell: ti.template(), mass,
    offset_adjoint: ti.template(), total: ti.template(),
    first_x: ti.template(), first_y: ti.template(), first_z: ti.template(), mass_adjoint: ti.template(),
    width: ti.template(),
):  # fmt: skip
    """Adjoint of `scatter_plane`: adds to the adjoints of offset and mass, and to the weighted sums `total` and
    `first_*` (times i, j, k) of the nodes' momentum adjoints."""
    plane = origin + i * column(per_cell, 0)
    zero = 0.0 * total
    sum_0, sum_y, sum_z, sum_m = 0.0, 0.0, 0.0, 0.0
    plane_0, plane_y, plane_z = zero, zero, zero
    for j in ti.static(range(width)):
        line = plane + j * column(per_cell, 1)
        line_0, line_z, line_m = 0.0, 0.0, 0.0
        row_0, row_z = zero, zero
        for k in ti.static(range(width)):
            stored = grid_adjoint[g, base[0] + i, base[1] + j, base[2] + k]
            # w enters momentum and mass of the node alike
            held, node_mass = ti.Vector([stored[0], stored[1], stored[2]]), stored[3]
            work = (line + k * column(per_cell, 2)).dot(held) + mass * node_mass
            line_0 += w[k, 2] * work
            line_z += dw[k, 2] * work
            line_m += w[k, 2] * node_mass
            row_0 += w[k, 2] * held
            if ti.static(k > 0):
                row_z += (k * w[k, 2]) * held
        sum_0 += w[j, 1] * line_0
        sum_y += dw[j, 1] * line_0
        sum_z += w[j, 1] * line_z
        sum_m += w[j, 1] * line_m
        plane_0 += w[j, 1] * row_0
        plane_z += w[j, 1] * row_z
        if ti.static(j > 0):
            plane_y += (j * w[j, 1]) * row_0
    offset_adjoint += ti.Vector([dw_i * sum_0, w_i * sum_y, w_i * sum_z])
    mass_adjoint += w_i * sum_m
    total += w_i * plane_0
    first_x += (i * w_i) * plane_0
    first_y += w_i * plane_y
    first_z += w_i * plane_z
