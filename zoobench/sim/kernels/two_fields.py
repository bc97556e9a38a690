"""Robot and medium in velocity fields of their own, which meet at the nodes that both fill; and the adjoint.

Every node is there twice, the medium's nodes behind the robot's (`layer`): particles see those of their own matter
alone. At a node where the volume shares of both add up to nearly one, an inelastic impulse keeps the robot from moving
into the medium, with Coulomb friction (Bardenhagen, Brackbill and Sulsky 2000). Where they add up to less, there is a
gap, which a node by itself does not show: the splines of both reach over it by up to a cell. The impulse is equal and
opposite, and never adds energy. A solid bed carries a slow robot whole, see `CARRIED`.

The normal is the gradient of the medium's mass, by differences between neighbours: a bed is smooth on the scale of the
grid, while the gradient of a robot of a few cells is tilted along all its edges, on which it would stick. Medium
without a gradient, deep in the robot or in the midst of splashes, moves with it.
"""

import taichi as ti

from zoobench.sim.kernels.boundary import WALL_NODES, contact, contact_adjoint
from zoobench.sim.kernels.layout import MOMENTUM, PUSH, VELOCITY
from zoobench.sim.kernels.mud_wall import most_friction, most_friction_adjoint
from zoobench.sim.kernels.room import ground_height, room_around, room_beside
from zoobench.sim.kernels.skin_contact import STOP_NODES, rub, rub_adjoint

CLOSING, CLOSED = 0.7, 0.8
"""Sums of the volume shares at which contact begins and is complete [-].

Two planes that touch have a sum of 1 and with half a cell between them 0.6; a corner on a plane has 0.75. With higher
ones, feet of half a cell sink by a third of a cell into a rigid bed; the lower they are, the more a footing carries:
one of two cells 1.6, 1.9 and 2.0 times its load from 0.8, 0.7 and 0.6 on. The step is steep because a contact by halves
is no softer, but creeps.
"""

CARRIED = 2.0
"""What a contact with a solid bed carries without any approach, when complete: pressure over density [m^2/s^2].

The impulse takes a share of the approach, which gravity renews in every substep: alone it would let a robot sink by
ever less for ever. What this pressure, half a kPa between robot and bed, stops within a substep is stopped whole, so
that a state of rest exists. With more, a narrow footing carries more than it should.
"""

FLAT = 0.01
"""Gradient of the medium's volume share [1/cell] below which there is no normal; at a surface it is 0.48."""


@ti.func
def layers(variant: ti.template()):
    """How often every node is there."""
    return ti.static(2 if variant.two_fields else 1)


@ti.func
def layer(nodes: ti.template(), scene: ti.template(), p, variant: ti.template()):
    """The nodes of a particle's own matter in a box of nodes."""
    origin = nodes.origin
    if ti.static(variant.two_fields and variant.robot):
        if p >= scene.robot:
            origin += nodes.size
    elif ti.static(variant.two_fields):
        origin += nodes.size
    return ti.Struct(sx=nodes.sx, sy=nodes.sy, origin=origin, size=nodes.size)


@ti.func
def medium_layer(nodes: ti.template(), variant: ti.template()):
    """How many nodes further the medium's are."""
    return nodes.size * (layers(variant) - 1)


@ti.func
def beside(
    scene: ti.template(), window: ti.template(), s, w, index: ti.template(), rooms, terrain: ti.template(),
    ground: ti.template(),
):  # fmt: skip
    """Factors of the shares' masses at the next and at the last node along each direction in central differences: zero
    beside the window, and both along a wall's normal on its plane and beyond."""
    count = (scene.nodes_x, scene.nodes_y, scene.nodes_z)
    low = (1.0 * WALL_NODES, ground_height(terrain, index, ground), 1.0 * WALL_NODES)
    up, down = ti.Vector([0.0, 0.0, 0.0]), ti.Vector([0.0, 0.0, 0.0])
    for d in ti.static(range(3)):
        if index[d] > low[d] and index[d] < count[d] - 1 - WALL_NODES:
            if index[d] + 1 < window[s, w, 3 + d]:
                up[d] = 0.5 / room_beside(scene, index, rooms, d, 1, terrain, ground)
            if index[d] > window[s, w, d]:
                down[d] = 0.5 / room_beside(scene, index, rooms, d, -1, terrain, ground)
    return up, down


