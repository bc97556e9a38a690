"""Particles to grid, grid to particles (MLS-MPM with APIC), and the adjoints of both, for one particle at a time.

The splines' moment matrix is M, h^2/4 or h^2/3, times the identity, so that one affine matrix carries both the APIC
velocity (Jiang et al. 2015) and the stress (Hu et al. 2018, eq. 17-18). What varies linearly over a stencil is given by
its value at the first node and its `slope`, the change from node to node in x, y and z. All four lanes of a node are
treated alike: the fourth is its mass. The loops are factored: terms of one index are computed in that index's loop.

`f` is a `context.Field` of the nodes, `at` the nodes `context.Around` a particle.
"""

import taichi as ti

from zoobench.sim.kernels.columns import matrix, scale, spatial, transposed_matvec, zero_lanes
from zoobench.sim.kernels.context import is_none
from zoobench.sim.kernels.splines import INVERSE_MOMENT, pick

APIC, PIC, AFLIP = 0, 1, 2
"""Transfers, chosen at compile time. With PIC a particle's affine motion is not scattered; for AFLIP see `flip`."""


@ti.func
def scatter(f: ti.template(), at: ti.template(), origin, slope: ti.template()):
    """Add w (origin + i slope_x + j slope_y + k slope_z) to the stencil's nodes (i, j, k)."""
    w, width = ti.static(at.w, f.width)
    # for every k: the value in the present column of nodes, and its changes with i and j, times the weight in z
    value = [w[k][2] * (origin + k * slope.z) for k in ti.static(range(width))]
    by_i = [w[k][2] * slope.x for k in ti.static(range(width))]
    by_j = [w[k][2] * slope.y for k in ti.static(range(width))]
    for i in ti.static(range(width)):
        line = [value[k] for k in ti.static(range(width))]
        for j in ti.static(range(width)):
            share = w[i][0] * w[j][1]
            first = f.start + at.node + i * f.nodes.sx + j * f.nodes.sy
            for k in ti.static(range(width)):
                f.grid[f.number, first + k] += share * line[k]
                line[k] += by_j[k]
        for k in ti.static(range(width)):
            value[k] += by_i[k]


@ti.func
def gather(f: ti.template(), at: ti.template()):
    """Sums of w q, w i q, w j q and w k q of the nodes' values q: the value and its first moments about node 0."""
    w, width = ti.static(at.w, f.width)
    total, by_x, by_y, by_z = zero_lanes(), zero_lanes(), zero_lanes(), zero_lanes()
    for i in ti.static(range(width)):
        plane, plane_y, plane_z = zero_lanes(), zero_lanes(), zero_lanes()
        for j in ti.static(range(width)):
            first = f.start + at.node + i * f.nodes.sx + j * f.nodes.sy
            near = w[1][2] * f.grid[f.number, first + 1]
            line, line_z = w[0][2] * f.grid[f.number, first] + near, near
            for k in ti.static(range(2, width)):
                far = w[k][2] * f.grid[f.number, first + k]
                line += far
                line_z += k * far
            line *= w[j][1]
            plane += line
            plane_z += w[j][1] * line_z
            if ti.static(j > 0):
                plane_y += j * line
        plane *= w[i][0]
        total += plane
        by_y += w[i][0] * plane_y
        by_z += w[i][0] * plane_z
        if ti.static(i > 0):
            by_x += i * plane
    return total, by_x, by_y, by_z


@ti.func
def central_moments(offset, total, by_x, by_y, by_z):
    """First moments about the particle, from those about the first node; of the first three lanes, as a matrix."""
    return matrix(
        spatial(by_x - offset[0] * total), spatial(by_y - offset[1] * total), spatial(by_z - offset[2] * total)
    )


@ti.func
def gather_affine(f: ti.template(), at: ti.template(), inverse):
    """A field at a particle: its value, and the affine matrix sum w v_i (x_i - x_p)^T / M of its first three lanes."""
    total, by_x, by_y, by_z = gather(f, at)
    factor = ti.static(INVERSE_MOMENT[f.width]) * inverse
    return total, scale(factor, central_moments(at.offset, total, by_x, by_y, by_z))


