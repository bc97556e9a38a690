"""Particle shifting of water (Lind et al. 2012): positions move down the gradient of the density, with its adjoint.

Where a flow stretches matter in one direction for long, as towards a stagnation point, the lattice of particles becomes
a stack of sheets a cell or more apart. A sheet lies inside one cell, where the flow has one value of each velocity and
gradient: its pressure changes J, but cannot separate its particles. So these are shifted, as in smoothed particle
hydrodynamics: down the gradient of the density on the grid, and only where that exceeds 1/J by more than
`SHIFTED_SURPLUS`; elsewhere the step is bit for bit that without shifting. Velocities are not changed.
"""

import taichi as ti

from zoobench.sim.kernels.splines import base_node, pick, weight_derivatives, weight_second_derivatives, weights
from zoobench.sim.kernels.water import (
    LEAST_ROOM,
    column_sums,
    correction_share,
    node_room,
    relative_density_adjoint,
    surplus_density,
)

SHIFTED_SURPLUS = 0.1
"""Surplus of density up to which particles are not shifted [-]; in nine tenths of a stirred tank it is below half."""

SHIFT_RATE = 24.0
"""Shift [cells] at a gradient of log density of 1 per cell, relative to the fall of J that the surplus causes [-]."""


@ti.func
def at_node(w, i, j, k, width: ti.template()):
    """Factors of a node's weight, or of its derivatives; the loops are not unrolled, as few particles are shifted."""
    return pick(w, i, 0, width), pick(w, j, 1, width), pick(w, k, 2, width)


@ti.func
def log_room_derivatives(base, offset, grid: ti.template(), width: ti.template()):
    """First and second derivatives of log(share of a particle's spline between the walls) by its place [cells]."""
    rooms = node_room(base, grid, width)
    room = column_sums(weights(offset, width), rooms)
    first, second = 0.0 * offset, 0.0 * offset
    if room[0] * room[1] * room[2] > LEAST_ROOM:
        first = column_sums(weight_derivatives(offset, width), rooms) / room
        second = column_sums(weight_second_derivatives(offset, width), rooms) / room - first * first
    return first, second


@ti.func
def particle_shift(grid: ti.template(), g, position, J, rho, share, inverse_spacing, width: ti.template()):
    """Shift of a particle [m], with its relative density `rho` and `share` of `correction_share`.

    -SHIFT_RATE h share surplus grad(log rho), the gradient by the place in cells: Fick's law as in Lind et al. 2012,
    with a diffusivity that follows the surplus.
    """
    surplus = surplus_density(J, rho, SHIFTED_SURPLUS)
    shift = 0.0 * position
    if surplus > 0.0:
        base = base_node(position, inverse_spacing, grid, width)
        offset = position * inverse_spacing - base
        w, dw = weights(offset, width), weight_derivatives(offset, width)
        total, gradient = 0.0 * inverse_spacing, 0.0 * offset
        for i in range(width):
            for j in range(width):
                for k in range(width):
                    mass = grid[g, base[0] + i, base[1] + j, base[2] + k][3]
                    a, b, c = at_node(w, i, j, k, width)
                    a1, b1, c1 = at_node(dw, i, j, k, width)
                    total += mass * a * b * c
                    gradient += mass * ti.Vector([a1 * b * c, a * b1 * c, a * b * c1])
        room_first, _ = log_room_derivatives(base, offset, grid, width)
        shift = -SHIFT_RATE * share * surplus / inverse_spacing * (gradient / total - room_first)
    return shift


@ti.func
def particle_shift_adjoint(
    grid: ti.template(), grid_adjoint: ti.template(), g, position, J, rho, share, u, inverse_spacing,
    width: ti.template(),
):  # fmt: skip
    """Adjoint of `particle_shift` for the adjoint `u` of the shift: adds to the nodes' mass adjoint, returns those of
    the position, J and rho."""
    surplus = surplus_density(J, rho, SHIFTED_SURPLUS)
    place_adjoint, J_adjoint, rho_adjoint = 0.0 * position, 0.0 * J, 0.0 * rho
    if surplus > 0.0:
        base = base_node(position, inverse_spacing, grid, width)
        offset = position * inverse_spacing - base
        w, dw, ddw = weights(offset, width), weight_derivatives(offset, width), weight_second_derivatives(offset, width)
        total, gradient, along = 0.0 * inverse_spacing, 0.0 * offset, 0.0 * offset  # along: the Hessian times u
        for i in range(width):
            for j in range(width):
                for k in range(width):
                    mass = grid[g, base[0] + i, base[1] + j, base[2] + k][3]
                    a, b, c = at_node(w, i, j, k, width)
                    a1, b1, c1 = at_node(dw, i, j, k, width)
                    total += mass * a * b * c
                    gradient += mass * ti.Vector([a1 * b * c, a * b1 * c, a * b * c1])
                    a2, b2, c2 = at_node(ddw, i, j, k, width)
                    along[0] += mass * (a2 * b * c * u[0] + a1 * (b1 * c * u[1] + b * c1 * u[2]))
                    along[1] += mass * (a * b2 * c * u[1] + b1 * (a1 * c * u[0] + a * c1 * u[2]))
                    along[2] += mass * (a * b * c2 * u[2] + c1 * (a1 * b * u[0] + a * b1 * u[1]))
        factor = -SHIFT_RATE * share / inverse_spacing
        log_gradient = gradient / total
        room_first, room_second = log_room_derivatives(base, offset, grid, width)
        work = factor * u.dot(log_gradient - room_first)
        J_adjoint, rho_adjoint = work * rho, work * J  # surplus = rho J - 1 - SHIFTED_SURPLUS
        # the Hessian of log f is f'' / f - (f' / f)(f' / f)^T, applied to u
        hessian_adjoint = along / total - log_gradient * log_gradient.dot(u) - room_second * u
        place_adjoint = factor * surplus * inverse_spacing * hessian_adjoint
        for i in range(width):
            for j in range(width):
                for k in range(width):
                    a, b, c = at_node(w, i, j, k, width)
                    a1, b1, c1 = at_node(dw, i, j, k, width)
                    rise = a1 * b * c * u[0] + a * b1 * c * u[1] + a * b * c1 * u[2]
                    mass_adjoint = factor * surplus * (rise - a * b * c * log_gradient.dot(u)) / total
                    grid_adjoint[g, base[0] + i, base[1] + j, base[2] + k] += ti.Vector([0.0, 0.0, 0.0, mass_adjoint])
    return place_adjoint, J_adjoint, rho_adjoint


@ti.func
def density_and_shift_adjoint(
    grid: ti.template(), grid_adjoint: ti.template(), g, position, J, rho, rho_adjoint, shift_adjoint, inverse_spacing,
    dt, constants, width: ti.template(),
):  # fmt: skip
    """Adjoint of `relative_density`, which gave `rho`, and of the `particle_shift` that depends on it, by x and J."""
    share = correction_share(inverse_spacing, dt, constants)
    place_adjoint, J_adjoint, more = particle_shift_adjoint(
        grid, grid_adjoint, g, position, J, rho, share, shift_adjoint, inverse_spacing, width
    )
    total_adjoint = rho_adjoint + more
    if total_adjoint != 0.0:
        place_adjoint += relative_density_adjoint(
            grid, grid_adjoint, g, position, rho, total_adjoint, inverse_spacing, constants[3], width
        )
    return place_adjoint, J_adjoint
