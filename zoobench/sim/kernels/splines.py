"""B-splines between particles and grid nodes, chosen at compile time by the `width` of their stencil.

The quadratic spline reaches over 3 nodes in each direction, the cubic one over 4 (Steffen, Kirby and Berzins 2008).
Their weights sum to one, have the first moment x_p, and the second moment h^2/4 or h^2/3 times the identity wherever
the particle is (Jiang et al. 2016, sec. 5.3): `INVERSE_MOMENT` holds 4 or 3 by width.
"""

import taichi as ti

from zoobench.sim.model.fidelity import SPLINES

QUADRATIC, CUBIC = SPLINES["quadratic"].width, SPLINES["cubic"].width

INVERSE_MOMENT = {spline.width: spline.inverse_moment for spline in SPLINES.values()}


@ti.func
def base_node(position, inverse_spacing, grid: ti.template(), width: ti.template()):
    """First node of the stencil, kept inside the grid: an escaped particle must not write out of bounds."""
    # the stencil is centred on the particle: floor(x/h - 1/2) for the quadratic spline, floor(x/h - 1) for the cubic
    base = ti.cast(position * inverse_spacing - ti.static(0.5 * width - 1.0), ti.i32)
    last = ti.Vector([grid.shape[1], grid.shape[2], grid.shape[3]]) - width
    return ti.max(0, ti.min(base, last))


@ti.func
def weights(offset, width: ti.template()):
    """w[i, d]: weight of stencil node i in direction d, at `offset` [cells] from the base node."""
    if ti.static(width == QUADRATIC):  # offset in [0.5, 1.5)
        return ti.Matrix.rows([0.5 * (1.5 - offset) ** 2, 0.75 - (offset - 1.0) ** 2, 0.5 * (offset - 0.5) ** 2])
    # offset in [1, 2): u and v are the distances to the two inner nodes
    u, v = offset - 1.0, 2.0 - offset
    near, far = 2.0 / 3.0 - u**2 + 0.5 * u**3, 2.0 / 3.0 - v**2 + 0.5 * v**3
    return ti.Matrix.rows([v**3 / 6.0, near, far, u**3 / 6.0])


@ti.func
def pick(w, i, d: ti.template(), width: ti.template()):
    """w[i, d] of a node i that is known at run time only; indexing would keep all of w out of the registers."""
    found = w[0, d]
    for n in ti.static(range(1, width)):
        if i == n:
            found = w[n, d]
    return found


@ti.func
def weight_derivatives(offset, width: ti.template()):
    """d w[i, d] / d offset_d."""
    if ti.static(width == QUADRATIC):
        return ti.Matrix.rows([offset - 1.5, -2.0 * (offset - 1.0), offset - 0.5])
    u, v = offset - 1.0, 2.0 - offset
    return ti.Matrix.rows([-0.5 * v**2, 1.5 * u**2 - 2.0 * u, 2.0 * v - 1.5 * v**2, 0.5 * u**2])


@ti.func
def weight_second_derivatives(offset, width: ti.template()):
    """d^2 w[i, d] / d offset_d^2."""
    one = 0.0 * offset + 1.0
    if ti.static(width == QUADRATIC):
        return ti.Matrix.rows([one, -2.0 * one, one])
    u, v = offset - 1.0, 2.0 - offset
    return ti.Matrix.rows([v, 3.0 * u - 2.0, 3.0 * v - 2.0, u])
