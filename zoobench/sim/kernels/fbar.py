"""F-bar for solid media whose flow keeps the volume: a particle's volume changes as that of the matter around it.

Eight particles in a cell, each with a volume to keep, are more constraints than a cell's nodes have freedoms: the
medium locks, and carries more than its law says. So a particle deforms with the mean rate of volume change theta around
it in place of its own, and with its own change of shape: C + (theta - tr C) I / 3 (de Souza Neto et al. 1996; in a
material point method Coombs et al. 2018). theta is the mean by mass over trilinear weights, of C at the beginning of
the substep: the corrections of a particle telescope from substep to substep, so that none drifts, and no second pass
over the particles is needed.

The nodes hold (mass times tr C, mass) of the medium in the field RATIO.
"""

import taichi as ti

from zoobench.sim.kernels.columns import diagonal, trace
from zoobench.sim.kernels.context import Around, Context, Field
from zoobench.sim.kernels.drift import mean_ratio, mean_ratio_adjoint, scatter_ratio, scatter_ratio_adjoint
from zoobench.sim.kernels.layout import MASS, RATIO, C, X, add_columns, columns, layer, put_columns, while_compiling
from zoobench.sim.kernels.splines import LINEAR, stencil, weight_derivatives, weights


@while_compiling
def rates(c: Context) -> Field:
    """The field of the rates at the nodes that the linear weights of a substep reach."""
    return Field(c.grid, RATIO, c.nodes, c.start, LINEAR)


@while_compiling
def rates_adjoint(c: Context) -> Field:
    """That of their adjoints."""
    return Field(c.grid_adjoint, RATIO, c.nodes, 0, LINEAR)


@ti.func
def scatter_rate(c: ti.template(), p):
    """Add a particle's rate of volume change to its nodes."""
    at = stencil(c.state[c.s, c.w, p, X], c.scene, layer(c, p), LINEAR)
    share = weights(at.offset, LINEAR)
    own, mass = trace(columns(c.state, c.s, c.w, p, C)), c.body[c.w, p, 0][MASS]
    scatter_ratio(rates(c), Around(at, share), own, mass)


@ti.func
def mean_rate(c: ti.template(), p):
    """The mean rate of volume change around a particle, and its own [1/s]."""
    at = stencil(c.state[c.s, c.w, p, X], c.scene, layer(c, p), LINEAR)
    share = weights(at.offset, LINEAR)
    own = trace(columns(c.state, c.s, c.w, p, C))
    return mean_ratio(rates(c), Around(at, share), own), own


@ti.func
def mean_rate_adjoint(c: ti.template(), p, mean, mean_adjoint):
    """Adjoint of `mean` less the particle's own rate: adds to that of the nodes, returns that of the offset.

    That of C by the particle's own rate is left in the place of that of C, to which `scatter_rate_adjoint` adds.
    """
    at = stencil(c.state[c.s, c.w, p, X], c.scene, layer(c, p), LINEAR)
    share, slopes = weights(at.offset, LINEAR), weight_derivatives(at.offset, LINEAR)
    put_columns(c.adjoint, 0, c.w, p, C, diagonal(0.0 - mean_adjoint))
    return mean_ratio_adjoint(rates(c), rates_adjoint(c), Around(at, share, slopes), mean, mean_adjoint)


@ti.func
def scatter_rate_adjoint(c: ti.template(), p, mass):
    """Adjoint of `scatter_rate`: adds to that of C, returns those of the offset and the mass."""
    at = stencil(c.state[c.s, c.w, p, X], c.scene, layer(c, p), LINEAR)
    share, slopes = weights(at.offset, LINEAR), weight_derivatives(at.offset, LINEAR)
    own = trace(columns(c.state, c.s, c.w, p, C))
    by_offset, by_own, by_mass = scatter_ratio_adjoint(rates_adjoint(c), Around(at, share, slopes), own, mass)
    add_columns(c.adjoint, 0, c.w, p, C, diagonal(by_own))
    return by_offset, by_mass
