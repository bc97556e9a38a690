"""The ground under mud, which slides on it where the mud's shear strength is exceeded; and the adjoint.

No wall holds mud by more than the mud's own shear strength: rough ground carries a traction of at most k = |dev tau| /
sqrt(2) at yield, which is what soil mechanics gives it (the adhesion of undrained clay), and fluids with a yield stress
slip along walls. On a grid of few cells it matters: a velocity that vanishes at the ground grows over a whole cell, so
that of mud between the ground and a sole two cells thick a single layer of nodes flows, at twice the work. What slides
is the layer of yielding mud at the ground, which is thinner than a cell.

Coulomb friction times the pressure is the other bound; the smaller one holds.
"""

import math

import taichi as ti

from zoobench.sim.kernels.boundary import coulomb, hits_wall, surface
from zoobench.sim.kernels.room import ground_height, part_before

SHEAR = 1.0 / math.sqrt(2.0)
"""Shear strength over the norm of the deviatoric stress at yield."""


@ti.func
def spline(x):
    """Quadratic spline at a distance x >= 0 [cells]."""
    tail = ti.max(1.5 - x, 0.0)
    return ti.select(x < 0.5, 0.75 - x * x, 0.5 * tail * tail)


@ti.func
def traction_share(depth):
    """Share of the ground's traction that a node at this depth under it exerts, over the share of its cell above.

    Tractions are spread by the splines of the one or two nodes of a column that the ground holds. The mass of a node is
    that of the mud above the ground, so that the change of velocity that a traction makes does not depend on how much
    of the node's area is covered.
    """
    first = depth - ti.floor(depth)
    return spline(depth) / (spline(first) + spline(first + 1.0)) / ti.max(part_before(0.0 - depth), 1e-4)


@ti.func
def most_friction(c: ti.template(), v, at: ti.template()):
    """Friction coefficient between ground and mud at a node of velocity v, and the ground's normal where the mud's
    strength is what limits it, else zero."""
    friction, limited = c.scene.friction, 0.0 * v
    below, normal = surface(c.terrain, at, c.variant.ground, 0)
    approach = v.dot(normal)
    if below and approach < 0.0:
        depth = ti.max(ground_height(c.terrain, at, c.variant.ground) - at[1], 0.0)
        strength = c.dt * SHEAR * c.scene.medium.yield_stress * c.scene.spacing * c.scene.spacing / c.scene.medium_full
        most = strength * traction_share(depth)
        if most < 0.0 - friction * approach:
            friction = 0.0 - most / approach
            limited = normal
    return friction, limited


@ti.func
def most_friction_adjoint(c: ti.template(), v, u_adjoint, friction, limited, at: ti.template()):
    """What the velocity's adjoint gains by `most_friction`, from that of the velocity after `contact`."""
    v_adjoint = 0.0 * v
    if limited.dot(limited) > 0.0:
        approach = v.dot(limited)
        along = v - approach * limited
        speed = along.norm()
        count = (c.scene.nodes_x, c.scene.nodes_y, c.scene.nodes_z)
        if speed > 0.0 - friction * approach:
            # u = (1 + f a / |along|) along with f = -most / a, so that df / da = -f / a
            u, by_friction = coulomb(v, limited, friction), 0.0 * speed
            for d in ti.static(range(3)):
                if not hits_wall(u[d], at[d], count[d], d, c.variant.ground, 0):
                    by_friction += approach / speed * along[d] * u_adjoint[d]
            v_adjoint = (0.0 - by_friction * friction / approach) * limited
    return v_adjoint
