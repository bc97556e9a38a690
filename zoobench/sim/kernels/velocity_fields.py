"""Bodies in velocity fields of their own, which meet at the nodes that they fill together; and the adjoint.

Every node is there once for each of them (`layer`): the robot's first, then those of objects, the medium's last;
particles see those of their own field alone. Objects that share one stick to each other where they meet. At a node
where the volume shares of two bodies add up to nearly one, an inelastic impulse keeps them from moving into each other,
with Coulomb friction (Bardenhagen, Brackbill and Sulsky 2000). Where they add up to less, there is a gap, which a node
by itself does not show: the splines of both reach over it by up to a cell. The impulse is equal and opposite, and never
adds energy. Solid bodies carry a slow one whole, see `PRELOAD`. Where three bodies meet, they do so pair by pair in a
fixed order. For the normal see `contact_normal`.
"""

from typing import Any

import taichi as ti

from zoobench.sim.kernels.anchors import heaviness_at, unless_held
from zoobench.sim.kernels.boundary import contact, contact_adjoint
from zoobench.sim.kernels.contact_normal import (
    FLAT,
    beside,
    contact_slope,
    contact_slope_adjoint,
    filling_mass,
    is_overfull,
    mass_of_full_node,
)
from zoobench.sim.kernels.layout import MOMENTUM, PUSH, SURFACE, VELOCITY, while_compiling
from zoobench.sim.kernels.mud_wall import most_friction, most_friction_adjoint
from zoobench.sim.kernels.room import free_volumes
from zoobench.sim.kernels.skin_contact import (
    STOP_NODES,
    coulomb_friction,
    coulomb_friction_adjoint,
    friction_within,
    friction_within_adjoint,
)

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
def friction_between(c: ti.template(), pair: ti.template()):
    """Coulomb coefficient of a pair of layers."""
    friction = c.scene.interface_friction
    if ti.static(c.variant.objects > 0):
        friction = c.scene.pair_friction[pair]
    return friction


@ti.func
def contact_impulse(c: ti.template(), pair: ti.template(), m, index: ti.template(), v, u):
    """Velocities of two bodies at a node after their contact, from those before, the impulse from the second to the
    first, and what the impulse is made of; m is the node of the first layer."""
    a, b = ti.static(c.variant.pairs[pair])
    q, o = c.grid[MOMENTUM, m + a * c.nodes.size], c.grid[MOMENTUM, m + b * c.nodes.size]
    relative, first, second = v - u, v, u
    share, rise, reduced, preload, strength = 0.0 * c.dt, 0.0 * c.dt, 0.0 * c.dt, 0.0 * c.dt, 0.0 * c.dt
    slope, change, impulse = 0.0 * v, 0.0 * v, 0.0 * v
    room, up, down = 1.0 + 0.0 * c.dt, 0.0 * v, 0.0 * v
    heavy, other_heavy = heaviness_at(c, a, index), heaviness_at(c, b, index)
    if q[3] > 0.0 and o[3] > 0.0:
        rooms = free_volumes(c, index)
        room = rooms[0] * rooms[1] * rooms[2]
        first_mass = filling_mass(c, a, m + a * c.nodes.size)
        total = (first_mass / mass_of_full_node(c, a) + o[3] / mass_of_full_node(c, b)) / room
        share, rise = contact_fraction(total)
        if share > 0.0:
            if ti.static(not (c.variant.liquid and c.variant.is_medium(b))):
                strength = c.dt * PRELOAD * c.scene.inverse / (CONTACT_WHOLE - CONTACT_FROM)
                preload = strength * (total - CONTACT_FROM)
            up, down = beside(c, index, rooms)
            slope = contact_slope(c, pair, m, ti.Struct(up=up, down=down, room=room))
            change = contact_change(relative, slope, share, preload, friction_between(c, pair))
            mass, other = heavy * q[3], other_heavy * o[3]
            reduced = mass * other / (mass + other)
            impulse = reduced * change
            first += impulse / mass
            second += (-1.0 / other) * impulse
    return ti.Struct(
        v=first, u=second, relative=relative, share=share, rise=rise, preload=preload, strength=strength,
        reduced=reduced, slope=slope, change=change, impulse=impulse, room=room, up=up, down=down, heavy=heavy,
        other_heavy=other_heavy,
    )  # fmt: skip


