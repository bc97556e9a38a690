"""Robot and medium in velocity fields of their own, which meet at the nodes that both fill; and the adjoint.

Every node is there twice, the medium's nodes behind the robot's (`layer`): particles see those of their own matter
alone. At a node where the volume shares of both add up to nearly one, an inelastic impulse keeps the robot from moving
into the medium, with Coulomb friction (Bardenhagen, Brackbill and Sulsky 2000). Where they add up to less, there is a
gap, which a node by itself does not show: the splines of both reach over it by up to a cell. The impulse is equal and
opposite, and never adds energy. A solid bed carries a slow robot whole, see `PRELOAD`.

The normal is the gradient of the medium's mass, by differences between neighbours: a bed is smooth on the scale of the
grid, while the gradient of a robot of a few cells is tilted along all its edges, on which it would stick. Medium
without a gradient, deep in the robot or in the midst of splashes, moves with it.
"""

import taichi as ti

from zoobench.sim.kernels.boundary import WALL_NODES, contact, contact_adjoint
from zoobench.sim.kernels.layout import MOMENTUM, PUSH, VELOCITY
from zoobench.sim.kernels.mud_wall import most_friction, most_friction_adjoint
from zoobench.sim.kernels.room import free_volume_beside, free_volumes, ground_height
from zoobench.sim.kernels.skin_contact import STOP_NODES, coulomb_friction, coulomb_friction_adjoint

CONTACT_FROM, CONTACT_WHOLE = 0.7, 0.8
"""Sums of the volume shares at which contact begins and is complete [-].

Two planes that touch have a sum of 1 and with half a cell between them 0.6; a corner on a plane has 0.75. With higher
ones, feet of half a cell sink by a third of a cell into a rigid bed; the lower they are, the more a footing carries:
one of two cells 1.6, 1.9 and 2.0 times its load from 0.8, 0.7 and 0.6 on. The step is steep because a contact by halves
is no softer, but creeps.
"""

PRELOAD = 2.0
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
def layer(c: ti.template(), p):
    """The nodes of a particle's own matter in a box of nodes."""
    origin = c.nodes.origin
    if ti.static(c.variant.two_fields and c.variant.robot):
        if p >= c.scene.robot:
            origin += c.nodes.size
    elif ti.static(c.variant.two_fields):
        origin += c.nodes.size
    return ti.Struct(sx=c.nodes.sx, sy=c.nodes.sy, origin=origin, size=c.nodes.size)


@ti.func
def medium_layer(c: ti.template()):
    """How many nodes further the medium's are."""
    return c.nodes.size * (layers(c.variant) - 1)


@ti.func
def beside(c: ti.template(), index: ti.template(), rooms):
    """Factors of the shares' masses at the next and at the last node along each direction in central differences: zero
    beside the window, and both along a wall's normal on its plane and beyond."""
    count = (c.scene.nodes_x, c.scene.nodes_y, c.scene.nodes_z)
    low = (1.0 * WALL_NODES, ground_height(c.terrain, index, c.variant.ground), 1.0 * WALL_NODES)
    up, down = ti.Vector([0.0, 0.0, 0.0]), ti.Vector([0.0, 0.0, 0.0])
    for d in ti.static(range(3)):
        if index[d] > low[d] and index[d] < count[d] - 1 - WALL_NODES:
            if index[d] + 1 < c.window[c.window_slot, c.w, 3 + d]:
                up[d] = 0.5 / free_volume_beside(c, index, rooms, d, 1)
            if index[d] > c.window[c.window_slot, c.w, d]:
                down[d] = 0.5 / free_volume_beside(c, index, rooms, d, -1)
    return up, down


@ti.func
def mass_gradient(c: ti.template(), m, up, down):
    """Gradient of the mass at node m [kg/cell], as if it filled what walls cut off."""
    slope = ti.Vector([0.0, 0.0, 0.0])
    for d in ti.static(range(3)):
        stride = (c.nodes.sx, c.nodes.sy, 1)[d]
        if up[d] > 0.0:
            slope[d] += up[d] * c.grid[MOMENTUM, m + stride][3]
        if down[d] > 0.0:
            slope[d] += -down[d] * c.grid[MOMENTUM, m - stride][3]
    return slope


