"""Ground and walls, at the nodes of the grid, and their adjoint.

The wall planes run through the nodes `WALL_NODES` from the grid's edge: those nodes and all beyond are constrained, so
that the wall seen by matter lies at that node up to a first-order error. The ground is such a plane, or a height field:
then every node at or below the field is constrained along the field's normal, exact to the nearest node.

`ground` says at compile time what there is: NONE, or a PLANE or TERRAIN with Coulomb friction. The terrain is given by
node columns `[nx, nz]`: height above the grid's first node [cells], and unit normal.
"""

import taichi as ti

WALL_NODES = 3  # the stencil of a particle on the wall reaches two nodes past it

NONE, PLANE, TERRAIN = 0, 1, 2


@ti.func
def coulomb(v, normal, friction):
    """Node velocity after frictional contact with a surface below; a separating node (v . n >= 0) is free."""
    u = v
    approach = v.dot(normal)
    if approach < 0.0:
        along = v - approach * normal
        speed = along.norm()
        keep = 0.0
        if speed > -friction * approach:
            keep = 1.0 + friction * approach / speed
        u = keep * along
    return u


@ti.func
def coulomb_adjoint(v, adjoint, normal, friction):
    """Adjoint of `coulomb` at the velocity v before contact."""
    pull = adjoint
    approach = v.dot(normal)
    if approach < 0.0:
        along = v - approach * normal
        speed = along.norm()
        pull = 0.0 * adjoint
        if speed > -friction * approach:
            keep = 1.0 + friction * approach / speed
            work = along.dot(adjoint) / speed
            turn = friction * approach * work / (speed * speed)
            slide = keep * adjoint - turn * along
            pull = slide + (friction * work - slide.dot(normal)) * normal
    return pull


@ti.func
def surface(terrain: ti.template(), index, ground: ti.template()):
    """Whether a node lies at or below the ground, and the ground's unit normal there."""
    below, normal = index[1] <= WALL_NODES, ti.Vector([0.0, 1.0, 0.0])
    if ti.static(ground == TERRAIN):
        column = terrain[index[0], index[2]]
        # a plane at a node's own height includes that node, whatever the rounding
        below = index[1] <= column[0] + 1e-4
        normal = ti.Vector([column[1], column[2], column[3]])
    return below, normal


@ti.func
def hits_wall(v, index, count, d: ti.template(), ground: ti.template()):
    """Whether a wall stops the node's velocity in direction d; the ground is not a wall."""
    low = index <= WALL_NODES and v < 0.0
    if ti.static(ground == PLANE and d == 1):
        low = False
    return low or (index >= count - 1 - WALL_NODES and v > 0.0)


@ti.func
def contact(v, index, shape, friction, terrain: ti.template(), ground: ti.template()):
    """Node velocity after ground and walls. `index` and `shape` are the node's and the grid's, `[3]`."""
    u = v
    if ti.static(ground != NONE):
        below, normal = surface(terrain, index, ground)
        if below:
            u = coulomb(v, normal, friction)
    for d in ti.static(range(3)):
        if hits_wall(u[d], index[d], shape[d], d, ground):
            u[d] = 0.0
    return u


@ti.func
def contact_adjoint(v, adjoint, index, shape, friction, terrain: ti.template(), ground: ti.template()):
    """Adjoint of `contact` at the velocity v before it."""
    below, normal = False, 0.0 * v
    u = v
    if ti.static(ground != NONE):
        below, normal = surface(terrain, index, ground)
        if below:
            u = coulomb(v, normal, friction)
    pull = adjoint
    for d in ti.static(range(3)):
        if hits_wall(u[d], index[d], shape[d], d, ground):
            pull[d] = 0.0
    if ti.static(ground != NONE):
        if below:
            pull = coulomb_adjoint(v, pull, normal, friction)
    return pull
