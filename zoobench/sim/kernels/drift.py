"""Relaxation of water's volume ratio J to its local mean, against drift in the null space of the transfer.

Pressure acts through sums over particles on nodes. Differences that sum to zero on every node cause no force and so
persist (the null space of the transfer: Gritton and Berzins 2017): in a lasting flow one particle of a cell is
compressed further and further while its neighbour expands. So J decays towards its local mean of the water, weighted
with mass by the weights of the transfer: sum_i w_i sum_p w_ip m_p J_p / sum_i w_i sum_p w_ip m_p; and only the part of
the difference beyond `TOLERATED_DRIFT` does. At rest J differs by at most the weight of half a cell of water,
which is less: then the step is bit for bit that without relaxation. The nodes hold (mass times J, mass) of water in a
field of their own, RATIO: `f` in what follows, and `into` that of its adjoint.
"""

import taichi as ti

from zoobench.sim.kernels.transfer import by_offset, gather_slopes, gather_value, scatter_value

TOLERATED_DRIFT = 0.02
"""Difference of J from its local mean that is not relaxed [-]; a still shallow tank has a third of it at 1/32 m."""

RETURN_RATE = 6.0
"""Decay of the difference beyond, relative to the fall of J that an equal surplus of density causes [-].

It takes ten times as long as sound takes through a cell: faster than particles of a stirred tank drift apart, and slow
enough that no pressure waves are excited.
"""


@ti.func
def scatter_ratio(f: ti.template(), at: ti.template(), J, mass):
    """Add w m J and w m of a particle of water to its stencil."""
    scatter_value(f, at, ti.Vector([mass * J, mass, 0.0, 0.0]))


@ti.func
def scatter_ratio_adjoint(f: ti.template(), at: ti.template(), J, mass):
    """Adjoint of `scatter_ratio` by the offset, J and the mass."""
    found = gather_slopes(f, at)
    offset_adjoint = by_offset(found, ti.Vector([mass * J, mass, 0.0, 0.0]))
    return offset_adjoint, mass * found.total[0], J * found.total[0] + found.total[1]


@ti.func
def mean_ratio(f: ti.template(), at: ti.template(), J):
    """Local mean J of the water at a particle's place; its own `J` where no water has any mass."""
    sums = gather_value(f, at)
    mean = J
    if sums[1] > 0.0:
        mean = sums[0] / sums[1]
    return mean


@ti.func
def mean_ratio_adjoint(f: ti.template(), into: ti.template(), at: ti.template(), mean, mean_adjoint):
    """Adjoint of `mean_ratio`, which gave `mean`: adds to that of the nodes, returns that of the offset."""
    # mean = a / m with a = sum w m J and m = sum w m: d mean = (da - mean dm) / m
    found = gather_slopes(f, at)
    scaled = mean_adjoint / found.total[1]
    factors = ti.Vector([scaled, -scaled * mean, 0.0, 0.0])
    scatter_value(into, at, factors)
    return by_offset(found, factors)


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
