"""B-splines between particles and grid nodes, chosen at compile time by the `width` of their stencil.

The quadratic spline reaches over 3 nodes in each direction, the cubic one over 4 (Steffen, Kirby and Berzins 2008).
Their weights sum to one, have the first moment x_p, and the second moment h^2/4 or h^2/3 times the identity wherever
the particle is (Jiang et al. 2016, sec. 5.3): `INVERSE_MOMENT` holds 4 or 3 by width.

The weights `w` of a stencil are one vector for each of its nodes in a direction, its lanes the directions: node
(i, j, k) has the weight w[i][0] w[j][1] w[k][2].
"""

import taichi as ti

from zoobench.sim.model.fidelity import SPLINES

LINEAR = 2
"""Width of the trilinear weights of `fbar`."""

QUADRATIC, CUBIC = SPLINES["quadratic"].width, SPLINES["cubic"].width

INVERSE_MOMENT = {spline.width: spline.inverse_moment for spline in SPLINES.values()}


@ti.func
def first_node(cells, count, width: ti.template()):
    """First node of a stencil in one direction, of a place in cells.

    It is kept inside the grid: an escaped particle must not write out of bounds.
    """
    # the stencil is centred on the particle: floor(x/h - 1/2) for the quadratic spline, floor(x/h - 1) for the cubic
    return ti.max(0, ti.min(ti.cast(cells - ti.static(0.5 * width - 1.0), ti.i32), count - width))


@ti.func
def stencil(place, scene: ti.template(), nodes: ti.template(), width: ti.template()):
    """The stencil of a place [m] in a box of nodes: first node (x, y, z), its flat index, and the offset from it."""
    q = place * scene.inverse
    x = first_node(q[0], scene.nodes_x, width)
    y = first_node(q[1], scene.nodes_y, width)
    z = first_node(q[2], scene.nodes_z, width)
    return ti.Struct(
        x=x, y=y, z=z,
        node=x * nodes.sx + y * nodes.sy + z + nodes.origin,
        offset=ti.Vector([q[0] - x, q[1] - y, q[2] - z, 0.0]),
    )  # fmt: skip


@ti.func
def weights(offset, width: ti.template()):
    """Weights at an `offset` [cells] from the first node."""
    if ti.static(width == LINEAR):
        return 1.0 - offset, offset
    if ti.static(width == QUADRATIC):  # offset in [0.5, 1.5)
        a, b, c = 1.5 - offset, offset - 1.0, offset - 0.5
        return 0.5 * a * a, 0.75 - b * b, 0.5 * c * c
    # offset in [1, 2): u and v are the distances to the two inner nodes
    u, v = offset - 1.0, 2.0 - offset
    u2, v2 = u * u, v * v
    return v2 * v * (1.0 / 6.0), 2.0 / 3.0 - u2 + 0.5 * u2 * u, 2.0 / 3.0 - v2 + 0.5 * v2 * v, u2 * u * (1.0 / 6.0)


@ti.func
def weight_derivatives(offset, width: ti.template()):
    """Derivatives of the weights by the offset."""
    if ti.static(width == LINEAR):
        return 0.0 * offset - 1.0, 0.0 * offset + 1.0
    if ti.static(width == QUADRATIC):
        return offset - 1.5, 2.0 - 2.0 * offset, offset - 0.5
    u, v = offset - 1.0, 2.0 - offset
    u2, v2 = u * u, v * v
    return -0.5 * v2, 1.5 * u2 - 2.0 * u, 2.0 * v - 1.5 * v2, 0.5 * u2


@ti.func
def weight_second_derivatives(offset, width: ti.template()):
    """Second derivatives of the weights by the offset."""
    one = 0.0 * offset + 1.0
    if ti.static(width == QUADRATIC):
        return one, -2.0 * one, one
    u, v = offset - 1.0, 2.0 - offset
    return v, 3.0 * u - 2.0, 3.0 * v - 2.0, u


@ti.func
def pick(w: ti.template(), i, d: ti.template(), width: ti.template()):
    """w[i][d] of a node i that is known at run time only."""
    found = w[0][d]
    for n in ti.static(range(1, width)):
        if i == n:
            found = w[n][d]
    return found
