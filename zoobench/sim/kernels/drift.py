"""Relaxation of water's volume ratio J to its local mean, against drift in the null space of the transfer.

Pressure acts through sums over particles on nodes. Differences that sum to zero on every node cause no force and so
persist (the null space of the transfer: Gritton and Berzins 2017): in a lasting flow one particle of a cell is
compressed further and further while its neighbour expands. So J decays towards its local mean of the water, weighted
with mass by the weights of the transfer: sum_i w_i sum_p w_ip m_p J_p / sum_i w_i sum_p w_ip m_p; and only the part of
the difference beyond `TOLERATED_DRIFT` does. At rest J differs by at most the weight of half a cell of water,
which is less: then the step is bit for bit that without relaxation. The loops unroll one plane of a stencil's nodes at
a time, as all 27 nodes would take a minute to compile.
"""

import taichi as ti

from zoobench.sim.kernels.splines import base_node, pick, weight_derivatives, weights

TOLERATED_DRIFT = 0.02
"""Difference of J from its local mean that is not relaxed [-]; a still shallow tank has a third of it at 1/32 m."""

RETURN_RATE = 6.0
"""Decay of the difference beyond, relative to the fall of J that an equal surplus of density causes [-].

It takes ten times as long as sound takes through a cell: faster than particles of a stirred tank drift apart, and slow
enough that no pressure waves are excited.
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
    """Adjoint of `scatter_ratio` by the position, J and the mass."""
    sums, derivative = gather_ratio(ratios_adjoint, g, position, inverse_spacing, ti.Vector([J, 1.0]), width)
    return mass * derivative, mass * sums[0], J * sums[0] + sums[1]


@ti.func
def gather_ratio(ratios: ti.template(), g, position, inverse_spacing, factors, width: ti.template()):
    """sum w q of the pairs q at the nodes, and the derivative of its product with `factors` by the position."""
    base = base_node(position, inverse_spacing, ratios, width)
    offset = position * inverse_spacing - base
    w, dw = weights(offset, width), weight_derivatives(offset, width)
    sums, derivative = 0.0 * factors, 0.0 * offset
    for i in range(width):
        w_i, dw_i = pick(w, i, 0, width), pick(dw, i, 0, width)
        for j in ti.static(range(width)):
            for k in ti.static(range(width)):
                held = ratios[g, base[0] + i, base[1] + j, base[2] + k]
                sums += w_i * w[j, 1] * w[k, 2] * held
                value = held.dot(factors)
                # d(w_i w_j w_k)/dx by the product rule, as the weights are tensor products
                derivative[0] += dw_i * w[j, 1] * w[k, 2] * value
                derivative[1] += w_i * dw[j, 1] * w[k, 2] * value
                derivative[2] += w_i * w[j, 1] * dw[k, 2] * value
    return sums, inverse_spacing * derivative


@ti.func
def mean_ratio(ratios: ti.template(), g, position, J, inverse_spacing, width: ti.template()):
    """Local mean J of the water at a particle's place; its own `J` where no water has any mass."""
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
    ratios: ti.template(), ratios_adjoint: ti.template(), g, position, mean, mean_adjoint, inverse_spacing,
    width: ti.template(),
):  # fmt: skip
    """Adjoint of `mean_ratio`, which gave `mean`: adds to that of the nodes, returns that by the position."""
    # mean = a / m with a = sum w m J and m = sum w m: d mean = (da - mean dm) / m
    sums, derivative = gather_ratio(ratios, g, position, inverse_spacing, ti.Vector([1.0, -mean]), width)
    scaled = mean_adjoint / sums[1]
    base = base_node(position, inverse_spacing, ratios, width)
    w = weights(position * inverse_spacing - base, width)
    for i in range(width):
        w_i = pick(w, i, 0, width)
        for j in ti.static(range(width)):
            for k in ti.static(range(width)):
                share = w_i * w[j, 1] * w[k, 2] * scaled
                ratios_adjoint[g, base[0] + i, base[1] + j, base[2] + k] += ti.Vector([share, -share * mean])
    return scaled * derivative


@ti.func
def relaxed_ratio(J, mean, share):
    """J after the decay of its difference from the local mean in a step; `share` is that of `correction_share`."""
    gap = mean - J
    # soft threshold: zero within TOLERATED_DRIFT, continuous beyond
    return J + RETURN_RATE * share * (ti.max(gap - TOLERATED_DRIFT, 0.0) + ti.min(gap + TOLERATED_DRIFT, 0.0))


@ti.func
def relaxed_ratio_adjoint(J, mean, share, after_adjoint):
    """Adjoint of `relaxed_ratio` by J and the mean."""
    mean_adjoint = 0.0 * after_adjoint
    if ti.abs(mean - J) > TOLERATED_DRIFT:
        mean_adjoint = RETURN_RATE * share * after_adjoint
    return after_adjoint - mean_adjoint, mean_adjoint