@ti.func
def gather_affine_adjoint(
    f: ti.template(), into: ti.template(), at: ti.template(), inverse, value, value_adjoint,
    affine_adjoint: ti.template(),
):  # fmt: skip
    """Adjoint of `gather_affine`, whose value was `value`: that of the offset, and as origin and slope what there is to
    add to the nodes' in the field `into`, which is done unless that is None."""
    slope = scale(ti.static(INVERSE_MOMENT[f.width]) * inverse, affine_adjoint)
    origin = value_adjoint - (at.offset[0] * slope.x + at.offset[1] * slope.y + at.offset[2] * slope.z)
    by_weights = gather_adjoint(f, into, at, origin, slope)
    # the offset also stands in the affine matrix, moments - value offset^T
    offset_adjoint = by_weights - transposed_matvec(slope, spatial(value))
    return ti.Struct(offset=offset_adjoint, origin=origin, slope=slope)


@ti.func
def gather_adjoint(f: ti.template(), into: ti.template(), at: ti.template(), origin, slope: ti.template()):
    """Adjoint of `gather`, with origin + i slope_x + j slope_y + k slope_z for that of the weighted value at (i, j, k):
    adds to the nodes' adjoint in the field `into`, unless that is None, and returns that of the offset."""
    w, dw, width = ti.static(at.w, at.dw, f.width)
    by_x, by_y, by_z = zero_lanes(), zero_lanes(), zero_lanes()
    plane = origin
    for i in range(width):
        w_i, dw_i = pick(w, i, 0, width), pick(dw, i, 0, width)
        line = plane
        sum_0, sum_y, sum_z = zero_lanes(), zero_lanes(), zero_lanes()
        for j in ti.static(range(width)):
            first = at.node + i * f.nodes.sx + j * f.nodes.sy
            share = w_i * w[j][1]
            value = line
            line_0, line_z = zero_lanes(), zero_lanes()
            for k in ti.static(range(width)):
                # derivative by the node's weight; those by the offset follow from dw, direction by direction
                work = f.grid[f.number, f.start + first + k] * value
                if ti.static(not is_none(into)):
                    into.grid[into.number, first + k] += (share * w[k][2]) * value
                line_0 += w[k][2] * work
                line_z += dw[k][2] * work
                value += slope.z
            sum_0 += w[j][1] * line_0
            sum_y += dw[j][1] * line_0
            sum_z += w[j][1] * line_z
            line += slope.y
        by_x += dw_i * sum_0
        by_y += w_i * sum_y
        by_z += w_i * sum_z
        plane += slope.x
    return ti.Vector([by_x.sum(), by_y.sum(), by_z.sum(), 0.0])


@ti.func
def scatter_adjoint(f: ti.template(), at: ti.template(), origin, slope: ti.template()):
    """Adjoint of `scatter`: that of the offset by the weights, and of `origin` and the three slopes."""
    w, dw, width = ti.static(at.w, at.dw, f.width)
    by_x, by_y, by_z = zero_lanes(), zero_lanes(), zero_lanes()
    total, first_x, first_y, first_z = zero_lanes(), zero_lanes(), zero_lanes(), zero_lanes()
    plane = origin
    for i in range(width):
        w_i, dw_i = pick(w, i, 0, width), pick(dw, i, 0, width)
        line = plane
        sum_0, sum_y, sum_z = zero_lanes(), zero_lanes(), zero_lanes()
        plane_0, plane_y, plane_z = zero_lanes(), zero_lanes(), zero_lanes()
        for j in ti.static(range(width)):
            first = at.node + i * f.nodes.sx + j * f.nodes.sy
            value = line
            line_0, line_z, row_0, row_z = zero_lanes(), zero_lanes(), zero_lanes(), zero_lanes()
            for k in ti.static(range(width)):
                held = f.grid[f.number, first + k]
                work = held * value
                line_0 += w[k][2] * work
                line_z += dw[k][2] * work
                share = w[k][2] * held
                row_0 += share
                if ti.static(k > 0):
                    row_z += k * share
                value += slope.z
            sum_0 += w[j][1] * line_0
            sum_y += dw[j][1] * line_0
            sum_z += w[j][1] * line_z
            row_0 *= w[j][1]
            plane_0 += row_0
            plane_z += w[j][1] * row_z
            if ti.static(j > 0):
                plane_y += j * row_0
            line += slope.y
        by_x += dw_i * sum_0
        by_y += w_i * sum_y
        by_z += w_i * sum_z
        plane_0 *= w_i
        total += plane_0
        first_y += w_i * plane_y
        first_z += w_i * plane_z
        first_x += ti.cast(i, float) * plane_0
        plane += slope.x
    return ti.Vector([by_x.sum(), by_y.sum(), by_z.sum(), 0.0]), total, first_x, first_y, first_z


