"""Particles to grid, grid to particles (MLS-MPM with APIC), and the adjoints of both, for one particle at a time.

Quadratic B-splines: the moment matrix is h^2/4 times the identity, so that one affine matrix carries both the APIC
velocity and the stress (Hu et al. 2018, eq. 17-18). Positions are relative to the grid's first node [m]. The loops
over the 27 nodes are factored: what depends on one index is computed in that index's loop.
"""

import taichi as ti

from zoobench.sim.linalg import column, matvec, outer


@ti.func
def base_node(position, inverse_spacing, grid: ti.template()):
    """First node of the 3x3x3 stencil, kept inside the grid: an escaped particle must not write out of bounds."""
    base = ti.cast(position * inverse_spacing - 0.5, ti.i32)
    last = ti.Vector([grid.shape[1], grid.shape[2], grid.shape[3]]) - 3
    return ti.max(0, ti.min(base, last))


@ti.func
def weights(offset):
    """w[i, d]: quadratic B-spline weight of stencil node i in direction d, at `offset` [cells] from the base node."""
    return ti.Matrix.rows([0.5 * (1.5 - offset) ** 2, 0.75 - (offset - 1.0) ** 2, 0.5 * (offset - 0.5) ** 2])


@ti.func
def weight_slopes(offset):
    """d w[i, d] / d offset_d."""
    return ti.Matrix.rows([offset - 1.5, -2.0 * (offset - 1.0), offset - 0.5])


@ti.func
def node(grid: ti.template(), g, base, i: ti.template(), j: ti.template(), k: ti.template()):
    """The first three components stored at a stencil node."""
    q = grid[g, base[0] + i, base[1] + j, base[2] + k]
    return ti.Vector([q[0], q[1], q[2]])


@ti.func
def scatter(grid: ti.template(), g, position, momentum, affine, mass, inverse_spacing):
    """Add w (momentum + affine (x_i - x_p)) and w mass to the stencil of world slab g.

    `affine` is m C - dt V 4/h^2 tau [kg/s].
    """
    base = base_node(position, inverse_spacing, grid)
    offset = position * inverse_spacing - base
    w = weights(offset)
    slope = affine * (1.0 / inverse_spacing)
    origin = momentum - matvec(slope, offset)
    for i in ti.static(range(3)):
        plane = origin + i * column(slope, 0)
        for j in ti.static(range(3)):
            line = plane + j * column(slope, 1)
            w_ij = w[i, 0] * w[j, 1]
            for k in ti.static(range(3)):
                share = w_ij * w[k, 2]
                value = share * (line + k * column(slope, 2))
                added = ti.Vector([value[0], value[1], value[2], share * mass])
                grid[g, base[0] + i, base[1] + j, base[2] + k] += added


@ti.func
def gather(grid: ti.template(), g, position, inverse_spacing):
    """Velocity v = sum w v_i and APIC matrix C = 4/h^2 sum w v_i (x_i - x_p)^T."""
    base = base_node(position, inverse_spacing, grid)
    offset = position * inverse_spacing - base
    w = weights(offset)
    zero = 0.0 * offset
    velocity, moment_x, moment_y, moment_z = zero, zero, zero, zero
    for i in ti.static(range(3)):
        plane, plane_y, plane_z = zero, zero, zero
        for j in ti.static(range(3)):
            near = w[1, 2] * node(grid, g, base, i, j, 1)
            far = w[2, 2] * node(grid, g, base, i, j, 2)
            line = w[j, 1] * (w[0, 2] * node(grid, g, base, i, j, 0) + near + far)
            plane += line
            plane_z += w[j, 1] * (near + 2.0 * far)
            if ti.static(j > 0):
                plane_y += j * line
        velocity += w[i, 0] * plane
        moment_y += w[i, 0] * plane_y
        moment_z += w[i, 0] * plane_z
        if ti.static(i > 0):
            moment_x += (i * w[i, 0]) * plane
    moments = ti.Matrix.cols([moment_x, moment_y, moment_z])
    return velocity, (4.0 * inverse_spacing) * (moments - outer(velocity, offset))


