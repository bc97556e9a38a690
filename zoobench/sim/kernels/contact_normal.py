"""The normal of a contact between bodies in velocity fields of their own; and its adjoint.

Against a medium the normal is the gradient of its mass, by differences between neighbours: a bed is smooth on the scale
of the grid, while the gradient of a robot of a few cells is tilted along all its edges, on which it would stick. Medium
without a gradient, deep in the robot or in the midst of splashes, moves with it. Between a robot and an object, or two
objects, it is the mean of both gradients, that of the flatter surface first, see `flatness`.
"""

import taichi as ti

from zoobench.sim.kernels.boundary import WALL_NODES
from zoobench.sim.kernels.layout import MOMENTUM
from zoobench.sim.kernels.room import free_volume_beside, ground_height

FLAT = 0.01
"""Gradient of the medium's volume share [1/cell] below which there is no normal; at a surface it is 0.48."""

LEAST_SHARE = 0.02
"""Of a body's volume at a node, from void and from full, to tell how flat its surface is [-]."""


@ti.func
def beside(c: ti.template(), index: ti.template(), rooms):
    """Factors of the shares' masses at the next and at the last node along each direction in central differences: zero
    beside the window, and both along a wall's normal on its plane and beyond."""
    count = (c.scene.nodes_x, c.scene.nodes_y, c.scene.nodes_z)
    low = (1.0 * WALL_NODES, ground_height(c.terrain, index, c.variant.ground), 1.0 * WALL_NODES)
    up, down = ti.Vector([0.0, 0.0, 0.0]), ti.Vector([0.0, 0.0, 0.0])
    for d in ti.static(range(3)):
        if index[d] > low[d] and index[d] < count[d] - 1 - WALL_NODES:
            if index[d] + 1 < c.window[c.window_slot, c.w, 3 + d]:
                up[d] = 0.5 / free_volume_beside(c, index, rooms, d, 1)
            if index[d] > c.window[c.window_slot, c.w, d]:
                down[d] = 0.5 / free_volume_beside(c, index, rooms, d, -1)
    return up, down


@ti.func
def mass_gradient(c: ti.template(), k: ti.template(), m, up, down):
    """Gradient of the mass at node m of layer k [kg/cell], as if it filled what walls cut off."""
    slope = ti.Vector([0.0, 0.0, 0.0])
    for d in ti.static(range(3)):
        stride = (c.nodes.sx, c.nodes.sy, 1)[d]
        if up[d] > 0.0:
            slope[d] += up[d] * filling_mass(c, k, m + stride)
        if down[d] > 0.0:
            slope[d] += -down[d] * filling_mass(c, k, m - stride)
    return slope


@ti.func
def mass_gradient_adjoint(c: ti.template(), k: ti.template(), node, up, down, adjoint):
    """Adjoint of `mass_gradient`: adds to those of the neighbours' mass, of nodes counted from the first."""
    for d in ti.static(range(3)):
        stride = (c.nodes.sx, c.nodes.sy, 1)[d]
        if up[d] > 0.0 and not is_overfull(c, k, c.start + node + stride):
            c.grid_adjoint[MOMENTUM, node + stride] += ti.Vector([0.0, 0.0, 0.0, up[d] * adjoint[d]])
        if down[d] > 0.0 and not is_overfull(c, k, c.start + node - stride):
            c.grid_adjoint[MOMENTUM, node - stride] += ti.Vector([0.0, 0.0, 0.0, -down[d] * adjoint[d]])


@ti.func
def is_overfull(c: ti.template(), k: ti.template(), m):
    """Whether a node of layer k has more mass than it can hold, as beside a base that is driven."""
    overfull = False
    if ti.static(c.variant.driven and k == 0):
        overfull = c.grid[MOMENTUM, m][3] > c.scene.robot_full
    return overfull


@ti.func
def filling_mass(c: ti.template(), k: ti.template(), m):
    """Mass at a node of layer k by which its matter fills it [kg]."""
    mass = c.grid[MOMENTUM, m][3]
    if is_overfull(c, k, m):
        mass = c.scene.robot_full
    return mass