@ti.func
def motion_adjoint(f: ti.template(), at: ti.template(), origin, slope: ti.template()):
    """Adjoint of scattering `origin` and `slope`: by offset, momentum and mass, and the affine matrix."""
    offset_adjoint, total, first_x, first_y, first_z = scatter_adjoint(f, at, origin, slope)
    # the offset acts through the weights and through origin = momentum - slope offset
    offset_adjoint = offset_adjoint - transposed_matvec(slope, total)
    return offset_adjoint, total, central_moments(at.offset, total, first_x, first_y, first_z)


@ti.func
def scatter_value(f: ti.template(), at: ti.template(), value):
    """Add w value to the stencil's nodes."""
    w, width = ti.static(at.w, f.width)
    for i in ti.static(range(width)):
        for j in ti.static(range(width)):
            for k in ti.static(range(width)):
                node = f.start + at.node + i * f.nodes.sx + j * f.nodes.sy + k
                f.grid[f.number, node] += (w[i][0] * w[j][1] * w[k][2]) * value


@ti.func
def gather_value(f: ti.template(), at: ti.template()):
    """Sum of w q over the stencil's nodes."""
    w, width = ti.static(at.w, f.width)
    total = zero_lanes()
    for i in ti.static(range(width)):
        plane = zero_lanes()
        for j in ti.static(range(width)):
            first = f.start + at.node + i * f.nodes.sx + j * f.nodes.sy
            line = w[0][2] * f.grid[f.number, first]
            for k in ti.static(range(1, width)):
                line += w[k][2] * f.grid[f.number, first + k]
            plane += w[j][1] * line
        total += w[i][0] * plane
    return total


@ti.func
def gather_slopes(f: ti.template(), at: ti.template()):
    """`gather_value`, and its derivatives by the offset in x, y and z."""
    w, dw, width = ti.static(at.w, at.dw, f.width)
    total, by_x, by_y, by_z = zero_lanes(), zero_lanes(), zero_lanes(), zero_lanes()
    for i in range(width):
        w_i, dw_i = pick(w, i, 0, width), pick(dw, i, 0, width)
        sum_0, sum_y, sum_z = zero_lanes(), zero_lanes(), zero_lanes()
        for j in ti.static(range(width)):
            first = f.start + at.node + i * f.nodes.sx + j * f.nodes.sy
            line_0, line_z = zero_lanes(), zero_lanes()
            for k in ti.static(range(width)):
                held = f.grid[f.number, first + k]
                line_0 += w[k][2] * held
                line_z += dw[k][2] * held
            sum_0 += w[j][1] * line_0
            sum_y += dw[j][1] * line_0
            sum_z += w[j][1] * line_z
        total += w_i * sum_0
        by_x += dw_i * sum_0
        by_y += w_i * sum_y
        by_z += w_i * sum_z
    return ti.Struct(total=total, by_x=by_x, by_y=by_y, by_z=by_z)


@ti.func
def by_offset(found: ti.template(), factors):
    """Derivative of the product of a value with `factors` by the offset, from its `gather_slopes`."""
    x, y, z = found.by_x * factors, found.by_y * factors, found.by_z * factors
    return ti.Vector([x.sum(), y.sum(), z.sum(), 0.0])
