"""Water's particles leave a crowd: a shift of their places down the density's gradient, and its adjoint.

Where a flow stretches matter in one direction for long, as towards a stagnation point, the lattice of particles becomes
a stack of sheets a cell or more apart. A sheet lies inside one cell, where the flow has one value of each velocity and
gradient: its pressure changes J, but cannot part its particles. So these are moved themselves, as in smoothed particle
hydrodynamics (Lind et al. 2012): down the gradient of the density that the grid has, and only where that exceeds what J
says by more than water lets be; elsewhere the step is what it would be, to the last bit. Velocities are not touched.
"""

import taichi as ti

from zoobench.sim.kernels.splines import base_node, pick, weight_curves, weight_slopes, weights
from zoobench.sim.kernels.water import (
    LEAST_ROOM,
    column_sums,
    correction_share,
    crowding_adjoint,
    node_room,
    surplus_density,
)

STIRRED = 0.1
"""Surplus of density at which particles stay where they are [-]; nine tenths of a stirred tank see less than half."""

PACE = 24.0
"""Shift [cells] for a gradient of log density of 1 per cell, by the fall of J that the same surplus would cause [-]."""


@ti.func
def at_node(w, i, j, k, width: ti.template()):
    """The factors of a stencil node's weight, or of its derivatives; the loops are not unrolled, as few get there."""
    return pick(w, i, 0, width), pick(w, j, 1, width), pick(w, k, 2, width)


@ti.func
def room_slopes(base, offset, grid: ti.template(), width: ti.template()):
    """Log slope and log curvature of the share of a particle's spline between the walls, by its place [cells]."""
    rooms = node_room(base, grid, width)
    room = column_sums(weights(offset, width), rooms)
    slope, curve = 0.0 * offset, 0.0 * offset
    if room[0] * room[1] * room[2] > LEAST_ROOM:
        slope = column_sums(weight_slopes(offset, width), rooms) / room
        curve = column_sums(weight_curves(offset, width), rooms) / room - slope * slope
    return slope, curve


@ti.func
def dispersal(grid: ti.template(), g, position, J, crowd, share, inverse_spacing, width: ti.template()):
    """Shift of a particle [m], where `crowd` is the density around it and `share` that of `correction_share`.

    -PACE h share surplus grad(log crowd), the gradient by the place in cells.
    """
    surplus = surplus_density(J, crowd, STIRRED)
    shift = 0.0 * position
    if surplus > 0.0:
        base = base_node(position, inverse_spacing, grid, width)
        offset = position * inverse_spacing - base
        w, slopes = weights(offset, width), weight_slopes(offset, width)
        total, gradient = 0.0 * inverse_spacing, 0.0 * offset
        for i in range(width):
            for j in range(width):
                for k in range(width):
                    mass = grid[g, base[0] + i, base[1] + j, base[2] + k][3]
                    a, b, c = at_node(w, i, j, k, width)
                    a1, b1, c1 = at_node(slopes, i, j, k, width)
                    total += mass * a * b * c
                    gradient += mass * ti.Vector([a1 * b * c, a * b1 * c, a * b * c1])
        room_slope, _ = room_slopes(base, offset, grid, width)
        shift = -PACE * share * surplus / inverse_spacing * (gradient / total - room_slope)
    return shift


@ti.func
def dispersal_adjoint(
    grid: ti.template(), grid_adjoint: ti.template(), g, position, J, crowd, share, pull, inverse_spacing,
    width: ti.template(),
):  # fmt: skip
    """Adjoint of `dispersal`: adds to the nodes' mass adjoint, returns pulls on the position, J and `crowd`."""
    surplus = surplus_density(J, crowd, STIRRED)
    place_pull, J_pull, crowd_pull = 0.0 * position, 0.0 * J, 0.0 * crowd
    if surplus > 0.0:
        base = base_node(position, inverse_spacing, grid, width)
        offset = position * inverse_spacing - base
        w, slopes, curves = weights(offset, width), weight_slopes(offset, width), weight_curves(offset, width)
        total, gradient, along = 0.0 * inverse_spacing, 0.0 * offset, 0.0 * offset  # along: the Hessian times the pull
        for i in range(width):
            for j in range(width):
                for k in range(width):
                    mass = grid[g, base[0] + i, base[1] + j, base[2] + k][3]
                    a, b, c = at_node(w, i, j, k, width)
                    a1, b1, c1 = at_node(slopes, i, j, k, width)
                    total += mass * a * b * c
                    gradient += mass * ti.Vector([a1 * b * c, a * b1 * c, a * b * c1])
                    a2, b2, c2 = at_node(curves, i, j, k, width)
                    along[0] += mass * (a2 * b * c * pull[0] + a1 * (b1 * c * pull[1] + b * c1 * pull[2]))
                    along[1] += mass * (a * b2 * c * pull[1] + b1 * (a1 * c * pull[0] + a * c1 * pull[2]))
                    along[2] += mass * (a * b * c2 * pull[2] + c1 * (a1 * b * pull[0] + a * b1 * pull[1]))
        factor = -PACE * share / inverse_spacing
        slope = gradient / total
        room_slope, room_curve = room_slopes(base, offset, grid, width)
        work = factor * pull.dot(slope - room_slope)
        J_pull, crowd_pull = work * crowd, work * J
        hessian_pull = along / total - slope * slope.dot(pull) - room_curve * pull
        place_pull = factor * surplus * inverse_spacing * hessian_pull
        for i in range(width):
            for j in range(width):
                for k in range(width):
                    a, b, c = at_node(w, i, j, k, width)
                    a1, b1, c1 = at_node(slopes, i, j, k, width)
                    rise = a1 * b * c * pull[0] + a * b1 * c * pull[1] + a * b * c1 * pull[2]
                    back = factor * surplus * (rise - a * b * c * slope.dot(pull)) / total
                    grid_adjoint[g, base[0] + i, base[1] + j, base[2] + k] += ti.Vector([0.0, 0.0, 0.0, back])
    return place_pull, J_pull, crowd_pull


@ti.func
def crowd_adjoint(
    grid: ti.template(), grid_adjoint: ti.template(), g, position, J, crowd, crowd_pull, shift_pull, inverse_spacing,
    dt, constants, width: ti.template(),
):  # fmt: skip
    """Adjoint of `crowding` and `dispersal`, which gave `crowd` and a shift: as that of both, returns pulls on x, J."""
    share = correction_share(inverse_spacing, dt, constants)
    place_pull, J_pull, more = dispersal_adjoint(
        grid, grid_adjoint, g, position, J, crowd, share, shift_pull, inverse_spacing, width
    )
    pull = crowd_pull + more
    if pull != 0.0:
        place_pull += crowding_adjoint(
            grid, grid_adjoint, g, position, crowd, pull, inverse_spacing, constants[3], width
        )
    return place_pull, J_pull
