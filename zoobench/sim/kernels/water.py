"""Weakly compressible water: its pressure, how its volume ratio J is carried along, and the adjoints.

J follows the flow, J <- J det(I + dt C), and so departs from the density of the particles: it grows where spray
disperses without resistance, and it does not change where particles accumulate in a flow whose resolved part is free of
divergence. Two one-sided rules tie it to the density on the grid. J above 1 is kept only as far as the matter around is
as thin, and never beyond `LARGEST_RATIO`: spray that meets again regains its own volume. And where the density exceeds
1/J by more than `TOLERATED_SURPLUS`, J falls at a steady rate, so that pressure rises and drives the particles apart;
the rate is slow compared with sound, so that no pressure waves are excited. Particles within one cell, which pressure
cannot separate, are moved by `shifting`, and differences of J between neighbours are relaxed by `drift`. All matter
counts by its mass: a robot in water should have about its density.

`rho` is the relative density: that of all matter on the grid by that of water at rest.
"""

import taichi as ti

from zoobench.sim.kernels.boundary import WALL_NODES
from zoobench.sim.kernels.splines import QUADRATIC, base_node, weight_derivatives, weights
from zoobench.sim.model.matter import LARGEST_RATIO, SMALLEST_RATIO, TOLERATED_SURPLUS

RESPONSE_CROSSINGS = 60.0
"""Time in which a surplus of 1 changes log J by about 1, in units of the time that sound takes through a cell [-]."""

LEAST_ROOM = 0.01
"""Share of a particle's spline between the walls below which the density is not divided by the share itself [-]."""


@ti.func
def water_pressure(J, constants):
    """Kirchhoff pressure J p [Pa] and its derivative by J, of the Tait equation p = K/gamma (J^-gamma - 1); no tension.

    The equation of state of weakly compressible fluids (Becker and Teschner 2007).
    """
    bulk, gamma = constants[1], constants[2]
    power = ti.pow(J, 1.0 - gamma)  # J p = K/gamma (J^(1 - gamma) - J)
    value, derivative = bulk / gamma * (power - J), bulk / gamma * ((1.0 - gamma) * power / J - 1.0)
    if J >= 1.0:
        value, derivative = 0.0, 0.0
    return value, derivative


@ti.func
def correction_share(inverse_spacing, dt, constants):
    """Fall of J in one substep for a surplus of 1 [-]; proportional to dt, so that the rate does not depend on it."""
    bulk, density = constants[1], constants[3]
    # c dt / h, with the speed of sound c = sqrt(K / rho0): the share of a cell that sound crosses
    return dt * inverse_spacing * ti.sqrt(bulk / density) / RESPONSE_CROSSINGS


@ti.func
def surplus_density(J, rho, spared):
    """Surplus of the relative density over 1 / J, beyond the share `spared` [-]."""
    return ti.max(rho * J - 1.0 - spared, 0.0)


@ti.func
def water_ratio(J, growth, rho, share):
    """New J from the old one, `growth` = det(I + dt C), the relative density and `share` of `correction_share`."""
    # the one-sided rule of expansion: at most the volume that the density on the grid shows
    most = ti.min(ti.max(1.0 / rho, 1.0), LARGEST_RATIO)
    held = ti.min(J * growth, most)
    # the one-sided rule of compression; never below SMALLEST_RATIO unless the flow itself compressed it further
    surplus = surplus_density(J, rho, TOLERATED_SURPLUS)
    return ti.max(held - share * surplus, ti.min(held, SMALLEST_RATIO))


@ti.func
def water_ratio_adjoint(J, growth, rho, share, after_adjoint):
    """Adjoint of `water_ratio` by J, growth and rho; each min and max passes it to the argument that it took."""
    most = ti.min(ti.max(1.0 / rho, 1.0), LARGEST_RATIO)
    held = ti.min(J * growth, most)
    surplus = surplus_density(J, rho, TOLERATED_SURPLUS)
    held_adjoint, surplus_adjoint, most_adjoint = after_adjoint, 0.0 * after_adjoint, 0.0 * after_adjoint
    if surplus > 0.0 and held > SMALLEST_RATIO:
        if held - share * surplus > SMALLEST_RATIO:
            surplus_adjoint = -share * after_adjoint
        else:
            held_adjoint = 0.0
    if J * growth >= most:
        if most > 1.0 and most < LARGEST_RATIO:
            most_adjoint = held_adjoint
        held_adjoint = 0.0
    rho_adjoint = surplus_adjoint * J - most_adjoint / (rho * rho)
    return held_adjoint * growth + surplus_adjoint * rho, held_adjoint * J, rho_adjoint