@ti.func
def gather_adjoint(
    grid: ti.template(),
    grid_adjoint: ti.template(),
    g,
    position,
    velocity,
    velocity_adjoint,
    affine_adjoint,
    inverse_spacing,
):
    """Adjoint of `gather`: adds to the nodes' velocity adjoint, returns the position's adjoint.

    `grid` holds the node velocities of the forward pass, `velocity` is the gathered one.
    """
    base = base_node(position, inverse_spacing, grid)
    offset = position * inverse_spacing - base
    w, slopes = weights(offset), weight_slopes(offset)
    moment = (4.0 * inverse_spacing) * affine_adjoint
    origin = velocity_adjoint - matvec(moment, offset)
    pull_x, pull_y, pull_z = 0.0, 0.0, 0.0
    for i in ti.static(range(3)):
        plane = origin + i * column(moment, 0)
        sum_0, sum_y, sum_z = 0.0, 0.0, 0.0
        for j in ti.static(range(3)):
            line = plane + j * column(moment, 1)
            w_ij = w[i, 0] * w[j, 1]
            line_0, line_z = 0.0, 0.0
            for k in ti.static(range(3)):
                value = line + k * column(moment, 2)
                work = node(grid, g, base, i, j, k).dot(value)
                share = w_ij * w[k, 2]
                added = share * ti.Vector([value[0], value[1], value[2], 0.0])
                grid_adjoint[g, base[0] + i, base[1] + j, base[2] + k] += added
                line_0 += w[k, 2] * work
                line_z += slopes[k, 2] * work
            sum_0 += w[j, 1] * line_0
            sum_y += slopes[j, 1] * line_0
            sum_z += w[j, 1] * line_z
        pull_x += slopes[i, 0] * sum_0
        pull_y += w[i, 0] * sum_y
        pull_z += w[i, 0] * sum_z
    # the offset also stands in C = moments - velocity offset^T
    return inverse_spacing * (ti.Vector([pull_x, pull_y, pull_z]) - matvec(moment.transpose(), velocity))


@ti.func
def scatter_adjoint(grid_adjoint: ti.template(), g, position, momentum, affine, mass, inverse_spacing):
    """Adjoint of `scatter`: adjoints of (position, momentum, affine, mass).

    `grid_adjoint` holds the adjoints of the nodes' momentum (0..2) and mass (3).
    """
    base = base_node(position, inverse_spacing, grid_adjoint)
    offset = position * inverse_spacing - base
    w, slopes = weights(offset), weight_slopes(offset)
    slope = affine * (1.0 / inverse_spacing)
    origin = momentum - matvec(slope, offset)
    zero = 0.0 * offset
    pull_x, pull_y, pull_z, mass_adjoint = 0.0, 0.0, 0.0, 0.0
    total, first_x, first_y, first_z = zero, zero, zero, zero
    for i in ti.static(range(3)):
        plane = origin + i * column(slope, 0)
        sum_0, sum_y, sum_z, sum_m = 0.0, 0.0, 0.0, 0.0
        plane_0, plane_y, plane_z = zero, zero, zero
        for j in ti.static(range(3)):
            line = plane + j * column(slope, 1)
            line_0, line_z, line_m = 0.0, 0.0, 0.0
            row_0, row_z = zero, zero
            for k in ti.static(range(3)):
                stored = grid_adjoint[g, base[0] + i, base[1] + j, base[2] + k]
                pull, node_mass = ti.Vector([stored[0], stored[1], stored[2]]), stored[3]
                work = (line + k * column(slope, 2)).dot(pull) + mass * node_mass
                line_0 += w[k, 2] * work
                line_z += slopes[k, 2] * work
                line_m += w[k, 2] * node_mass
                row_0 += w[k, 2] * pull
                if ti.static(k > 0):
                    row_z += (k * w[k, 2]) * pull
            sum_0 += w[j, 1] * line_0
            sum_y += slopes[j, 1] * line_0
            sum_z += w[j, 1] * line_z
            sum_m += w[j, 1] * line_m
            plane_0 += w[j, 1] * row_0
            plane_z += w[j, 1] * row_z
            if ti.static(j > 0):
                plane_y += (j * w[j, 1]) * row_0
        pull_x += slopes[i, 0] * sum_0
        pull_y += w[i, 0] * sum_y
        pull_z += w[i, 0] * sum_z
        mass_adjoint += w[i, 0] * sum_m
        total += w[i, 0] * plane_0
        first_y += w[i, 0] * plane_y
        first_z += w[i, 0] * plane_z
        if ti.static(i > 0):
            first_x += (i * w[i, 0]) * plane_0
    position_adjoint = inverse_spacing * (ti.Vector([pull_x, pull_y, pull_z]) - matvec(slope.transpose(), total))
    affine_adjoint = (ti.Matrix.cols([first_x, first_y, first_z]) - outer(total, offset)) * (1.0 / inverse_spacing)
    return position_adjoint, total, affine_adjoint, mass_adjoint