@ti.func
def contact_impulse_adjoint(
    c: ti.template(), pair: ti.template(), m, node, found: ti.template(), v_adjoint, u_adjoint
):  # fmt: skip
    """Adjoint of `contact_impulse`, which found `found`: those of the velocities before it and of both masses."""
    a, b = ti.static(c.variant.pairs[pair])
    q, o = c.grid[MOMENTUM, m + a * c.nodes.size], c.grid[MOMENTUM, m + b * c.nodes.size]
    before, other, of_first, of_second = v_adjoint, u_adjoint, 0.0 * c.dt, 0.0 * c.dt
    by_mass, by_other_mass = 0.0 * c.dt, 0.0 * c.dt
    if found.share > 0.0:
        mass, other_mass = found.heavy * q[3], found.other_heavy * o[3]
        # v' = v + J / q and u' = u - J / o with J = reduced change
        impulse_adjoint = v_adjoint / mass - u_adjoint / other_mass
        by_reduced = found.change.dot(impulse_adjoint)
        by_velocity, by_slope, by_share, by_preload = contact_change_adjoint(
            found.relative, found.slope, found.share, found.preload, friction_between(c, pair),
            found.reduced * impulse_adjoint,
        )  # fmt: skip
        by_total = (by_share * found.rise + by_preload * found.strength) / found.room
        # reduced = q o / (q + o)
        q_part, o_part = found.reduced / mass, found.reduced / other_mass
        of_second = by_total / mass_of_full_node(c, b)
        if not is_overfull(c, a, m + a * c.nodes.size):
            of_first = by_total / mass_of_full_node(c, a)
        # divided twice: in float32 the square of a mass below 1e-23 kg, of a node that a field hardly touches, is 0
        by_mass = found.heavy * (by_reduced * q_part * q_part - v_adjoint.dot(found.impulse) / mass / mass)
        of_other = by_reduced * o_part * o_part + u_adjoint.dot(found.impulse) / other_mass / other_mass
        by_other_mass = found.other_heavy * of_other
        before = v_adjoint + by_velocity
        other = u_adjoint - by_velocity
        more, more_other = contact_slope_adjoint(c, pair, m, node, found, by_slope)
        by_mass += more
        by_other_mass += more_other
    return ti.Struct(
        v=before, u=other, q_total=of_first, o_total=of_second, q_mass=by_mass, o_mass=by_other_mass
    )  # fmt: skip


@while_compiling
def keep(kept: list[Any], found: Any) -> None:
    """Note what a contact has found."""
    kept.append(found)


@ti.func
def velocities_before_ground(c: ti.template(), m, index: ti.template()):
    """Velocities of all layers at a node after gravity and their contacts, and what each contact found."""
    velocities = [
        unless_held(c, k, index, free_velocity(c, c.grid[MOMENTUM, m + k * c.nodes.size]))
        for k in ti.static(range(c.variant.layers))
    ]
    contacts = []  # type: ignore[var-annotated]  # kernels have no annotations of variables
    for pair in ti.static(range(len(c.variant.pairs))):
        a, b = ti.static(c.variant.pairs[pair])
        found = contact_impulse(c, pair, m, index, velocities[a], velocities[b])
        velocities[a] = found.v
        velocities[b] = found.u
        keep(contacts, found)
    return velocities, contacts


@ti.func
def pushed(c: ti.template(), k: ti.template(), m, mass):
    """Change of velocity by the ground's skin at node m of layer k and of this mass, none without a skin; where it
    rolls, the velocity of the matter relative to that of its surface, and the limit of friction for a coefficient of
    one [m/s]."""
    push, slide, limit = ti.Vector([0.0 * mass, 0.0, 0.0]), ti.Vector([0.0 * mass, 0.0, 0.0]), 0.0 * mass
    if ti.static(c.variant.has_skin(k)):
        push = ti.Vector([c.grid[PUSH, m][0], c.grid[PUSH, m][1], c.grid[PUSH, m][2]]) / mass
    if ti.static(c.variant.rolls(k)):
        limit = c.grid[PUSH, m][3] / mass
        if ti.static(c.variant.rolling_aslant):
            size = c.grid[SURFACE, m][3]
            if size > 0.0:
                slide = ti.Vector([c.grid[SURFACE, m][0], c.grid[SURFACE, m][1], c.grid[SURFACE, m][2]]) / size
    return push, slide, limit


