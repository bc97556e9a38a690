"""Ground and walls, at the nodes of the grid, and their adjoint.

The wall planes run through the nodes `WALL_NODES` from the grid's edge: those nodes and all beyond are constrained, so
that the wall seen by matter lies at that node up to a first-order error. The ground is such a plane, or a height field:
then every node at or below the field is constrained along the field's normal, exact to the nearest node.

Where there is a fluid, walls and level ground are `tight`: `wall_pressure` acts on all the nodes that a spline cut off
by them reaches. Otherwise a fluid at rest finds no equilibrium near them, and circulates for ever.

`ground` selects at compile time: NONE, or a PLANE or TERRAIN with Coulomb friction. The terrain is given by node
columns `[nx, nz]`: height above the grid's first node [cells], and unit normal.
"""

import taichi as ti

WALL_NODES = 3
"""Nodes between the grid's edge and the wall planes: the stencil of a particle on a wall reaches two nodes past it."""

NONE, PLANE, TERRAIN = 0, 1, 2


@ti.func
def coulomb(v, normal, friction):
    """Node velocity after Coulomb friction with a surface below; a separating node (v . n >= 0) is free."""
    u = v
    approach = v.dot(normal)
    if approach < 0.0:
        along = v - approach * normal
        speed = along.norm()
        # the impulse that stops the approach, -m v.n, allows a tangential one of up to friction times it: the node
        # slides with what is left of its speed, or sticks (Stomakhin et al. 2013)
        keep = 0.0
        if speed > -friction * approach:
            keep = 1.0 + friction * approach / speed
        u = keep * along
    return u


@ti.func
def coulomb_adjoint(v, u_adjoint, normal, friction):
    """Adjoint of `coulomb` at the velocity v before contact."""
    v_adjoint = u_adjoint
    approach = v.dot(normal)
    if approach < 0.0:
        along = v - approach * normal
        speed = along.norm()
        v_adjoint = 0.0 * u_adjoint  # a sticking node rests whatever its velocity was
        if speed > -friction * approach:
            keep = 1.0 + friction * approach / speed
            # u = along + friction (v.n) along / |along|: by the direction of sliding, then by the approach
            work = along.dot(u_adjoint) / speed
            turn = friction * approach * work / (speed * speed)
            slide = keep * u_adjoint - turn * along
            v_adjoint = slide + (friction * work - slide.dot(normal)) * normal
    return v_adjoint


@ti.func
def surface(terrain: ti.template(), index, ground: ti.template(), depth: ti.template()):
    """True for a node at or below the ground, or so many nodes under it, and the ground's unit normal there."""
    below, normal = index[1] <= WALL_NODES - depth, ti.Vector([0.0, 1.0, 0.0])
    if ti.static(ground == TERRAIN):
        column = terrain[index[0], index[2]]
        # a plane at a node's own height includes that node, whatever the rounding
        below = index[1] <= column[0] - depth + 1e-4
        normal = ti.Vector([column[1], column[2], column[3]])
    return below, normal


@ti.func
def hits_wall(v, index, count, d: ti.template(), ground: ti.template(), depth: ti.template()):
    """True if a wall stops the node's velocity in direction d; the ground is not a wall."""
    low = index <= WALL_NODES and v < 0.0
    if ti.static(d == 1 and (ground == PLANE or depth > 0)):
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
def contact(c: ti.template(), v, index: ti.template(), friction, tight: ti.template(), depth: ti.template()):
    """Velocity of the node `index` after ground and walls.

    The ground constrains nodes from so many nodes below it on; 0 includes those at the ground.

    Where walls are `tight`, `wall_pressure` sets the normal velocity of the first nodes behind them.
    """
    shape = (c.scene.nodes_x, c.scene.nodes_y, c.scene.nodes_z)
    u = v
    if ti.static(c.variant.ground != NONE):
        below, normal = surface(c.terrain, index, c.variant.ground, depth)
        if below:
            u = coulomb(v, normal, friction)
    for d in ti.static(range(3)):
        if ti.static(tight):
            if behind_wall(index[d], shape[d], d, c.variant.ground) != 0:
                u[d] = v[d]
            elif hits_wall(u[d], index[d], shape[d], d, c.variant.ground, depth):
                u[d] = 0.0
        elif hits_wall(u[d], index[d], shape[d], d, c.variant.ground, depth):
            u[d] = 0.0
    return u


@ti.func
def contact_adjoint(
    c: ti.template(), v, u_adjoint, index: ti.template(), friction, tight: ti.template(), depth: ti.template()
):  # fmt: skip
    """Adjoint of `contact` at the velocity v before it."""
    shape = (c.scene.nodes_x, c.scene.nodes_y, c.scene.nodes_z)
    below, normal = False, 0.0 * v
    u = v
    if ti.static(c.variant.ground != NONE):
        below, normal = surface(c.terrain, index, c.variant.ground, depth)
        if below:
            u = coulomb(v, normal, friction)
    v_adjoint, free_adjoint = u_adjoint, 0.0 * u_adjoint
    for d in ti.static(range(3)):
        if ti.static(tight):
            if behind_wall(index[d], shape[d], d, c.variant.ground) != 0:
                # this component by-passes friction: u[d] = v[d]
                free_adjoint[d] = u_adjoint[d]
                v_adjoint[d] = 0.0
            elif hits_wall(u[d], index[d], shape[d], d, c.variant.ground, depth):
                v_adjoint[d] = 0.0
        elif hits_wall(u[d], index[d], shape[d], d, c.variant.ground, depth):
            v_adjoint[d] = 0.0
    if ti.static(c.variant.ground != NONE):
        if below:
            v_adjoint = coulomb_adjoint(v, v_adjoint, normal, friction)
    return v_adjoint + free_adjoint


@ti.func
def wall_pressure(behind, before, mass_behind, mass_before):
    """Normal velocities, positive into the arena, of the nodes one behind and one before a wall after its pressure.

    A spline that a wall cuts off lacks the matter behind it, whose pressure would hold back the node before the wall.
    The wall replaces it by the least impulse, the same on both nodes, by which behind + before >= 0: then the velocity
    interpolated in its plane is nowhere into it. Matter moves as if it met its mirror image, which is exact for a fluid
    at rest; nothing is done where it separates from the wall.
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
def wall_pressure_adjoint(behind, after_behind, after_before, mass_behind, mass_before, behind_adjoint, before_adjoint):
    """Adjoint of `wall_pressure` by (behind, before, mass_behind, mass_before), from its results.

    A pair that was pressed is recognised by velocities that are exactly opposite.
    """
    adjoints = ti.Vector([behind_adjoint, before_adjoint, 0.0 * behind, 0.0 * behind])
    if after_behind + after_before == 0.0:
        adjoints[0], adjoints[1] = 0.0, 0.0
        if mass_before > 0.0:
            share = (before_adjoint - behind_adjoint) / (mass_behind + mass_before)
            change = share * (behind + after_before)
            adjoints[0], adjoints[1] = -share * mass_behind, share * mass_before
            adjoints[2], adjoints[3] = -change, change * mass_behind / mass_before
    return adjoints
