"""The skin of firm ground (see `model.ground_skin`): force on particles, friction at the nodes, and adjoints.

The force of the layer on a particle is scattered into a field of its own, PUSH. A node takes this impulse beside those
of the internal forces; it may then lose tangential momentum of up to friction times the same impulse, by Coulomb's law:
friction balances the forces of this very substep, so that what sticks does not creep. Constraints of nodes remain as a
hard stop, `STOP_NODES` below the ground.

Nodes at which friction acts lie up to a cell and a half above the surface. There matter that rolls is faster than at
the surface, and nearer to the axis that it turns about: friction against the nodes' own velocity, with their lever,
brakes a ball. Where a body `rolls` (see `layout.Variant`), it acts at the surface:

* Friction at a node is limited by an impulse that particles give it by another share, in the fourth lane of PUSH: their
  own spline's times the linear spline of the point of the surface below them, divided by the sum in each direction. The
  shares add up to one, so that friction has the force of Coulomb's law, and none is where the particle has no mass. On
  a plane it acts on the nodes of the plane alone, with the lever of the surface.
* On a terrain, whose nodes are above and below the surface, it is against the velocity of the matter's surface, v - s,
  with s = sum w j C (x_node - x_surface) / sum w j over the particles that feel the layer by an impulse j n, from a
  field of its own, SURFACE, and its fourth lane.

All vectors have four lanes. `place` is a particle's, from the grid's first node [m].
"""

import taichi as ti

from zoobench.sim.kernels.boundary import TERRAIN, WALL_NODES
from zoobench.sim.kernels.columns import (
    add,
    contract,
    dot,
    lanes,
    matvec,
    outer,
    scale,
    spatial,
    transposed_matvec,
    zero_lanes,
)
from zoobench.sim.kernels.context import Around
from zoobench.sim.kernels.layout import PUSH, SURFACE, VOLUME, C, X, add_columns, columns, layer
from zoobench.sim.kernels.splines import stencil, weight_derivatives, weights
from zoobench.sim.kernels.transfer import by_offset, gather_slopes, motion_adjoint, scatter, scatter_value

STOP_NODES = 2
"""Nodes between the ground and the hard stop below it. Matter between them feels the layer's linear force."""


@ti.func
def corner(cells, count):
    """The first of the two node columns about a place [cells] in one direction, kept inside the grid."""
    return ti.max(0, ti.min(ti.cast(cells, ti.i32), count - 2))


@ti.func
def ground_below(c: ti.template(), place):
    """The ground under a place: distance along its normal [m] and that distance's gradient, the normal and its
    derivatives by x and z [1/m].

    On a terrain, height and normal are interpolated bilinearly from the node columns; the distance is to first order
    in the terrain's curvature.
    """
    up = ti.Vector([0.0, 1.0, 0.0, 0.0])
    found = ti.Struct(
        gap=place[1] - WALL_NODES * c.scene.spacing, slope=up, normal=up, by_x=zero_lanes(), by_z=zero_lanes()
    )
    if ti.static(c.variant.ground == TERRAIN):
        x, y, z = place[0] * c.scene.inverse, place[1] * c.scene.inverse, place[2] * c.scene.inverse
        i, k = corner(x, c.scene.nodes_x), corner(z, c.scene.nodes_z)
        near, east, north, far = c.terrain[i, k], c.terrain[i + 1, k], c.terrain[i, k + 1], c.terrain[i + 1, k + 1]
        twist = far - north - east + near
        column = near + (x - i) * (east - near) + (z - k) * (north - near + (x - i) * twist)
        by_x, by_z = east - near + (z - k) * twist, north - near + (x - i) * twist
        above = y - column[0]
        found.gap = above * column[2] * c.scene.spacing
        found.slope = ti.Vector(
            [above * by_x[2] - column[2] * by_x[0], column[2], above * by_z[2] - column[2] * by_z[0], 0.0]
        )
        found.normal = ti.Vector([column[1], column[2], column[3], 0.0])
        found.by_x = c.scene.inverse * ti.Vector([by_x[1], by_x[2], by_x[3], 0.0])
        found.by_z = c.scene.inverse * ti.Vector([by_z[1], by_z[2], by_z[3], 0.0])
    return found


@ti.func
def edge_of(c: ti.template(), p):
    """Edge of the cubes that the particles of an elastic body stand for [m]."""
    edge = c.scene.edge
    for k in ti.static(range(c.variant.objects)):
        if p >= c.scene.first[k]:
            edge = c.scene.object_edge[k]
    return edge