@ti.func
def room_at(a, width: ti.template()):
    """Share of a node's spline that lies inside a wall, for a node `a` spacings inside it.

    A node on the wall has half of its spline inside. One beyond has only the tail past a distance of 1: the integral of
    (1.5 - r)^2 / 2 from 1 to 1.5 is 1/48, that of the cubic (2 - r)^3 / 6 from 1 to 2 is 1/24.
    """
    most, least = ti.static((47.0 / 48.0, 1.0 / 48.0) if width == QUADRATIC else (23.0 / 24.0, 1.0 / 24.0))
    share = 1.0
    if a < 2:
        share = most
    if a < 1:
        share = 0.5
    if a < 0:
        share = least
    if a < -1:
        share = 0.0
    return share


@ti.func
def node_room(base, grid: ti.template(), width: ti.template()):
    """room[i, d]: share of stencil node i's spline that lies between the walls in direction d."""
    room = ti.Matrix.zero(float, width, 3)
    for i in ti.static(range(width)):
        for d in ti.static(range(3)):
            a = base[d] + i
            beyond = room_at(grid.shape[d + 1] - 1 - WALL_NODES - a, width)
            room[i, d] = room_at(a - WALL_NODES, width) + beyond - 1.0
    return room


@ti.func
def column_sums(a, b):
    """sum_i a[i, d] b[i, d]."""
    total = ti.Vector([a[0, d] * b[0, d] for d in ti.static(range(3))])
    for i in ti.static(range(1, a.n)):
        total += ti.Vector([a[i, d] * b[i, d] for d in ti.static(range(3))])
    return total


@ti.func
def relative_density(grid: ti.template(), g, position, inverse_spacing, density, width: ti.template()):
    """Density of all matter at a place by the rest `density`: sum w m_i / (density h^3), over the share of the spline
    between the walls."""
    base = base_node(position, inverse_spacing, grid, width)
    w = weights(position * inverse_spacing - base, width)
    room = column_sums(w, node_room(base, grid, width))
    total = 0.0 * inverse_spacing
    for i in ti.static(range(width)):
        for j in ti.static(range(width)):
            line = 0.0 * inverse_spacing
            for k in ti.static(range(width)):
                line += w[k, 2] * grid[g, base[0] + i, base[1] + j, base[2] + k][3]
            total += w[i, 0] * w[j, 1] * line
    return total * inverse_spacing**3 / (density * ti.max(room[0] * room[1] * room[2], LEAST_ROOM))


@ti.func
def relative_density_adjoint(
    grid: ti.template(), grid_adjoint: ti.template(), g, position, rho, rho_adjoint, inverse_spacing, density,
    width: ti.template(),
):  # fmt: skip
    """Adjoint of `relative_density`, which gave `rho`: adds to the nodes' mass adjoint, returns the position's."""
    base = base_node(position, inverse_spacing, grid, width)
    offset = position * inverse_spacing - base
    w, dw = weights(offset, width), weight_derivatives(offset, width)
    rooms = node_room(base, grid, width)
    room = column_sums(w, rooms)
    whole = room[0] * room[1] * room[2]
    scaled = rho_adjoint * inverse_spacing**3 / (density * ti.max(whole, LEAST_ROOM))
    total = 0.0 * offset
    for i in ti.static(range(width)):
        for j in ti.static(range(width)):
            for k in ti.static(range(width)):
                mass = scaled * grid[g, base[0] + i, base[1] + j, base[2] + k][3]
                share = scaled * w[i, 0] * w[j, 1] * w[k, 2]
                grid_adjoint[g, base[0] + i, base[1] + j, base[2] + k] += ti.Vector([0.0, 0.0, 0.0, share])
                total[0] += mass * dw[i, 0] * w[j, 1] * w[k, 2]
                total[1] += mass * w[i, 0] * dw[j, 1] * w[k, 2]
                total[2] += mass * w[i, 0] * w[j, 1] * dw[k, 2]
    if whole > LEAST_ROOM:
        # d(1/room) = -room' / room^2, direction by direction
        total -= rho_adjoint * rho * column_sums(dw, rooms) / room
    return inverse_spacing * total