@ti.func
def mass_of_full_node(c: ti.template(), k: ti.template()):
    """Mass of a node in the midst of the body of layer k [kg]."""
    full = c.scene.robot_full
    if ti.static(c.variant.is_medium(k)):
        full = c.scene.medium_full
    elif ti.static(k > 0):
        full = c.scene.object_full[k - 1]
    return full


@ti.func
def flatness(slope, share):
    """How much a body's surface at a node is like a plane [-]: high on faces, low along edges and at corners.

    Across the face of a body the gradient of its volume share s goes with the root of s (1 - s), along an edge it is
    less. Deep in the body and far from it, where neither is known well, it counts for a face.
    """
    s = ti.max(LEAST_SHARE, ti.min(1.0 - LEAST_SHARE, share))
    ratio = slope.norm_sqr() / (s * (1.0 - s))
    return ratio * ratio * (ratio * ratio)


@ti.func
def flatness_adjoint(slope, share, adjoint):
    """Adjoint of `flatness` by the gradient and the share."""
    s = ti.max(LEAST_SHARE, ti.min(1.0 - LEAST_SHARE, share))
    square = slope.norm_sqr()
    ratio = square / (s * (1.0 - s))
    by_ratio, by_share = 4.0 * ratio * ratio * ratio * adjoint, 0.0 * share
    if s == share:
        by_share = by_ratio * (2.0 * s - 1.0) * ratio / (s * (1.0 - s))
    return (2.0 * by_ratio / (s * (1.0 - s))) * slope, by_share


@ti.func
def shape_at(c: ti.template(), k: ti.template(), m, found: ti.template()):
    """Gradient [1/cell] and value of the volume share of the body in layer k at a node, whose mass is at m."""
    full = mass_of_full_node(c, k)
    return ti.Struct(
        slope=mass_gradient(c, k, m, found.up, found.down) / full, share=filling_mass(c, k, m) / (full * found.room)
    )


@ti.func
def contact_slope(c: ti.template(), pair: ti.template(), m, around: ti.template()):
    """Gradient of the second body of a pair [1/cell], to which the contact's normal is opposite."""
    a, b = ti.static(c.variant.pairs[pair])
    second = shape_at(c, b, m + b * c.nodes.size, around)
    slope = second.slope
    if ti.static(not c.variant.is_medium(b)):
        first = shape_at(c, a, m + a * c.nodes.size, around)
        of_first, of_second = flatness(first.slope, first.share), flatness(second.slope, second.share)
        slope = (of_second * second.slope - of_first * first.slope) / (of_first + of_second + FLAT**4)
    return slope


@ti.func
def contact_slope_adjoint(c: ti.template(), pair: ti.template(), m, node, found: ti.template(), by_slope):
    """Adjoint of `contact_slope` by the masses of both at the node; adds to those of the neighbours' mass."""
    a, b = ti.static(c.variant.pairs[pair])
    full, of_first, of_second = mass_of_full_node(c, b), 0.0 * c.dt, 0.0 * c.dt
    by_second = by_slope
    if ti.static(not c.variant.is_medium(b)):
        other = mass_of_full_node(c, a)
        first, second = shape_at(c, a, m + a * c.nodes.size, found), shape_at(c, b, m + b * c.nodes.size, found)
        weight, other_weight = flatness(second.slope, second.share), flatness(first.slope, first.share)
        r = 1.0 / (weight + other_weight + FLAT**4)
        # found = (w s - v o) r with r = 1 / (w + v): by w it is (s - found) r, by v minus (o + found) r
        by_weight = r * by_slope.dot(second.slope - found.slope)
        by_other_weight = 0.0 - r * by_slope.dot(first.slope + found.slope)
        by_second, by_share = flatness_adjoint(second.slope, second.share, by_weight)
        by_first, by_other_share = flatness_adjoint(first.slope, first.share, by_other_weight)
        by_second += (r * weight) * by_slope
        by_first += (0.0 - r * other_weight) * by_slope
        of_second = by_share / (full * found.room)
        if not is_overfull(c, a, m + a * c.nodes.size):
            of_first = by_other_share / (other * found.room)
        mass_gradient_adjoint(c, a, node + a * c.nodes.size, found.up, found.down, by_first / other)
    mass_gradient_adjoint(c, b, node + b * c.nodes.size, found.up, found.down, by_second / full)
    return of_first, of_second