@ti.func
def layer_force(gap, edge, scene: ti.template()):
    """Force per volume [N/m^3] of the layer on a cube of an edge, whose centre is at `gap` [m], and its derivative
    [N/m^4]."""
    lower = ti.max(scene.skin_thickness - gap + 0.5 * edge, 0.0)
    upper = ti.max(scene.skin_thickness - gap - 0.5 * edge, 0.0)
    slope = scene.skin_rate / edge * (lower - upper)
    return 0.5 * slope * (lower + upper), 0.0 - slope


@ti.func
def _turn(foot, held, k: ti.template()):
    """Derivative of the linear weight of node k by the place of the foot, which is `held` within the stencil."""
    found = 0.0 * held
    if foot == held and ti.abs(held - k) < 1.0:
        if held < k:
            found = found + 1.0
        elif held > k:
            found = found - 1.0
    return found


@ti.func
def foot_of(c: ti.template(), at: ti.template(), below: ti.template()):
    """The point of the surface below a particle, from the first node of its stencil [cells], and the same moved into
    it."""
    foot = at.offset - (below.gap * c.scene.inverse) * below.normal
    return foot, ti.max(0.0, ti.min(1.0 * ti.static(c.variant.width - 1), foot))


@ti.func
def foot_shares(c: ti.template(), held, share: ti.template()):
    """Shares of the nodes of a particle's stencil in the limit of friction, as weights of a spline; the linear weights
    of the point below it, and the sums of the products of both, by which they are divided."""
    near = [ti.max(0.0, 1.0 - ti.max(held - k, k - held)) for k in ti.static(range(c.variant.width))]
    total = 0.0 * held
    for k in ti.static(range(c.variant.width)):
        total += near[k] * share[k]
    return [near[k] * share[k] / total for k in ti.static(range(c.variant.width))], near, total


@ti.func
def surface_motion(c: ti.template(), p, size, below: ti.template(), offset):
    """Impulse times velocity relative to the matter's surface, its size in the fourth lane, at the first node of a
    stencil, and its slope."""
    rate = columns(c.state, c.s, c.w, p, C)
    slope = scale(size * c.scene.spacing, rate)
    origin = (size * below.gap) * matvec(rate, below.normal) + fourth(size)
    return origin - offset[0] * slope.x - offset[1] * slope.y - offset[2] * slope.z, slope


@ti.func
def push(c: ti.template(), p):
    """Scatter the layer's impulse on one particle."""
    place = c.state[c.s, c.w, p, X]
    below, edge = ground_below(c, place), edge_of(c, p)
    if below.gap < c.scene.skin_thickness + 0.5 * edge:
        force, _rate = layer_force(below.gap, edge, c.scene)
        at = stencil(place, c.scene, layer(c, p), c.variant.width)
        size = c.dt * c.body[c.w, p, 0][VOLUME] * force
        share = weights(at.offset, c.variant.width)
        near = Around(at, share)
        scatter_value(c.field(PUSH, c.start), near, size * below.normal)
        if ti.static(c.variant.rolling):
            if p >= c.scene.first[0]:
                _foot, held = foot_of(c, at, below)
                shares, _near, _total = foot_shares(c, held, share)
                scatter_value(c.field(PUSH, c.start), Around(at, shares), fourth(size))
                if ti.static(c.variant.rolling_aslant):
                    origin, slope = surface_motion(c, p, size, below, at.offset)
                    scatter(c.field(SURFACE, c.start), near, origin, slope)


@ti.func
def push_adjoint(c: ti.template(), p):
    """Adjoint of `push`: adds to those of the place, C and the volume."""
    place = c.state[c.s, c.w, p, X]
    below, edge = ground_below(c, place), edge_of(c, p)
    if below.gap < c.scene.skin_thickness + 0.5 * edge:
        force, rate = layer_force(below.gap, edge, c.scene)
        at = stencil(place, c.scene, layer(c, p), c.variant.width)
        share, slopes = weights(at.offset, c.variant.width), weight_derivatives(at.offset, c.variant.width)
        near = Around(at, share, slopes)
        size = c.dt * c.body[c.w, p, 0][VOLUME] * force
        found = gather_slopes(c.adjoint_of(PUSH), near)
        by_weights, held = by_offset(found, size * below.normal), found.total
        by_size, by_gap, by_turn = dot(below.normal, held), 0.0 * size, size * spatial(held)
        if ti.static(c.variant.rolling):
            if p >= c.scene.first[0]:
                by_own, by_foot, limited = limit_adjoint(c, size, near, below)
                by_weights += by_own + by_foot
                by_size += limited
                by_gap -= c.scene.inverse * dot(below.normal, by_foot)
                by_turn -= (c.scene.inverse * below.gap) * by_foot
                if ti.static(c.variant.rolling_aslant):
                    origin, slope = surface_motion(c, p, size, below, at.offset)
                    more, total, moments = motion_adjoint(c.adjoint_of(SURFACE), near, origin, slope)
                    gradient, upward = columns(c.state, c.s, c.w, p, C), spatial(total)
                    turned = matvec(gradient, below.normal)
                    by_weights += more
                    by_size += c.scene.spacing * contract(moments, gradient) + below.gap * dot(upward, turned)
                    by_size += total[3]
                    by_gap += size * dot(upward, turned)
                    by_turn += (size * below.gap) * transposed_matvec(gradient, upward)
                    moved = outer((size * below.gap) * upward, below.normal)
                    add_columns(c.adjoint, 0, c.w, p, C, add(scale(size * c.scene.spacing, moments), moved))
        by_gap += c.dt * c.body[c.w, p, 0][VOLUME] * rate * by_size
        by_normal = ti.Vector([dot(below.by_x, by_turn), 0.0, dot(below.by_z, by_turn), 0.0])
        c.adjoint[0, c.w, p, X] += c.scene.inverse * by_weights + by_gap * below.slope + by_normal
        c.body_adjoint[c.w, p, 0] += ti.Vector([0.0, c.dt * force * by_size, 0.0, 0.0])


