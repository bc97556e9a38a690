"""Ground and walls, at the nodes of the grid, and their adjoint.

The wall planes run through the nodes `WALL_NODES` from the grid's edge: those nodes and all beyond are constrained, so
that the wall seen by matter lies at that node up to a first-order error. The ground is such a plane, or a height field:
then every node at or below the field is constrained along the field's normal, exact to the nearest node.

Where there is a fluid, walls and level ground are `tight`: `press` gives them the pressure on all the nodes that a
spline cut off by them reaches. Otherwise a fluid at rest finds no equilibrium near them, and circulates for ever.

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
def behind_wall(index, count, d: ti.template(), ground: ti.template()):
    """1 or -1, the wall's normal, for the first node behind a low or high wall in direction d; 0 for any other."""
    normal = 0
    if index == WALL_NODES - 1:
        normal = 1
    if ti.static(ground == TERRAIN and d == 1):
        normal = 0
    if index == count - WALL_NODES:
        normal = -1
    return normal


@ti.func
def contact(v, index, shape, friction, terrain: ti.template(), ground: ti.template(), tight: ti.template()):
    """Node velocity after ground and walls. `index` and `shape` are the node's and the grid's, `[3]`.

    Where walls are `tight` the velocity of the first nodes behind them, along their normal, is left to `press`.
    """
    u = v
    if ti.static(ground != NONE):
        below, normal = surface(terrain, index, ground)
        if below:
            u = coulomb(v, normal, friction)
    for d in ti.static(range(3)):
        if ti.static(tight):
            if behind_wall(index[d], shape[d], d, ground) != 0:
                u[d] = v[d]
            elif hits_wall(u[d], index[d], shape[d], d, ground):
                u[d] = 0.0
        elif hits_wall(u[d], index[d], shape[d], d, ground):
            u[d] = 0.0
    return u


@ti.func
def contact_adjoint(
    v, adjoint, index, shape, friction, terrain: ti.template(), ground: ti.template(), tight: ti.template()
):  # fmt: skip
    """Adjoint of `contact` at the velocity v before it."""
    below, normal = False, 0.0 * v
    u = v
    if ti.static(ground != NONE):
        below, normal = surface(terrain, index, ground)
        if below:
            u = coulomb(v, normal, friction)
    pull, passed = adjoint, 0.0 * adjoint
    for d in ti.static(range(3)):
        if ti.static(tight):
            if behind_wall(index[d], shape[d], d, ground) != 0:
                passed[d] = adjoint[d]
                pull[d] = 0.0
            elif hits_wall(u[d], index[d], shape[d], d, ground):
                pull[d] = 0.0
        elif hits_wall(u[d], index[d], shape[d], d, ground):
            pull[d] = 0.0
    if ti.static(ground != NONE):
        if below:
            pull = coulomb_adjoint(v, pull, normal, friction)
    return pull + passed


@ti.func
def press(behind, before, mass_behind, mass_before):
    """Velocities into the room of the nodes one behind and one before a wall, after it has pressed them apart.

    A spline that a wall cuts off misses its matter behind it, whose pressure would hold the node before the wall back.
    The wall stands for it: the least impulse, the same on both, by which behind + before >= 0, so that the velocity in
    its plane is nowhere into it. Pressed matter then moves as if it met its mirror image, which is exact for a fluid
    at rest; where it would part from the wall nothing is done.
    """
    u_behind, u_before = behind, before
    if behind + before < 0.0:
        if mass_before > 0.0:
            u_before = (mass_before * before - mass_behind * behind) / (mass_behind + mass_before)
            u_behind = -u_before
        else:
            u_behind = 0.0
    return u_behind, u_before


@ti.func
def press_adjoint(behind, after_behind, after_before, mass_behind, mass_before, pull_behind, pull_before):
    """Adjoint of `press`: pulls on (behind, before, mass_behind, mass_before), from what it gave.

    Nodes that were pressed are known by velocities that are opposite to the last bit.
    """
    back = ti.Vector([pull_behind, pull_before, 0.0 * behind, 0.0 * behind])
    if after_behind + after_before == 0.0:
        back[0], back[1] = 0.0, 0.0
        if mass_before > 0.0:
            share = (pull_before - pull_behind) / (mass_behind + mass_before)
            change = share * (behind + after_before)
            back[0], back[1] = -share * mass_behind, share * mass_before
            back[2], back[3] = -change, change * mass_behind / mass_before
    return back
