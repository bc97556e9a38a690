"""Particles to grid, grid to particles (MLS-MPM with APIC), and the adjoints of both, for one particle at a time.

The splines' moment matrix is M, h^2/4 or h^2/3, times the identity, so that one affine matrix carries both the APIC
velocity (Jiang et al. 2015) and the stress (Hu et al. 2018, eq. 17-18). What varies linearly over a stencil is given by
its value at the first node and its `slope`, the change from node to node in x, y and z. All four lanes of a node are
treated alike: the fourth is its mass. The loops are factored: terms of one index are computed in that index's loop.

`at` is the particle's `splines.stencil`, `w` its weights, `dw` their derivatives; `nodes` is the box of nodes. `field`
selects a field of the grid, `start` its first node there.
"""

import taichi as ti

from zoobench.sim.kernels.columns import matrix, scale, spatial, transposed_matvec, zero_lanes
from zoobench.sim.kernels.splines import INVERSE_MOMENT, pick

APIC, PIC, AFLIP = 0, 1, 2
"""Transfers, chosen at compile time. With PIC a particle's affine motion is not scattered; for AFLIP see `flip`."""


@ti.func
def scatter(
    grid: ti.template(), field: ti.template(), start, nodes: ti.template(), node, w: ti.template(),
    origin, slope: ti.template(), width: ti.template(),
):  # fmt: skip
    """Add w (origin + i slope_x + j slope_y + k slope_z) to the stencil's nodes (i, j, k)."""
    # for every k: the value in the present column of nodes, and its changes with i and j, times the weight in z
    value = [w[k][2] * (origin + k * slope.z) for k in ti.static(range(width))]
    by_i = [w[k][2] * slope.x for k in ti.static(range(width))]
    by_j = [w[k][2] * slope.y for k in ti.static(range(width))]
    for i in ti.static(range(width)):
        line = [value[k] for k in ti.static(range(width))]
        for j in ti.static(range(width)):
            share = w[i][0] * w[j][1]
            first = start + node + i * nodes.sx + j * nodes.sy
            for k in ti.static(range(width)):
                grid[field, first + k] += share * line[k]
                line[k] += by_j[k]
        for k in ti.static(range(width)):
            value[k] += by_i[k]


@ti.func
def gather(
    grid: ti.template(), field: ti.template(), nodes: ti.template(), node, w: ti.template(), width: ti.template()
):
    """Sums of w q, w i q, w j q and w k q of the nodes' values q: the value and its first moments about node 0."""
    total, by_x, by_y, by_z = zero_lanes(), zero_lanes(), zero_lanes(), zero_lanes()
    for i in ti.static(range(width)):
        plane, plane_y, plane_z = zero_lanes(), zero_lanes(), zero_lanes()
        for j in ti.static(range(width)):
            first = node + i * nodes.sx + j * nodes.sy
            near = w[1][2] * grid[field, first + 1]
            line, line_z = w[0][2] * grid[field, first] + near, near
            for k in ti.static(range(2, width)):
                far = w[k][2] * grid[field, first + k]
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
def gather_affine(
    grid: ti.template(), field: ti.template(), start, nodes: ti.template(), at: ti.template(), w: ti.template(),
    inverse, width: ti.template(),
):  # fmt: skip
    """A field at a particle: its value, and the affine matrix sum w v_i (x_i - x_p)^T / M of its first three lanes."""
    total, by_x, by_y, by_z = gather(grid, field, nodes, start + at.node, w, width)
    factor = ti.static(INVERSE_MOMENT[width]) * inverse
    return total, scale(factor, central_moments(at.offset, total, by_x, by_y, by_z))


@ti.func
def gather_affine_adjoint(
    grid: ti.template(), field: ti.template(), start, grid_adjoint: ti.template(), into: ti.template(),
    nodes: ti.template(), at: ti.template(), w: ti.template(), dw: ti.template(), inverse, value, value_adjoint,
    affine_adjoint: ti.template(), width: ti.template(), adds: ti.template(),
):  # fmt: skip
    """Adjoint of `gather_affine`, whose value was `value`: that of the offset, and as origin and slope what there is to
    add to the nodes' in `into`, which is done if it `adds`."""
    slope = scale(ti.static(INVERSE_MOMENT[width]) * inverse, affine_adjoint)
    origin = value_adjoint - (at.offset[0] * slope.x + at.offset[1] * slope.y + at.offset[2] * slope.z)
    by_weights = gather_adjoint(
        grid, field, start, grid_adjoint, into, nodes, at.node, w, dw, origin, slope, width, adds
    )  # fmt: skip
    # the offset also stands in the affine matrix, moments - value offset^T
    offset_adjoint = by_weights - transposed_matvec(slope, spatial(value))
    return ti.Struct(offset=offset_adjoint, origin=origin, slope=slope)