@ti.func
def limit_adjoint(c: ti.template(), size, near: ti.template(), below: ti.template()):
    """Adjoint of the limit of friction that an impulse of this size gives: by the offsets of the particle and of the
    point below it, and by the size."""
    share, slopes = ti.static(near.w, near.dw)
    foot, held = foot_of(c, near.at, below)
    shares, linear, total = foot_shares(c, held, share)
    turn = [
        ti.Vector([_turn(foot[d], held[d], k) for d in ti.static(range(4))]) for k in ti.static(range(c.variant.width))
    ]
    by_place, by_foot = 0.0 * held, 0.0 * held
    for k in ti.static(range(c.variant.width)):
        by_place += linear[k] * slopes[k]
        by_foot += turn[k] * share[k]
    moved = [(linear[k] * slopes[k] - shares[k] * by_place) / total for k in ti.static(range(c.variant.width))]
    turned = [(turn[k] * share[k] - shares[k] * by_foot) / total for k in ti.static(range(c.variant.width))]
    found = gather_slopes(c.adjoint_of(PUSH), Around(near.at, shares, moved))
    below_it = gather_slopes(c.adjoint_of(PUSH), Around(near.at, shares, turned))
    return by_offset(found, fourth(size)), by_offset(below_it, fourth(size)), found.total[3]


@ti.func
def fourth(size):
    """A scalar in the fourth lane."""
    return lanes(0.0, 0.0, 0.0, size)


@ti.func
def coulomb_friction(v, a, friction):
    """Node velocity after Coulomb friction: v, in which the layer's change of velocity a is included."""
    return friction_within(v, a, friction * a.norm())


@ti.func
def friction_within(v, a, limit):
    """Node velocity v after friction that takes up to `limit` of what is normal to a."""
    size, u = a.norm(), v
    if ti.min(limit, size) > 0.0:
        normal = a / size
        along = v - v.dot(normal) * normal
        speed = along.norm()
        lost = 1.0 + 0.0 * speed
        if speed > limit:
            lost = limit / speed
        u = v - lost * along
    return u


@ti.func
def coulomb_friction_adjoint(v, a, u_adjoint, friction):
    """Adjoints of `coulomb_friction` by v and a."""
    size = a.norm()
    v_adjoint, a_adjoint, by_limit = friction_within_adjoint(v, a, u_adjoint, friction * size)
    if size > 0.0:
        a_adjoint += (friction * by_limit) * (a / size)
    return v_adjoint, a_adjoint


@ti.func
def friction_within_adjoint(v, a, u_adjoint, limit):
    """Adjoints of `friction_within` by v, by a's direction and by the limit."""
    size = a.norm()
    v_adjoint, a_adjoint, by_limit = u_adjoint, 0.0 * u_adjoint, 0.0 * size
    if ti.min(limit, size) > 0.0:
        normal = a / size
        approach = v.dot(normal)
        along = v - approach * normal
        speed = along.norm()
        # the velocity lost is all of `along`, or limit along / |along|
        along_adjoint = 0.0 * u_adjoint - u_adjoint
        if speed > limit:
            lost, work = limit / speed, along.dot(u_adjoint) / speed
            along_adjoint = (lost * work / speed) * along - lost * u_adjoint
            by_limit = 0.0 - work
        # along = v - (v . n) n, and n = a / |a|
        into = along_adjoint.dot(normal)
        v_adjoint = u_adjoint + along_adjoint - into * normal
        turn = 0.0 * v - into * v - approach * along_adjoint
        a_adjoint = (turn - turn.dot(normal) * normal) / size
    return v_adjoint, a_adjoint, by_limit
