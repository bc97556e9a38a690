"""Ground and walls, at the nodes of the grid, and their adjoint.

The wall planes run through the nodes `WALL_NODES` from the grid's edge: those nodes and all beyond are constrained, so
that the wall seen by matter lies at that node up to a first-order error.
"""

import taichi as ti

WALL_NODES = 3  # the stencil of a particle on the wall reaches two nodes past it


@ti.func
def coulomb(v, friction):
    """Node velocity after frictional contact with the plane below; a separating node (v_y >= 0) is free."""
    u = v
    if v[1] < 0.0:
        speed = ti.sqrt(v[0] * v[0] + v[2] * v[2])
        keep = 0.0
        if speed > -friction * v[1]:
            keep = 1.0 + friction * v[1] / speed
        u = ti.Vector([keep * v[0], 0.0, keep * v[2]])
    return u


@ti.func
def coulomb_adjoint(v, adjoint, friction):
    """Adjoint of `coulomb` at the velocity v before contact."""
    pull = adjoint
    if v[1] < 0.0:
        speed = ti.sqrt(v[0] * v[0] + v[2] * v[2])
        pull = 0.0 * adjoint
        if speed > -friction * v[1]:
            keep = 1.0 + friction * v[1] / speed
            along = (v[0] * adjoint[0] + v[2] * adjoint[2]) / speed
            turn = friction * v[1] * along / (speed * speed)
            pull = ti.Vector([keep * adjoint[0] - turn * v[0], friction * along, keep * adjoint[2] - turn * v[2]])
    return pull


@ti.func
def hits_wall(v, index, count, d: ti.template(), grounded: ti.template()):
    """Whether a wall stops the node's velocity in direction d; the ground is not a wall."""
    low = index <= WALL_NODES and v < 0.0
    if ti.static(grounded and d == 1):
        low = False
    return low or (index >= count - 1 - WALL_NODES and v > 0.0)


@ti.func
def contact(v, index, shape, friction, grounded: ti.template()):
    """Node velocity after ground and walls. `index` and `shape` are the node's and the grid's, `[3]`."""
    u = v
    if ti.static(grounded):
        if index[1] <= WALL_NODES:
            u = coulomb(v, friction)
    for d in ti.static(range(3)):
        if hits_wall(u[d], index[d], shape[d], d, grounded):
            u[d] = 0.0
    return u


@ti.func
def contact_adjoint(v, adjoint, index, shape, friction, grounded: ti.template()):
    """Adjoint of `contact` at the velocity v before it."""
    u = v
    if ti.static(grounded):
        if index[1] <= WALL_NODES:
            u = coulomb(v, friction)
    pull = adjoint
    for d in ti.static(range(3)):
        if hits_wall(u[d], index[d], shape[d], d, grounded):
            pull[d] = 0.0
    if ti.static(grounded):
        if index[1] <= WALL_NODES:
            pull = coulomb_adjoint(v, pull, friction)
    return pull