@ti.func
def gather_adjoint(
    grid: ti.template(), field: ti.template(), start, grid_adjoint: ti.template(), into: ti.template(),
    nodes: ti.template(), node, w: ti.template(), dw: ti.template(), origin, slope: ti.template(),
    width: ti.template(), adds: ti.template(),
):  # fmt: skip
    """Adjoint of `gather`, with origin + i slope_x + j slope_y + k slope_z for that of the weighted value at (i, j, k):
    if it `adds`, to the nodes' adjoint in the field `into`, and returns that of the offset."""
    by_x, by_y, by_z = zero_lanes(), zero_lanes(), zero_lanes()
    plane = origin
    for i in range(width):
        w_i, dw_i = pick(w, i, 0, width), pick(dw, i, 0, width)
        line = plane
        sum_0, sum_y, sum_z = zero_lanes(), zero_lanes(), zero_lanes()
        for j in ti.static(range(width)):
            first = node + i * nodes.sx + j * nodes.sy
            share = w_i * w[j][1]
            value = line
            line_0, line_z = zero_lanes(), zero_lanes()
            for k in ti.static(range(width)):
                # derivative by the node's weight; those by the offset follow from dw, direction by direction
                work = grid[field, start + first + k] * value
                if ti.static(adds):
                    grid_adjoint[into, first + k] += (share * w[k][2]) * value
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
def scatter_adjoint(
    grid_adjoint: ti.template(), field: ti.template(), nodes: ti.template(), node,
    w: ti.template(), dw: ti.template(), origin, slope: ti.template(), width: ti.template(),
):  # fmt: skip
    """Adjoint of `scatter`: that of the offset by the weights, and of `origin` and the three slopes."""
    by_x, by_y, by_z = zero_lanes(), zero_lanes(), zero_lanes()
    total, first_x, first_y, first_z = zero_lanes(), zero_lanes(), zero_lanes(), zero_lanes()
    plane = origin
    for i in range(width):
        w_i, dw_i = pick(w, i, 0, width), pick(dw, i, 0, width)
        line = plane
        sum_0, sum_y, sum_z = zero_lanes(), zero_lanes(), zero_lanes()
        plane_0, plane_y, plane_z = zero_lanes(), zero_lanes(), zero_lanes()
        for j in ti.static(range(width)):
            first = node + i * nodes.sx + j * nodes.sy
            value = line
            line_0, line_z, row_0, row_z = zero_lanes(), zero_lanes(), zero_lanes(), zero_lanes()
            for k in ti.static(range(width)):
                held = grid_adjoint[field, first + k]
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
def scatter_value(
    grid: ti.template(), field: ti.template(), nodes: ti.template(), node, w: ti.template(), value,
    width: ti.template(),
):  # fmt: skip
    """Add w value to the stencil's nodes."""
    for i in ti.static(range(width)):
        for j in ti.static(range(width)):
            for k in ti.static(range(width)):
                grid[field, node + i * nodes.sx + j * nodes.sy + k] += (w[i][0] * w[j][1] * w[k][2]) * value


@ti.func
def gather_value(
    grid: ti.template(), field: ti.template(), nodes: ti.template(), node, w: ti.template(), width: ti.template()
):
    """Sum of w q over the stencil's nodes."""
    total = zero_lanes()
    for i in ti.static(range(width)):
        plane = zero_lanes()
        for j in ti.static(range(width)):
            first = node + i * nodes.sx + j * nodes.sy
            line = w[0][2] * grid[field, first]
            for k in ti.static(range(1, width)):
                line += w[k][2] * grid[field, first + k]
            plane += w[j][1] * line
        total += w[i][0] * plane
    return total


@ti.func
def gather_slopes(
    grid: ti.template(), field: ti.template(), nodes: ti.template(), node, w: ti.template(), dw: ti.template(),
    width: ti.template(),
):  # fmt: skip
    """`gather_value`, and its derivatives by the offset in x, y and z."""
    total, by_x, by_y, by_z = zero_lanes(), zero_lanes(), zero_lanes(), zero_lanes()
    for i in range(width):
        w_i, dw_i = pick(w, i, 0, width), pick(dw, i, 0, width)
        sum_0, sum_y, sum_z = zero_lanes(), zero_lanes(), zero_lanes()
        for j in ti.static(range(width)):
            first = node + i * nodes.sx + j * nodes.sy
            line_0, line_z = zero_lanes(), zero_lanes()
            for k in ti.static(range(width)):
                held = grid[field, first + k]
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
