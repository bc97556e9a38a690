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
from zoobench.sim.kernels.laws.law import Law
from zoobench.sim.kernels.splines import QUADRATIC
from zoobench.sim.model.laws.water import LARGEST_RATIO, SMALLEST_RATIO, TOLERATED_SURPLUS, WaterMaterial

RESPONSE_CROSSINGS = 60.0
"""Time in which a surplus of 1 changes log J by about 1, in units of the time that sound takes through a cell [-]."""

LEAST_FREE_FRACTION = 0.01
"""Share of a particle's spline between the walls below which the density is not divided by the share itself [-]."""


@ti.func
def water_pressure(J, medium: ti.template()):
    """Kirchhoff pressure J p [Pa] and its derivative by J, of the Tait equation p = K/gamma (J^-gamma - 1); no tension.

    The equation of state of weakly compressible fluids (Becker and Teschner 2007).
    """
    bulk, gamma = medium.bulk_modulus, medium.exponent
    power = ti.pow(J, 1.0 - gamma)  # J p = K/gamma (J^(1 - gamma) - J)
    value, derivative = bulk / gamma * (power - J), bulk / gamma * ((1.0 - gamma) * power / J - 1.0)
    if J >= 1.0:
        value, derivative = 0.0, 0.0
    return value, derivative


@ti.func
def water_kappa(J, medium: ti.template()):
    """-3 d(J p)/d log J of the Tait pressure at the present J [Pa]."""
    bulk, gamma = medium.bulk_modulus, medium.exponent
    held = ti.min(J, 1.0)
    return 3.0 * bulk / gamma * ((gamma - 1.0) * ti.pow(held, 1.0 - gamma) + held)


@ti.func
def correction_share(inverse_spacing, dt, medium: ti.template()):
    """Fall of J in one substep for a surplus of 1 [-]; proportional to dt, so that the rate does not depend on it."""
    bulk, density = medium.bulk_modulus, medium.density
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
def free_fraction_at(a, width: ti.template()):
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
def free_fractions_along(first, count, width: ti.template()):
    """Share of every stencil node's spline that lies between the walls in one direction, from its first node on."""
    low = first - WALL_NODES
    high = count - 1 - WALL_NODES - first
    return [free_fraction_at(low + i, width) + free_fraction_at(high - i, width) - 1.0 for i in ti.static(range(width))]


@ti.func
def node_free_fractions(at: ti.template(), scene: ti.template(), width: ti.template()):
    """Share of the splines of the stencil's nodes that lies between the walls, by node, its lanes the directions."""
    x = free_fractions_along(at.at.x, scene.nodes_x, width)
    y = free_fractions_along(at.at.y, scene.nodes_y, width)
    z = free_fractions_along(at.at.z, scene.nodes_z, width)
    return [ti.Vector([x[i], y[i], z[i], 0.0]) for i in ti.static(range(width))]


@ti.func
def is_open(first, count, width: ti.template()):
    """True if no node of a stencil from this one on loses any of its spline to a wall."""
    return first >= WALL_NODES + 2 and first + width <= count - WALL_NODES - 2


@ti.func
def is_near_wall(at: ti.template(), scene: ti.template(), width: ti.template()):
    """True if a wall takes part of the splines of the stencil's nodes in any direction."""
    inside = is_open(at.at.x, scene.nodes_x, width) and is_open(at.at.y, scene.nodes_y, width)
    return not (inside and is_open(at.at.z, scene.nodes_z, width))


@ti.func
def weighted_sum(w: ti.template(), a: ti.template(), width: ti.template()):
    """sum_i w[i] a[i], in every direction."""
    total = w[0] * a[0]
    for i in ti.static(range(1, width)):
        total += w[i] * a[i]
    return total


@ti.func
def free_fraction(at: ti.template(), scene: ti.template(), width: ti.template()):
    """Share of a particle's spline that lies between the walls, in every direction."""
    share = ti.Vector([1.0, 1.0, 1.0, 0.0])
    if is_near_wall(at, scene, width):
        share = weighted_sum(at.w, node_free_fractions(at, scene, width), width)
    return share


@ti.func
def density_factor(share, scene: ti.template()):
    """Relative density of a particle by the mass sum w m_i around it [1/kg], with its `free_fraction`."""
    whole = ti.max(share[0] * share[1] * share[2], LEAST_FREE_FRACTION)
    return scene.inverse * scene.inverse * scene.inverse / (scene.medium.density * whole)


@ti.func
def free_fraction_adjoint(at: ti.template(), share, rho, rho_adjoint, scene: ti.template(), width: ti.template()):
    """The part of the adjoint of the relative density `rho` that comes from the walls, by the offset."""
    offset_adjoint = 0.0 * share
    if is_near_wall(at, scene, width):
        if share[0] * share[1] * share[2] > LEAST_FREE_FRACTION:
            # d(1/room) = -room' / room^2, direction by direction
            change = weighted_sum(at.dw, node_free_fractions(at, scene, width), width)
            for d in ti.static(range(3)):
                offset_adjoint[d] = -rho_adjoint * rho * change[d] / share[d]
    return offset_adjoint


LAW = Law(WaterMaterial.constants, water_kappa, pressure=water_pressure, is_viscous=True)
