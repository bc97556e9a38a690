"""Anchors: the nodes of a body within a box are at rest, whatever acts on them.

A body that is held at its base, and an obstacle all of whose nodes are held, whose matter only says where it is. Held
nodes are at rest before bodies meet at them, too, so that what rests on an obstacle does not sink with it.

A base that moves is driven: its particles have the velocity that their row of `body` gives in the fibre's place,
whatever acts on them, and do not deform. That is smooth in their place, as a box of nodes that moves over the grid
would not be. They are weightless and `HEAVINESS` times as heavy as they look: what else is at their nodes would creep
off with the acceleration of a substep, which they take up.
"""

import taichi as ti

from zoobench.sim.kernels.layout import STIFFNESS, V

HEAVINESS = 1e6


@ti.func
def is_held(c: ti.template(), k: ti.template(), index: ti.template()):
    """Whether a node of layer k, `index` of the whole grid, is held."""
    held = False
    if ti.static(c.variant.is_anchored(k)):
        for box in ti.static(c.variant.anchors_of(k)):
            inside = True
            for d in ti.static(range(3)):
                low, high = c.scene.anchor[6 * box + d], c.scene.anchor[6 * box + 3 + d]
                inside = inside and low <= index[d] and index[d] <= high
            held = held or inside
    return held


@ti.func
def unless_held(c: ti.template(), k: ti.template(), index: ti.template(), v):
    """A velocity of layer k at a node, or the adjoint of one: zero where that is held."""
    found = v
    if ti.static(c.variant.is_anchored(k)):
        if is_held(c, k, index):
            found = 0.0 * v
    return found


@ti.func
def heaviness_at(c: ti.template(), k: ti.template(), index: ti.template()):
    """Factor of the mass with which a node of layer k meets other bodies [-].

    Where an object that is free elsewhere is held, it is as heavy as a base that moves: what comes to it stops.
    """
    heaviness = 1.0 + 0.0 * c.dt
    if ti.static(k in c.variant.clamped):
        if is_held(c, k, index):
            heaviness = HEAVINESS
    return heaviness


@ti.func
def is_driven(c: ti.template(), p):
    """Whether a particle is driven; it is known by its stiffness, which is zero."""
    return p < c.scene.robot and c.body[c.w, p, 0][STIFFNESS] == 0.0


@ti.func
def driven_velocity(c: ti.template(), p):
    """The velocity of a driven particle [m/s]."""
    given = c.body[c.w, p, 1]
    return ti.Vector([given[0], given[1], given[2], 0.0])


@ti.func
def scattered_velocity(c: ti.template(), p):
    """The velocity that a particle scatters; a driven one's is without the gravity that its nodes will feel."""
    velocity = c.state[c.s, c.w, p, V]
    if ti.static(c.variant.driven):
        if is_driven(c, p):
            velocity -= c.dt * ti.Vector([c.scene.g_x, c.scene.g_y, c.scene.g_z, 0.0])
    return velocity