@ti.func
def mass_gradient_adjoint(c: ti.template(), m, up, down, adjoint):
    """Adjoint of `mass_gradient`: adds to those of the neighbours' mass."""
    for d in ti.static(range(3)):
        stride = (c.nodes.sx, c.nodes.sy, 1)[d]
        if up[d] > 0.0:
            c.grid_adjoint[MOMENTUM, m + stride] += ti.Vector([0.0, 0.0, 0.0, up[d] * adjoint[d]])
        if down[d] > 0.0:
            c.grid_adjoint[MOMENTUM, m - stride] += ti.Vector([0.0, 0.0, 0.0, -down[d] * adjoint[d]])


@ti.func
def contact_fraction(total):
    """Share of a full contact at a sum of volume shares, a smooth step, and its derivative."""
    t = ti.max(0.0, ti.min(1.0, (total - CONTACT_FROM) / (CONTACT_WHOLE - CONTACT_FROM)))
    return t * t * (3.0 - 2.0 * t), 6.0 * t * (1.0 - t) / (CONTACT_WHOLE - CONTACT_FROM)


@ti.func
def contact_change(relative, slope, share, preload, friction):
    """Change of the robot's velocity `relative` to the medium by their contact, for a reduced mass of one.

    Of the approach, what is `preload` [m/s] is stopped whole, and of the rest a share. The tangential velocity is
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
        stopped = share * approach + (1.0 - share) * ti.min(approach, preload)
        along = relative - away * normal
        speed, lost = along.norm(), 1.0 + 0.0 * share
        if speed > friction * stopped:
            lost = friction * stopped / speed
        change = (1.0 - inside) * (stopped * normal - lost * along) + inside * change
    return change


@ti.func
def contact_change_adjoint(relative, slope, share, preload, friction, adjoint):
    """Adjoint of `contact_change` by the relative velocity, the slope, the share and what is carried."""
    by_relative, by_slope = (0.0 - share) * adjoint, 0.0 * adjoint
    by_share, by_preload = 0.0 - relative.dot(adjoint), 0.0 * share
    square = slope.dot(slope)
    if square > 0.0:
        inside = FLAT * FLAT / (FLAT * FLAT + square)
        outside = 1.0 - inside
        normal = (-1.0 / ti.sqrt(square)) * slope
        away = relative.dot(normal)
        approach = ti.max(0.0 - away, 0.0)
        whole = ti.min(approach, preload)
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
        if approach > preload:
            by_preload = (1.0 - share) * stopped_adjoint
        else:
            by_approach = stopped_adjoint
        if away < 0.0:
            by_relative += (0.0 - by_approach) * normal
            by_normal += (0.0 - by_approach) * relative
        by_slope = (-1.0 / ti.sqrt(square)) * (by_normal - by_normal.dot(normal) * normal)
        by_slope += (-2.0 * inside * inside / (FLAT * FLAT) * by_inside) * slope
    return by_relative, by_slope, by_share, by_preload


@ti.func
def free_velocity(c: ti.template(), q):
    """Velocity of a node's momentum and mass after gravity; of an empty node that of gravity alone."""
    v = ti.Vector([c.dt * c.scene.g_x, c.dt * c.scene.g_y, c.dt * c.scene.g_z])
    if q[3] > 0.0:
        v += ti.Vector([q[0], q[1], q[2]]) / q[3]
    return v