@ti.func
def pushed_adjoint(c: ti.template(), k: ti.template(), m, mass, by_given: ti.template()):
    """Adjoint of `pushed` by the rows of PUSH and SURFACE and by the mass."""
    push, slide, limit = pushed(c, k, m, mass)
    by_impulse, by_limit = by_given[0] / mass, by_given[2] / mass  # from those of changes of velocity
    by_mass = 0.0 - by_impulse.dot(push) - by_limit * limit
    by_surface = ti.Vector([0.0 * mass, 0.0, 0.0, 0.0])
    if ti.static(c.variant.rolls(k) and c.variant.rolling_aslant):
        size = c.grid[SURFACE, m][3]
        if size > 0.0:
            by = by_given[1] / size
            by_surface = ti.Vector([by[0], by[1], by[2], 0.0 - slide.dot(by)])
    return ti.Vector([by_impulse[0], by_impulse[1], by_impulse[2], by_limit]), by_surface, by_mass


@ti.func
def rubbed(c: ti.template(), k: ti.template(), v, given: ti.template(), friction):
    """Velocity of a node of layer k after what the ground's skin gives and takes; `given` is what `pushed` found."""
    u = v
    if ti.static(c.variant.rolls(k)):
        u = friction_within(v + given[0] - given[1], given[0], friction * given[2]) + given[1]
    elif ti.static(c.variant.has_skin(k)):
        u = coulomb_friction(v + given[0], given[0], friction)
    return u


@ti.func
def ground_contact(c: ti.template(), k: ti.template(), v, given: ti.template(), index: ti.template(), friction):
    """Velocity of a node of layer k after the ground: a wall, or a skin above a wall further down; `given` is what
    `pushed` found."""
    stop = ti.static(STOP_NODES * c.variant.has_skin(k))
    return contact(c, rubbed(c, k, v, given, friction), index, friction, ti.static(c.variant.is_tight(k)), stop)


@ti.func
def ground_contact_adjoint(
    c: ti.template(), k: ti.template(), v, given: ti.template(), stored, index: ti.template(), friction
):  # fmt: skip
    """Adjoints of `ground_contact` by the velocity and by all of `given`, from that of its result."""
    u = rubbed(c, k, v, given, friction)
    row = ti.Vector([stored[0], stored[1], stored[2]])
    stop = ti.static(STOP_NODES * c.variant.has_skin(k))
    by_v = contact_adjoint(c, u, row, index, friction, ti.static(c.variant.is_tight(k)), stop)
    by_push, by_slide, by_limit = 0.0 * by_v, 0.0 * by_v, 0.0 * by_v[0]
    if ti.static(c.variant.rolls(k)):
        by_slide = by_v
        before, limit = v + given[0] - given[1], friction * given[2]
        by_v, by_push, by_limit = friction_within_adjoint(before, given[0], by_v, limit)
        by_slide -= by_v
        by_push += by_v
        by_limit *= friction
    elif ti.static(c.variant.has_skin(k)):
        by_v, by_push = coulomb_friction_adjoint(v + given[0], given[0], by_v, friction)
        by_push += by_v
    return by_v, (by_push, by_slide, by_limit)


@ti.func
def ground_friction(c: ti.template(), k: ti.template(), v, index: ti.template()):
    """Friction coefficient between ground and the body of layer k at a node of velocity v, and the ground's normal
    where the strength of mud is what limits it, else zero."""
    friction, limited = c.scene.friction, 0.0 * v
    if ti.static(c.variant.slides and c.variant.is_medium(k)):
        friction, limited = most_friction(c, v, index)
    elif ti.static(0 < k <= c.variant.objects):
        friction = c.scene.object_friction[k - 1]
    return friction, limited


