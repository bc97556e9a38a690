"""Water's J is kept from drifting where the grid does not see it: it returns to the mean of the water around.

Pressure acts through sums over particles on nodes. Differences that sum to nothing on every node are not felt and so
not undone (the null space of the transfer: Gritton and Berzins 2017): in a flow that lasts, one particle of a cell is
compressed on and on while its neighbour expands. So J decays towards its mean, weighted with mass and taken with the
weights of the transfer, sum_i w_i sum_p w_ip m_p J_p / sum_i w_i sum_p w_ip m_p, over the water alone; and only the
part of the difference beyond `DRIFTED` does. At rest J differs by what half a cell of water weighs at most, which is
less, and the step is what it would be, to the last bit. The loops unroll the nodes of one plane of a stencil at a time,
as all 27 would take a minute to compile.
"""

import taichi as ti

from zoobench.sim.kernels.splines import base_node, pick, weight_slopes, weights

DRIFTED = 0.02
"""Difference of J from the mean around that is let be [-]; a still shallow tank has a third of it at 1/32 m."""

RETURN = 6.0
"""Decay of the difference beyond, by the fall of J that the same surplus of density would cause [-].

It takes ten times as long as sound takes through a cell: sooner than particles of a stirred tank drift apart, and slow
enough that nothing rings.
"""


@ti.func
def scatter_ratio(ratios: ti.template(), g, position, J, mass, inverse_spacing, width: ti.template()):
    """Add w m J and w m of a particle of water to the stencil of slab g."""
    base = base_node(position, inverse_spacing, ratios, width)
    w = weights(position * inverse_spacing - base, width)
    for i in range(width):
        w_i = pick(w, i, 0, width)
        for j in ti.static(range(width)):
            for k in ti.static(range(width)):
                share = w_i * w[j, 1] * w[k, 2] * mass
                ratios[g, base[0] + i, base[1] + j, base[2] + k] += ti.Vector([share * J, share])


@ti.func
def scatter_ratio_adjoint(
    ratios_adjoint: ti.template(), g, position, J, mass, inverse_spacing, width: ti.template()
):  # fmt: skip
    """Adjoint of `scatter_ratio`: pulls on the position, J and the mass."""
    pull, slope = gather_ratio(ratios_adjoint, g, position, inverse_spacing, ti.Vector([J, 1.0]), width)
    return mass * slope, mass * pull[0], J * pull[0] + pull[1]


@ti.func
def gather_ratio(ratios: ti.template(), g, position, inverse_spacing, factors, width: ti.template()):
    """sum w q of the pairs q at the nodes, and the derivative of its product with `factors` by the position."""
    base = base_node(position, inverse_spacing, ratios, width)
    offset = position * inverse_spacing - base
    w, slopes = weights(offset, width), weight_slopes(offset, width)
    sums, slope = 0.0 * factors, 0.0 * offset
    for i in range(width):
        w_i, slope_i = pick(w, i, 0, width), pick(slopes, i, 0, width)
        for j in ti.static(range(width)):
            for k in ti.static(range(width)):
                held = ratios[g, base[0] + i, base[1] + j, base[2] + k]
                sums += w_i * w[j, 1] * w[k, 2] * held
                value = held.dot(factors)
                slope[0] += slope_i * w[j, 1] * w[k, 2] * value
                slope[1] += w_i * slopes[j, 1] * w[k, 2] * value
                slope[2] += w_i * w[j, 1] * slopes[k, 2] * value
    return sums, inverse_spacing * slope


@ti.func
def mean_ratio(ratios: ti.template(), g, position, J, inverse_spacing, width: ti.template()):
    """Mean J of the water around a particle's place; its own `J` where no water has any mass."""
    base = base_node(position, inverse_spacing, ratios, width)
    w = weights(position * inverse_spacing - base, width)
    product, mass = 0.0 * inverse_spacing, 0.0 * inverse_spacing
    for i in range(width):
        w_i = pick(w, i, 0, width)
        for j in ti.static(range(width)):
            for k in ti.static(range(width)):
                held = ratios[g, base[0] + i, base[1] + j, base[2] + k]
                product += w_i * w[j, 1] * w[k, 2] * held[0]
                mass += w_i * w[j, 1] * w[k, 2] * held[1]
    mean = J
    if mass > 0.0:
        mean = product / mass
    return mean


@ti.func
def mean_ratio_adjoint(
    ratios: ti.template(), ratios_adjoint: ti.template(), g, position, mean, pull, inverse_spacing, width: ti.template()
):  # fmt: skip
    """Adjoint of `mean_ratio`, which was `mean`: adds to that of the nodes, returns the pull on the position."""
    sums, slope = gather_ratio(ratios, g, position, inverse_spacing, ti.Vector([1.0, -mean]), width)
    scaled = pull / sums[1]
    base = base_node(position, inverse_spacing, ratios, width)
    w = weights(position * inverse_spacing - base, width)
    for i in range(width):
        w_i = pick(w, i, 0, width)
        for j in ti.static(range(width)):
            for k in ti.static(range(width)):
                share = w_i * w[j, 1] * w[k, 2] * scaled
                ratios_adjoint[g, base[0] + i, base[1] + j, base[2] + k] += ti.Vector([share, -share * mean])
    return scaled * slope


@ti.func
def returned_ratio(J, mean, share):
    """J after a step in which its difference from the mean around decays; `share` is that of `correction_share`."""
    gap = mean - J
    return J + RETURN * share * (ti.max(gap - DRIFTED, 0.0) + ti.min(gap + DRIFTED, 0.0))


@ti.func
def returned_ratio_adjoint(J, mean, share, pull):
    """Adjoint of `returned_ratio`: pulls on J and the mean."""
    moved = 0.0 * pull
    if ti.abs(mean - J) > DRIFTED:
        moved = RETURN * share * pull
    return pull - moved, moved