@ti.func
def mass_gradient(grid: ti.template(), m, nodes: ti.template(), up, down):
    """Gradient of the mass at node m [kg/cell], as if it filled what walls cut off."""
    slope = ti.Vector([0.0, 0.0, 0.0])
    for d in ti.static(range(3)):
        stride = (nodes.sx, nodes.sy, 1)[d]
        if up[d] > 0.0:
            slope[d] += up[d] * grid[MOMENTUM, m + stride][3]
        if down[d] > 0.0:
            slope[d] += -down[d] * grid[MOMENTUM, m - stride][3]
    return slope


@ti.func
def mass_gradient_adjoint(grid_adjoint: ti.template(), m, nodes: ti.template(), up, down, adjoint):
    """Adjoint of `mass_gradient`: adds to those of the neighbours' mass."""
    for d in ti.static(range(3)):
        stride = (nodes.sx, nodes.sy, 1)[d]
        if up[d] > 0.0:
            grid_adjoint[MOMENTUM, m + stride] += ti.Vector([0.0, 0.0, 0.0, up[d] * adjoint[d]])
        if down[d] > 0.0:
            grid_adjoint[MOMENTUM, m - stride] += ti.Vector([0.0, 0.0, 0.0, -down[d] * adjoint[d]])


@ti.func
def closure(total):
    """Share of a full contact at a sum of volume shares, a smooth step, and its derivative."""
    t = ti.max(0.0, ti.min(1.0, (total - CLOSING) / (CLOSED - CLOSING)))
    return t * t * (3.0 - 2.0 * t), 6.0 * t * (1.0 - t) / (CLOSED - CLOSING)


@ti.func
def touched(relative, slope, share, carried, friction):
    """Change of the robot's velocity `relative` to the medium by their contact, for a reduced mass of one.

    Of the approach, what is `carried` [m/s] is stopped whole, and of the rest a share. The tangential velocity is
    stopped as far as friction times that can: it balances the forces of this very substep, so that what sticks does not
    creep. Where the medium has no slope, a share of all is stopped.
    """
    change = (0.0 - share) * relative
    square = slope.dot(slope)
    if square > 0.0:
        inside = FLAT * FLAT / (FLAT * FLAT + square)
        normal = (-1.0 / ti.sqrt(square)) * slope  # out of the medium, as that of a ground
        away = relative.dot(normal)
        approach = ti.max(0.0 - away, 0.0)
        stopped = share * approach + (1.0 - share) * ti.min(approach, carried)
        along = relative - away * normal
        speed, lost = along.norm(), 1.0 + 0.0 * share
        if speed > friction * stopped:
            lost = friction * stopped / speed
        change = (1.0 - inside) * (stopped * normal - lost * along) + inside * change
    return change


