"""Anchors: the nodes of a body within a box are at rest, whatever acts on them.

A body that is held at its base, and an obstacle all of whose nodes are held, whose matter only says where it is. Held
nodes are at rest before bodies meet at them, too, so that what rests on an obstacle does not sink with it.
"""

import taichi as ti


@ti.func
def is_held(c: ti.template(), k: ti.template(), index: ti.template()):
    """Whether a node of layer k, `index` of the whole grid, is held."""
    held = False
    if ti.static(c.variant.is_anchored(k)):
        first = ti.static(6 * c.variant.anchor_of(k))
        held = True
        for d in ti.static(range(3)):
            held = held and c.scene.anchor[first + d] <= index[d] and index[d] <= c.scene.anchor[first + 3 + d]
    return held


@ti.func
def unless_held(c: ti.template(), k: ti.template(), index: ti.template(), v):
    """A velocity of layer k at a node, or the adjoint of one: zero where that is held."""
    found = v
    if ti.static(c.variant.is_anchored(k)):
        if is_held(c, k, index):
            found = 0.0 * v
    return found
