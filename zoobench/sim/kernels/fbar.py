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
from zoobench.sim.kernels.drift import mean_ratio, mean_ratio_adjoint, scatter_ratio, scatter_ratio_adjoint
from zoobench.sim.kernels.layout import MASS, C, X, add_columns, columns, put_columns
from zoobench.sim.kernels.splines import LINEAR, stencil, weight_derivatives, weights


@ti.func
def scatter_rate(
    state: ti.template(), body: ti.template(), grid: ti.template(), start, nodes: ti.template(), scene: ti.template(),
    s, w, p,
):  # fmt: skip
    """Add a particle's rate of volume change to its nodes, those of the medium in a box of `nodes`."""
    at = stencil(state[s, w, p, X], scene, nodes, LINEAR)
    own, mass = trace(columns(state, s, w, p, C)), body[w, p, 0][MASS]
    scatter_ratio(grid, nodes, start + at.node, weights(at.offset, LINEAR), own, mass, LINEAR)


@ti.func
def mean_rate(state: ti.template(), grid: ti.template(), start, nodes: ti.template(), scene: ti.template(), s, w, p):
    """The mean rate of volume change around a particle, and its own [1/s]."""
    at = stencil(state[s, w, p, X], scene, nodes, LINEAR)
    own = trace(columns(state, s, w, p, C))
    return mean_ratio(grid, nodes, start + at.node, weights(at.offset, LINEAR), own, LINEAR), own


@ti.func
def mean_rate_adjoint(
    state: ti.template(), adjoint: ti.template(), grid: ti.template(), grid_adjoint: ti.template(), start,
    nodes: ti.template(), scene: ti.template(), s, w, p, mean, mean_adjoint,
):  # fmt: skip
    """Adjoint of `mean` less the particle's own rate: adds to that of the nodes, returns that of the offset.

    That of C by the particle's own rate is left in the place of that of C, to which `scatter_rate_adjoint` adds.
    """
    at = stencil(state[s, w, p, X], scene, nodes, LINEAR)
    share, slopes = weights(at.offset, LINEAR), weight_derivatives(at.offset, LINEAR)
    put_columns(adjoint, 0, w, p, C, diagonal(0.0 - mean_adjoint))
    return mean_ratio_adjoint(
        grid, start + at.node, grid_adjoint, at.node, nodes, share, slopes, mean, mean_adjoint, LINEAR
    )


@ti.func
def scatter_rate_adjoint(
    state: ti.template(), adjoint: ti.template(), grid_adjoint: ti.template(), nodes: ti.template(),
    scene: ti.template(), s, w, p, mass,
):  # fmt: skip
    """Adjoint of `scatter_rate`: adds to that of C, returns those of the offset and the mass."""
    at = stencil(state[s, w, p, X], scene, nodes, LINEAR)
    share, slopes = weights(at.offset, LINEAR), weight_derivatives(at.offset, LINEAR)
    own = trace(columns(state, s, w, p, C))
    by_offset, by_own, by_mass = scatter_ratio_adjoint(grid_adjoint, nodes, at.node, share, slopes, own, mass, LINEAR)
    add_columns(adjoint, 0, w, p, C, diagonal(by_own))
    return by_offset, by_mass