@ti.func
def touched_adjoint(relative, slope, share, carried, friction, adjoint):
    """Adjoint of `touched` by the relative velocity, the slope, the share and what is carried."""
    by_relative, by_slope = (0.0 - share) * adjoint, 0.0 * adjoint
    by_share, by_carried = 0.0 - relative.dot(adjoint), 0.0 * share
    square = slope.dot(slope)
    if square > 0.0:
        inside = FLAT * FLAT / (FLAT * FLAT + square)
        outside = 1.0 - inside
        normal = (-1.0 / ti.sqrt(square)) * slope
        away = relative.dot(normal)
        approach = ti.max(0.0 - away, 0.0)
        whole = ti.min(approach, carried)
        stopped = share * approach + (1.0 - share) * whole
        along = relative - away * normal
        speed, lost = along.norm(), 1.0 + 0.0 * share
        along_adjoint, stopped_adjoint = (0.0 - outside) * adjoint, outside * normal.dot(adjoint)
        if speed > friction * stopped:
            # the velocity lost is friction stopped along / |along|
            lost = friction * stopped / speed
            work = along.dot(along_adjoint) / speed
            stopped_adjoint += friction * work
            along_adjoint = lost * along_adjoint - (lost * work / speed) * along
        by_inside = (0.0 - share * relative - stopped * normal + lost * along).dot(adjoint)
        # along = v - (v . n) n
        into = along_adjoint.dot(normal)
        by_relative = along_adjoint - into * normal + inside * by_relative
        by_normal = (outside * stopped) * adjoint - away * along_adjoint - into * relative
        by_share = inside * by_share + stopped_adjoint * (approach - whole)
        by_approach = share * stopped_adjoint
        if approach > carried:
            by_carried = (1.0 - share) * stopped_adjoint
        else:
            by_approach = stopped_adjoint
        if away < 0.0:
            by_relative += (0.0 - by_approach) * normal
            by_normal += (0.0 - by_approach) * relative
        by_slope = (-1.0 / ti.sqrt(square)) * (by_normal - by_normal.dot(normal) * normal)
        by_slope += (-2.0 * inside * inside / (FLAT * FLAT) * by_inside) * slope
    return by_relative, by_slope, by_share, by_carried


@ti.func
def free_velocity(q, dt, scene: ti.template()):
    """Velocity of a node's momentum and mass after gravity; of an empty node that of gravity alone."""
    v = ti.Vector([dt * scene.g_x, dt * scene.g_y, dt * scene.g_z])
    if q[3] > 0.0:
        v += ti.Vector([q[0], q[1], q[2]]) / q[3]
    return v


@ti.func
def meeting(
    grid: ti.template(), m, nodes: ti.template(), window: ti.template(), s, w, index: ti.template(), dt,
    scene: ti.template(), terrain: ti.template(), variant: ti.template(),
):  # fmt: skip
    """Velocities of robot and medium at a node after gravity and their contact, the impulse from medium to robot, and
    what the impulse is made of."""
    q, o = grid[MOMENTUM, m], grid[MOMENTUM, m + nodes.size]
    v, u = free_velocity(q, dt, scene), free_velocity(o, dt, scene)
    share, rise, reduced, carried, strength = 0.0 * dt, 0.0 * dt, 0.0 * dt, 0.0 * dt, 0.0 * dt
    slope, change, impulse = 0.0 * v, 0.0 * v, 0.0 * v
    room, up, down = 1.0 + 0.0 * dt, 0.0 * v, 0.0 * v
    if q[3] > 0.0 and o[3] > 0.0:
        rooms = room_around(scene, index, terrain, variant.ground)
        room = rooms[0] * rooms[1] * rooms[2]
        total = (q[3] / scene.robot_full + o[3] / scene.medium_full) / room
        share, rise = closure(total)
        if share > 0.0:
            if ti.static(not variant.liquid):
                strength = dt * CARRIED * scene.inverse / (CLOSED - CLOSING)
                carried = strength * (total - CLOSING)
            up, down = beside(scene, window, s, w, index, rooms, terrain, variant.ground)
            slope = mass_gradient(grid, m + nodes.size, nodes, up, down) / scene.medium_full
            change = touched(v - u, slope, share, carried, scene.interface_friction)
            reduced = q[3] * o[3] / (q[3] + o[3])
            impulse = reduced * change
            v += impulse / q[3]
            u += (-1.0 / o[3]) * impulse
    return ti.Struct(
        v=v, u=u, share=share, rise=rise, carried=carried, strength=strength, reduced=reduced, slope=slope,
        change=change, impulse=impulse, room=room, up=up, down=down,
    )  # fmt: skip