@ti.func
def contact_impulse(c: ti.template(), m, index: ti.template()):
    """Velocities of robot and medium at a node after gravity and their contact, the impulse from medium to robot, and
    what the impulse is made of."""
    q, o = c.grid[MOMENTUM, m], c.grid[MOMENTUM, m + c.nodes.size]
    v, u = free_velocity(c, q), free_velocity(c, o)
    share, rise, reduced, preload, strength = 0.0 * c.dt, 0.0 * c.dt, 0.0 * c.dt, 0.0 * c.dt, 0.0 * c.dt
    slope, change, impulse = 0.0 * v, 0.0 * v, 0.0 * v
    room, up, down = 1.0 + 0.0 * c.dt, 0.0 * v, 0.0 * v
    if q[3] > 0.0 and o[3] > 0.0:
        rooms = free_volumes(c, index)
        room = rooms[0] * rooms[1] * rooms[2]
        total = (q[3] / c.scene.robot_full + o[3] / c.scene.medium_full) / room
        share, rise = contact_fraction(total)
        if share > 0.0:
            if ti.static(not c.variant.liquid):
                strength = c.dt * PRELOAD * c.scene.inverse / (CONTACT_WHOLE - CONTACT_FROM)
                preload = strength * (total - CONTACT_FROM)
            up, down = beside(c, index, rooms)
            slope = mass_gradient(c, m + c.nodes.size, up, down) / c.scene.medium_full
            change = contact_change(v - u, slope, share, preload, c.scene.interface_friction)
            reduced = q[3] * o[3] / (q[3] + o[3])
            impulse = reduced * change
            v += impulse / q[3]
            u += (-1.0 / o[3]) * impulse
    return ti.Struct(
        v=v, u=u, share=share, rise=rise, preload=preload, strength=strength, reduced=reduced, slope=slope,
        change=change, impulse=impulse, room=room, up=up, down=down,
    )  # fmt: skip


@ti.func
def pushed(c: ti.template(), k: ti.template(), m, mass):
    """Change of velocity by the ground's skin at node m of layer k and of this mass; none where it has no skin."""
    push = ti.Vector([0.0 * mass, 0.0, 0.0])
    if ti.static(c.variant.has_skin(k)):
        push = ti.Vector([c.grid[PUSH, m][0], c.grid[PUSH, m][1], c.grid[PUSH, m][2]]) / mass
    return push


@ti.func
def ground_contact(c: ti.template(), k: ti.template(), v, push, index: ti.template(), friction):
    """Velocity of a node of layer k after the ground: a wall, or a skin that changes it by `push`, above a wall further
    down."""
    skin = ti.static(c.variant.has_skin(k))
    u = v
    if ti.static(skin):
        u = coulomb_friction(v + push, push, friction)
    return contact(c, u, index, friction, ti.static(c.variant.is_tight(k)), STOP_NODES * skin)


@ti.func
def ground_contact_adjoint(c: ti.template(), k: ti.template(), v, push, stored, index: ti.template(), friction):
    """Adjoints of `ground_contact` by the velocity and by `push`, from that of its result."""
    skin = ti.static(c.variant.has_skin(k))
    u, given = v, ti.Vector([stored[0], stored[1], stored[2]])
    if ti.static(skin):
        u = coulomb_friction(v + push, push, friction)
    v_adjoint = contact_adjoint(c, u, given, index, friction, ti.static(c.variant.is_tight(k)), STOP_NODES * skin)
    push_adjoint = 0.0 * v_adjoint
    if ti.static(skin):
        v_adjoint, push_adjoint = coulomb_friction_adjoint(v + push, push, v_adjoint, friction)
        push_adjoint += v_adjoint
    return v_adjoint, push_adjoint


@ti.func
def update_both(c: ti.template(), m, node, index: ti.template()):
    """Momenta of robot and medium at node m to velocities at `node`, with gravity, their contact, and the ground's."""
    found = contact_impulse(c, m, index)
    for k in ti.static(range(2)):
        mass, after = c.grid[MOMENTUM, m + k * c.nodes.size][3], ti.Vector([0.0, 0.0, 0.0, 0.0])
        if mass > 0.0:
            free = found.v
            if ti.static(k == 1):
                free = found.u
            push = pushed(c, k, m, mass)
            friction = c.scene.friction
            if ti.static(k == 1 and c.variant.slides):
                friction, _limited = most_friction(c, free, index)
            held = ground_contact(c, k, free, push, index, friction)
            after = ti.Vector([held[0], held[1], held[2], mass])
        c.grid[VELOCITY, node + k * c.nodes.size] = after


