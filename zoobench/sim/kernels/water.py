"""Weakly compressible water: its pressure, how its volume ratio J is carried along, and the adjoints.

J follows the flow, J <- J det(I + dt C), and so comes apart from the density that the particles really have: it grows
where spray disperses without resistance, and it does not see particles crowd where the flow that the grid resolves is
free of divergence. Two one-sided rules tie it to the density on the grid. J above 1 is remembered only as far as the
matter around is really so thin, and never beyond `LARGEST_RATIO`: spray that meets again has its own volume. And where
the density exceeds what J says by more than the share `CROWDED`, J falls at a steady rate, so that pressure rises and
drives the crowd apart; the rate is slow beside sound, so that nothing rings. What pressure cannot part, because it lies
within one cell, `dispersal` does; and where J strays from that of the water around, `drift` brings it back. All matter
counts, by its mass: a robot should be about as dense.
"""

import taichi as ti

from zoobench.sim.kernels.boundary import WALL_NODES
from zoobench.sim.kernels.splines import QUADRATIC, base_node, weight_slopes, weights
from zoobench.sim.model.matter import CROWDED, LARGEST_RATIO, SMALLEST_RATIO

CROSSINGS = 60.0
"""Time in which a surplus of 1 changes log J by about 1, in those that sound takes through a cell [-]."""

LEAST_ROOM = 0.01
"""Share of a particle's spline between the walls below which the density is no longer divided by it [-]."""


@ti.func
def water_pressure(J, constants):
    """Kirchhoff pressure J p and its derivative, of the Tait equation p = K/gamma (J^-gamma - 1); no tension."""
    bulk, gamma = constants[1], constants[2]
    power = ti.pow(J, 1.0 - gamma)
    value, slope = bulk / gamma * (power - J), bulk / gamma * ((1.0 - gamma) * power / J - 1.0)
    if J >= 1.0:
        value, slope = 0.0, 0.0
    return value, slope


@ti.func
def correction_share(inverse_spacing, dt, constants):
    """By how much J falls in one substep for a surplus of 1: the same in a second whatever the step."""
    bulk, density = constants[1], constants[3]
    return dt * inverse_spacing * ti.sqrt(bulk / density) / CROSSINGS


@ti.func
def surplus_density(J, crowd, spared):
    """By how much the density `crowd` from `crowding` exceeds what J says, beyond the share `spared` [-]."""
    return ti.max(crowd * J - 1.0 - spared, 0.0)


@ti.func
def water_ratio(J, growth, crowd, share):
    """New J from the old one, `growth` = det(I + dt C), `crowd` from `crowding` and `share` from `correction_share`."""
    most = ti.min(ti.max(1.0 / crowd, 1.0), LARGEST_RATIO)
    held = ti.min(J * growth, most)
    surplus = surplus_density(J, crowd, CROWDED)
    return ti.max(held - share * surplus, ti.min(held, SMALLEST_RATIO))


@ti.func
def water_ratio_adjoint(J, growth, crowd, share, pull):
    """Adjoint of `water_ratio`: pulls on J, growth and crowd."""
    most = ti.min(ti.max(1.0 / crowd, 1.0), LARGEST_RATIO)
    held = ti.min(J * growth, most)
    surplus = surplus_density(J, crowd, CROWDED)
    held_pull, surplus_pull, most_pull = pull, 0.0 * pull, 0.0 * pull
    if surplus > 0.0 and held > SMALLEST_RATIO:
        if held - share * surplus > SMALLEST_RATIO:
            surplus_pull = -share * pull
        else:
            held_pull = 0.0
    if J * growth >= most:
        if most > 1.0 and most < LARGEST_RATIO:
            most_pull = held_pull
        held_pull = 0.0
    crowd_pull = surplus_pull * J - most_pull / (crowd * crowd)
    return held_pull * growth + surplus_pull * crowd, held_pull * J, crowd_pull


@ti.func
def room_at(a, width: ti.template()):
    """Share of a node's spline that lies inside a wall, for a node `a` spacings inside it."""
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
def crowding(grid: ti.template(), g, position, inverse_spacing, density, width: ti.template()):
    """Density of all matter at a place over `density`: sum w m_i / (rho h^3), by the share of it between the walls."""
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
def crowding_adjoint(
    grid: ti.template(), grid_adjoint: ti.template(), g, position, crowd, pull, inverse_spacing, density,
    width: ti.template(),
):  # fmt: skip
    """Adjoint of `crowding`, which was `crowd`: adds to the nodes' mass adjoint, returns the position's adjoint."""
    base = base_node(position, inverse_spacing, grid, width)
    offset = position * inverse_spacing - base
    w, slopes = weights(offset, width), weight_slopes(offset, width)
    rooms = node_room(base, grid, width)
    room = column_sums(w, rooms)
    whole = room[0] * room[1] * room[2]
    scaled = pull * inverse_spacing**3 / (density * ti.max(whole, LEAST_ROOM))
    total = 0.0 * offset
    for i in ti.static(range(width)):
        for j in ti.static(range(width)):
            for k in ti.static(range(width)):
                mass = scaled * grid[g, base[0] + i, base[1] + j, base[2] + k][3]
                share = scaled * w[i, 0] * w[j, 1] * w[k, 2]
                grid_adjoint[g, base[0] + i, base[1] + j, base[2] + k] += ti.Vector([0.0, 0.0, 0.0, share])
                total[0] += mass * slopes[i, 0] * w[j, 1] * w[k, 2]
                total[1] += mass * w[i, 0] * slopes[j, 1] * w[k, 2]
                total[2] += mass * w[i, 0] * w[j, 1] * slopes[k, 2]
    if whole > LEAST_ROOM:
        total -= pull * crowd * column_sums(slopes, rooms) / room
    return inverse_spacing * total