@ti.func
def pushed(grid: ti.template(), m, mass, skin: ti.template()):
    """Change of velocity by the ground's skin at node m of this mass; none without `skin`."""
    push = ti.Vector([0.0 * mass, 0.0, 0.0])
    if ti.static(skin):
        push = ti.Vector([grid[PUSH, m][0], grid[PUSH, m][1], grid[PUSH, m][2]]) / mass
    return push


@ti.func
def grounded(
    v, push, at, count, friction, terrain: ti.template(), skin: ti.template(), tight: ti.template(),
    variant: ti.template(),
):  # fmt: skip
    """Velocity of a node after the ground: a wall, or a skin that changes it by `push`, above a wall further down."""
    u = v
    if ti.static(skin):
        u = rub(v + push, push, friction)
    return contact(u, at, count, friction, terrain, variant.ground, tight, STOP_NODES * skin)


@ti.func
def grounded_adjoint(
    v, push, stored, at, count, friction, terrain: ti.template(), skin: ti.template(),
    tight: ti.template(), variant: ti.template(),
):  # fmt: skip
    """Adjoints of `grounded` by the velocity and by `push`, from that of its result."""
    u, given = v, ti.Vector([stored[0], stored[1], stored[2]])
    if ti.static(skin):
        u = rub(v + push, push, friction)
    v_adjoint = contact_adjoint(u, given, at, count, friction, terrain, variant.ground, tight, STOP_NODES * skin)
    push_adjoint = 0.0 * v_adjoint
    if ti.static(skin):
        v_adjoint, push_adjoint = rub_adjoint(v + push, push, v_adjoint, friction)
        push_adjoint += v_adjoint
    return v_adjoint, push_adjoint


@ti.func
def update_both(
    grid: ti.template(), m, node, nodes: ti.template(), window: ti.template(), s, w, index: ti.template(), dt,
    scene: ti.template(), terrain: ti.template(), variant: ti.template(),
):  # fmt: skip
    """Momenta of robot and medium at node m to velocities at `node`, with gravity, their contact, and the ground's."""
    found = meeting(grid, m, nodes, window, s, w, index, dt, scene, terrain, variant)
    at, count = ti.Vector([index[0], index[1], index[2]]), ti.Vector([scene.nodes_x, scene.nodes_y, scene.nodes_z])
    for k in ti.static(range(2)):
        mass, after = grid[MOMENTUM, m + k * nodes.size][3], ti.Vector([0.0, 0.0, 0.0, 0.0])
        if mass > 0.0:
            free = found.v
            if ti.static(k == 1):
                free = found.u
            push = pushed(grid, m, mass, k == 0 and variant.skin)
            friction = scene.friction
            if ti.static(k == 1 and variant.slides):
                friction, _limited = most_friction(free, at, dt, scene, terrain, variant.ground)
            tight = ti.static(k == 1 and variant.liquid)
            held = grounded(free, push, at, count, friction, terrain, k == 0 and variant.skin, tight, variant)
            after = ti.Vector([held[0], held[1], held[2], mass])
        grid[VELOCITY, node + k * nodes.size] = after