@ti.func
def update_both_adjoint(c: ti.template(), m, node, index: ti.template()):
    """Adjoint of `update_both`: the velocities' adjoints at `node` become those of momentum (0..2) and mass (3).

    Those of the neighbours' mass are added to; so are all, which is atomic where nodes are taken at once.
    """
    found = contact_impulse(c, m, index)
    q, o = c.grid[MOMENTUM, m], c.grid[MOMENTUM, m + c.nodes.size]
    stored, other = c.grid_adjoint[MOMENTUM, node], c.grid_adjoint[MOMENTUM, node + c.nodes.size]
    v_adjoint, u_adjoint = 0.0 * found.v, 0.0 * found.u
    q_mass, o_mass = 0.0 * c.dt, 0.0 * c.dt
    push_adjoint = 0.0 * found.v
    if q[3] > 0.0:
        push = pushed(c, 0, m, q[3])
        v_adjoint, push_adjoint = ground_contact_adjoint(c, 0, found.v, push, stored, index, c.scene.friction)
        push_adjoint /= q[3]  # of the impulse, from that of the change of velocity
        q_mass = 0.0 - push_adjoint.dot(push)
    if o[3] > 0.0:
        friction, limited = c.scene.friction, 0.0 * found.u
        if ti.static(c.variant.slides):
            friction, limited = most_friction(c, found.u, index)
        u_adjoint, _none = ground_contact_adjoint(c, 1, found.u, found.u, other, index, friction)
        if ti.static(c.variant.slides):
            u_adjoint += most_friction_adjoint(c, found.u, other, friction, limited, index)
    if ti.static(c.variant.skin):
        c.grid_adjoint[PUSH, node] = ti.Vector([push_adjoint[0], push_adjoint[1], push_adjoint[2], 0.0])
    if found.share > 0.0:
        # v' = v + J / q and u' = u - J / o with J = reduced change
        impulse_adjoint = v_adjoint / q[3] - u_adjoint / o[3]
        by_reduced = found.change.dot(impulse_adjoint)
        relative = free_velocity(c, q) - free_velocity(c, o)
        friction, change_adjoint = c.scene.interface_friction, found.reduced * impulse_adjoint
        by_velocity, by_slope, by_share, by_preload = contact_change_adjoint(
            relative, found.slope, found.share, found.preload, friction, change_adjoint
        )
        by_total = (by_share * found.rise + by_preload * found.strength) / found.room
        # reduced = q o / (q + o)
        q_part, o_part = found.reduced / q[3], found.reduced / o[3]
        q_mass += by_total / c.scene.robot_full
        o_mass += by_total / c.scene.medium_full
        # divided twice: in float32 the square of a mass below 1e-23 kg, of a node that a field hardly touches, is 0
        q_mass += by_reduced * q_part * q_part - v_adjoint.dot(found.impulse) / q[3] / q[3]
        o_mass += by_reduced * o_part * o_part + u_adjoint.dot(found.impulse) / o[3] / o[3]
        v_adjoint += by_velocity
        u_adjoint = u_adjoint - by_velocity
        by_slope = by_slope / c.scene.medium_full
        mass_gradient_adjoint(c, node + c.nodes.size, found.up, found.down, by_slope)
    c.grid_adjoint[MOMENTUM, node] += momentum_adjoint(q, v_adjoint, q_mass, stored)
    c.grid_adjoint[MOMENTUM, node + c.nodes.size] += momentum_adjoint(o, u_adjoint, o_mass, other)


@ti.func
def momentum_adjoint(q, v_adjoint, mass_adjoint, stored):
    """What is to be added to the `stored` adjoint of a node's velocity so that it becomes that of (momentum, mass)."""
    change = ti.Vector([0.0 - stored[0], 0.0 - stored[1], 0.0 - stored[2], mass_adjoint])
    if q[3] > 0.0:
        a = v_adjoint / q[3]
        by_mass = (a[0] * q[0] + a[1] * q[1] + a[2] * q[2]) / q[3]
        change += ti.Vector([a[0], a[1], a[2], 0.0 - by_mass])
    return change
