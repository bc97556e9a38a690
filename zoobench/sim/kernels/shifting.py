"""Particle shifting of water (Lind et al. 2012): positions move down the gradient of the density, with its adjoint.

Where a flow stretches matter in one direction for long, as towards a stagnation point, the lattice of particles becomes
a stack of sheets a cell or more apart. A sheet lies inside one cell, where the flow has one value of each velocity and
gradient: its pressure changes J, but cannot separate its particles. So these are shifted, as in smoothed particle
hydrodynamics: down the gradient of the density on the grid, and only where that exceeds 1/J by more than
`SHIFTED_SURPLUS`; elsewhere the step is bit for bit that without shifting. Velocities are not changed.
"""

import taichi as ti

from zoobench.sim.kernels.columns import dot
from zoobench.sim.kernels.laws.water import (
    LEAST_FREE_FRACTION,
    is_near_wall,
    node_free_fractions,
    surplus_density,
    weighted_sum,
)
from zoobench.sim.kernels.layout import MOMENTUM, VELOCITY
from zoobench.sim.kernels.splines import pick, weight_derivatives, weight_second_derivatives, weights

SHIFTED_SURPLUS = 0.1
"""Surplus of density up to which particles are not shifted [-]; in nine tenths of a stirred tank it is below half."""

SHIFT_RATE = 24.0
"""Shift [cells] at a gradient of log density of 1 per cell, relative to the fall of J that the surplus causes [-]."""


@ti.func
def at_node(w: ti.template(), i, j, k, width: ti.template()):
    """Factors of a node's weight, or of its derivatives; the loops are not unrolled, as few particles are shifted."""
    return pick(w, i, 0, width), pick(w, j, 1, width), pick(w, k, 2, width)


@ti.func
def log_room_derivatives(at: ti.template(), scene: ti.template(), width: ti.template()):
    """First and second derivatives of log(share of a particle's spline between the walls) by its place [cells]."""
    first, second = 0.0 * at.offset, 0.0 * at.offset
    if is_near_wall(at, scene, width):
        rooms = node_free_fractions(at, scene, width)
        share = weighted_sum(weights(at.offset, width), rooms, width)
        if share[0] * share[1] * share[2] > LEAST_FREE_FRACTION:
            slope = weighted_sum(weight_derivatives(at.offset, width), rooms, width)
            bend = weighted_sum(weight_second_derivatives(at.offset, width), rooms, width)
            for d in ti.static(range(3)):
                first[d] = slope[d] / share[d]
                second[d] = bend[d] / share[d] - first[d] * first[d]
    return first, second


@ti.func
def particle_shift(c: ti.template(), at: ti.template(), J, rho, share):
    """Shift of a particle [m], with its relative density `rho` and `share` of `correction_share`.

    -SHIFT_RATE h share surplus grad(log rho), the gradient by the place in cells: Fick's law as in Lind et al. 2012,
    with a diffusivity that follows the surplus.
    """
    surplus = surplus_density(J, rho, SHIFTED_SURPLUS)
    shift = 0.0 * at.offset
    if surplus > 0.0:
        width = ti.static(c.variant.width)
        w, dw = weights(at.offset, width), weight_derivatives(at.offset, width)
        total, gradient = 0.0 * J, 0.0 * at.offset
        for i in range(width):
            for j in range(width):
                for k in range(width):
                    mass = c.grid[VELOCITY, at.node + i * c.nodes.sx + j * c.nodes.sy + k][3]
                    a, b, e = at_node(w, i, j, k, width)
                    a1, b1, e1 = at_node(dw, i, j, k, width)
                    total += mass * a * b * e
                    gradient += mass * ti.Vector([a1 * b * e, a * b1 * e, a * b * e1, 0.0])
        room_first, _ = log_room_derivatives(at, c.scene, width)
        shift = (-SHIFT_RATE * share * surplus * c.scene.spacing) * (gradient * (1.0 / total) - room_first)
    return shift


@ti.func
def particle_shift_adjoint(c: ti.template(), at: ti.template(), J, rho, share, u):
    """Adjoint of `particle_shift` for the adjoint `u` of the shift: adds to the nodes' mass adjoint, returns those of
    the offset, J and rho."""
    surplus = surplus_density(J, rho, SHIFTED_SURPLUS)
    offset_adjoint, J_adjoint, rho_adjoint = 0.0 * at.offset, 0.0 * J, 0.0 * rho
    if surplus > 0.0:
        width = ti.static(c.variant.width)
        w, dw = weights(at.offset, width), weight_derivatives(at.offset, width)
        ddw = weight_second_derivatives(at.offset, width)
        total, gradient, along = 0.0 * J, 0.0 * at.offset, 0.0 * at.offset  # along: the Hessian times u
        for i in range(width):
            for j in range(width):
                for k in range(width):
                    mass = c.grid[VELOCITY, at.node + i * c.nodes.sx + j * c.nodes.sy + k][3]
                    a, b, e = at_node(w, i, j, k, width)
                    a1, b1, e1 = at_node(dw, i, j, k, width)
                    a2, b2, e2 = at_node(ddw, i, j, k, width)
                    total += mass * a * b * e
                    gradient += mass * ti.Vector([a1 * b * e, a * b1 * e, a * b * e1, 0.0])
                    x = a2 * b * e * u[0] + a1 * (b1 * e * u[1] + b * e1 * u[2])
                    y = a * b2 * e * u[1] + b1 * (a1 * e * u[0] + a * e1 * u[2])
                    z = a * b * e2 * u[2] + e1 * (a1 * b * u[0] + a * b1 * u[1])
                    along += mass * ti.Vector([x, y, z, 0.0])
        factor = -SHIFT_RATE * share * c.scene.spacing
        log_gradient = gradient * (1.0 / total)
        room_first, room_second = log_room_derivatives(at, c.scene, width)
        turned = dot(log_gradient, u)
        work = factor * dot(u, log_gradient - room_first)
        J_adjoint, rho_adjoint = work * rho, work * J  # surplus = rho J - 1 - SHIFTED_SURPLUS
        # the Hessian of log f is f'' / f - (f' / f)(f' / f)^T, applied to u
        offset_adjoint = (factor * surplus) * (along * (1.0 / total) - log_gradient * turned - room_second * u)
        for i in range(width):
            for j in range(width):
                for k in range(width):
                    a, b, e = at_node(w, i, j, k, width)
                    a1, b1, e1 = at_node(dw, i, j, k, width)
                    rise = a1 * b * e * u[0] + a * b1 * e * u[1] + a * b * e1 * u[2]
                    mass_adjoint = factor * surplus * (rise - a * b * e * turned) / total
                    at_ijk = at.node + i * c.nodes.sx + j * c.nodes.sy + k
                    c.grid_adjoint[MOMENTUM, at_ijk] += ti.Vector([0.0, 0.0, 0.0, mass_adjoint])
    return offset_adjoint, J_adjoint, rho_adjoint