@ti.func
def update_both_adjoint(
    grid: ti.template(), grid_adjoint: ti.template(), m, node, nodes: ti.template(), window: ti.template(), s, w,
    index: ti.template(), dt, scene: ti.template(), terrain: ti.template(), variant: ti.template(),
):  # fmt: skip
    """Adjoint of `update_both`: the velocities' adjoints at `node` become those of momentum (0..2) and mass (3).

    Those of the neighbours' mass are added to; so are all, which is atomic where nodes are taken at once.
    """
    found = meeting(grid, m, nodes, window, s, w, index, dt, scene, terrain, variant)
    at, count = ti.Vector([index[0], index[1], index[2]]), ti.Vector([scene.nodes_x, scene.nodes_y, scene.nodes_z])
    q, o = grid[MOMENTUM, m], grid[MOMENTUM, m + nodes.size]
    stored, other = grid_adjoint[MOMENTUM, node], grid_adjoint[MOMENTUM, node + nodes.size]
    v_adjoint, u_adjoint = 0.0 * found.v, 0.0 * found.u
    q_mass, o_mass = 0.0 * dt, 0.0 * dt
    push_adjoint = 0.0 * found.v
    if q[3] > 0.0:
        push = pushed(grid, m, q[3], variant.skin)
        v_adjoint, push_adjoint = grounded_adjoint(
            found.v, push, stored, at, count, scene.friction, terrain, variant.skin, False, variant
        )
        push_adjoint /= q[3]  # of the impulse, from that of the change of velocity
        q_mass = 0.0 - push_adjoint.dot(push)
    if o[3] > 0.0:
        friction, limited = scene.friction, 0.0 * found.u
        if ti.static(variant.slides):
            friction, limited = most_friction(found.u, at, dt, scene, terrain, variant.ground)
        tight = ti.static(variant.liquid)
        u_adjoint, _none = grounded_adjoint(
            found.u, found.u, other, at, count, friction, terrain, False, tight, variant
        )
        if ti.static(variant.slides):
            u_adjoint += most_friction_adjoint(found.u, other, friction, limited, at, count, variant.ground)
    if ti.static(variant.skin):
        grid_adjoint[PUSH, node] = ti.Vector([push_adjoint[0], push_adjoint[1], push_adjoint[2], 0.0])
    if found.share > 0.0:
        # v' = v + J / q and u' = u - J / o with J = reduced change
        impulse_adjoint = v_adjoint / q[3] - u_adjoint / o[3]
        by_reduced = found.change.dot(impulse_adjoint)
        relative = free_velocity(q, dt, scene) - free_velocity(o, dt, scene)
        by_velocity, by_slope, by_share, by_carried = touched_adjoint(
            relative, found.slope, found.share, found.carried, scene.interface_friction, found.reduced * impulse_adjoint
        )
        by_total = (by_share * found.rise + by_carried * found.strength) / found.room
        # reduced = q o / (q + o)
        q_part, o_part = found.reduced / q[3], found.reduced / o[3]
        q_mass += by_total / scene.robot_full
        o_mass += by_total / scene.medium_full
        # divided twice: in float32 the square of a mass below 1e-23 kg, of a node that a field hardly touches, is 0
        q_mass += by_reduced * q_part * q_part - v_adjoint.dot(found.impulse) / q[3] / q[3]
        o_mass += by_reduced * o_part * o_part + u_adjoint.dot(found.impulse) / o[3] / o[3]
        v_adjoint += by_velocity
        u_adjoint = u_adjoint - by_velocity
        by_slope = by_slope / scene.medium_full
        mass_gradient_adjoint(grid_adjoint, node + nodes.size, nodes, found.up, found.down, by_slope)
    grid_adjoint[MOMENTUM, node] += momentum_adjoint(q, v_adjoint, q_mass, stored)
    grid_adjoint[MOMENTUM, node + nodes.size] += momentum_adjoint(o, u_adjoint, o_mass, other)


@ti.func
def momentum_adjoint(q, v_adjoint, mass_adjoint, stored):
    """What is to be added to the `stored` adjoint of a node's velocity so that it becomes that of (momentum, mass)."""
    change = ti.Vector([0.0 - stored[0], 0.0 - stored[1], 0.0 - stored[2], mass_adjoint])
    if q[3] > 0.0:
        a = v_adjoint / q[3]
        by_mass = (a[0] * q[0] + a[1] * q[1] + a[2] * q[2]) / q[3]
        change += ti.Vector([a[0], a[1], a[2], 0.0 - by_mass])
    return change