@ti.func
def update_fields(c: ti.template(), m, node, index: ti.template()):
    """Momenta of all layers at node m to velocities at `node`, with gravity, their contacts, and the ground's."""
    velocities, _contacts = velocities_before_ground(c, m, index)
    for k in ti.static(range(c.variant.layers)):
        mass, after = c.grid[MOMENTUM, m + k * c.nodes.size][3], ti.Vector([0.0, 0.0, 0.0, 0.0])
        if mass > 0.0:
            given = pushed(c, k, m + k * c.nodes.size, mass)
            friction, _limited = ground_friction(c, k, velocities[k], index)
            v = unless_held(c, k, index, ground_contact(c, k, velocities[k], given, index, friction))
            after = ti.Vector([v[0], v[1], v[2], mass])
        c.grid[VELOCITY, node + k * c.nodes.size] = after


@ti.func
def update_fields_adjoint(c: ti.template(), m, node, index: ti.template()):
    """Adjoint of `update_fields`: the velocities' adjoints at `node` become those of momentum (0..2) and mass (3).

    Those of the neighbours' mass are added to; so are all, which is atomic where nodes are taken at once.
    """
    count = ti.static(c.variant.layers)
    velocities, contacts = velocities_before_ground(c, m, index)
    rows = [c.grid[MOMENTUM, m + k * c.nodes.size] for k in ti.static(range(count))]
    stored = [c.grid_adjoint[MOMENTUM, node + k * c.nodes.size] for k in ti.static(range(count))]
    by_velocity = [unless_held(c, k, index, stored[k]) for k in ti.static(range(count))]
    adjoints = [0.0 * velocities[0] for _ in ti.static(range(count))]
    masses = [0.0 * c.dt for _ in ti.static(range(count))]
    for k in ti.static(range(count)):
        by_impulse, by_surface = ti.Vector([0.0 * c.dt, 0.0, 0.0, 0.0]), ti.Vector([0.0 * c.dt, 0.0, 0.0, 0.0])
        if rows[k][3] > 0.0:
            given = pushed(c, k, m + k * c.nodes.size, rows[k][3])
            friction, limited = ground_friction(c, k, velocities[k], index)
            adjoints[k], by_given = ground_contact_adjoint(c, k, velocities[k], given, by_velocity[k], index, friction)
            if ti.static(c.variant.has_skin(k)):
                by_impulse, by_surface, masses[k] = pushed_adjoint(c, k, m + k * c.nodes.size, rows[k][3], by_given)
            if ti.static(c.variant.slides and c.variant.is_medium(k)):
                adjoints[k] += most_friction_adjoint(c, velocities[k], by_velocity[k], friction, limited, index)
        if ti.static(c.variant.has_skin(k)):
            c.grid_adjoint[PUSH, node + k * c.nodes.size] = by_impulse
        if ti.static(c.variant.rolls(k) and c.variant.rolling_aslant):
            c.grid_adjoint[SURFACE, node + k * c.nodes.size] = by_surface
    for back in ti.static(range(len(c.variant.pairs))):
        pair = ti.static(len(c.variant.pairs) - 1 - back)
        a, b = ti.static(c.variant.pairs[pair])
        found = contact_impulse_adjoint(c, pair, m, node, contacts[pair], adjoints[a], adjoints[b])
        adjoints[a] = found.v
        adjoints[b] = found.u
        masses[a] += found.q_total
        masses[b] += found.o_total
        masses[a] += found.q_mass
        masses[b] += found.o_mass
    for k in ti.static(range(count)):
        change = momentum_adjoint(rows[k], unless_held(c, k, index, adjoints[k]), masses[k], stored[k])
        c.grid_adjoint[MOMENTUM, node + k * c.nodes.size] += change


@ti.func
def momentum_adjoint(q, v_adjoint, mass_adjoint, stored):
    """What is to be added to the `stored` adjoint of a node's velocity so that it becomes that of (momentum, mass)."""
    change = ti.Vector([0.0 - stored[0], 0.0 - stored[1], 0.0 - stored[2], mass_adjoint])
    if q[3] > 0.0:
        a = v_adjoint / q[3]
        by_mass = (a[0] * q[0] + a[1] * q[1] + a[2] * q[2]) / q[3]
        change += ti.Vector([a[0], a[1], a[2], 0.0 - by_mass])
    return change
