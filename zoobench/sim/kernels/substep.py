"""One particle's or one node's part of a substep; the drivers `serial` and `parallel` loop over these.

A substep is symplectic Euler in MLS-MPM (Hu et al. 2018): scatter mass, momentum and stress, update the nodes'
velocity with gravity and contact, gather, move, deform.

`c` is the `context.Context` of a substep, `p` the particle. Code that its variant does not call for is not compiled.
"""

import taichi as ti

from zoobench.sim.kernels.anchors import driven_velocity, is_driven, scattered_velocity, unless_held
from zoobench.sim.kernels.boundary import behind_wall, wall_pressure
from zoobench.sim.kernels.columns import (
    add,
    diagonal,
    matmul,
    scale,
    spatial,
    zero_lanes,
)
from zoobench.sim.kernels.context import Around
from zoobench.sim.kernels.drift import mean_ratio, scatter_ratio
from zoobench.sim.kernels.elastic import fibre_stress, neo_hookean, viscous
from zoobench.sim.kernels.fbar import mean_rate, scatter_rate
from zoobench.sim.kernels.flip import FLIP_SHARE, kept_affine
from zoobench.sim.kernels.lane_scatter import is_first, spread
from zoobench.sim.kernels.laws.media import deform_medium, medium_stress
from zoobench.sim.kernels.laws.water import correction_share, density_factor, free_fraction
from zoobench.sim.kernels.layout import (
    BEFORE,
    MASS,
    MOMENTUM,
    PUSH,
    RATIO,
    STIFFNESS,
    SURFACE,
    TENSION,
    VELOCITY,
    VOLUME,
    C,
    F,
    V,
    X,
    columns,
    history,
    layer,
    put_columns,
)
from zoobench.sim.kernels.shifting import particle_shift
from zoobench.sim.kernels.splines import INVERSE_MOMENT, first_node, stencil, weights
from zoobench.sim.kernels.transfer import (
    AFLIP,
    PIC,
    gather_affine,
)
from zoobench.sim.kernels.velocity_fields import ground_contact, update_fields


@ti.func
def is_robot(c: ti.template(), p):
    """True for a particle of the robot; known at compile time where all particles are, or none is."""
    if ti.static(not c.variant.has_medium or not c.variant.robot):
        return c.variant.robot
    return p < c.scene.robot


@ti.func
def has_transfer(c: ti.template(), p, transfer: ti.template()):
    """True for a particle with this transfer; known at compile time where all matter has the same or there is one."""
    if ti.static(not c.variant.robot):
        return c.variant.medium_transfer == transfer
    if ti.static(not c.variant.has_medium or c.variant.transfer == c.variant.medium_transfer):
        return c.variant.transfer == transfer
    if ti.static(c.variant.transfer == transfer):
        return p < c.scene.robot
    if ti.static(c.variant.medium_transfer == transfer):
        return p >= c.scene.robot
    return False


@ti.func
def clear_node(grid: ti.template(), node, variant: ti.template()):
    """Zero the fields that particles are scattered into."""
    grid[MOMENTUM, node] = zero_lanes()
    if ti.static(variant.uses(AFLIP)):
        grid[BEFORE, node] = zero_lanes()
    if ti.static(variant.skin):
        grid[PUSH, node] = zero_lanes()
    if ti.static(variant.rolling_aslant):
        grid[SURFACE, node] = zero_lanes()
    if ti.static(variant.ratio):
        grid[RATIO, node] = zero_lanes()


@ti.func
def moduli(c: ti.template(), p):
    """Lame parameters and viscosity of an elastic particle's body."""
    mu, lam, eta = c.scene.mu, c.scene.lam, c.scene.eta
    for k in ti.static(range(c.variant.objects)):
        if p >= c.scene.first[k]:
            mu, lam, eta = c.scene.object_mu[k], c.scene.object_lam[k], c.scene.object_eta[k]
    return mu, lam, eta


@ti.func
def particle_stress(c: ti.template(), p):
    """Kirchhoff stress [Pa] of a particle at slot s; that of a solid medium was stored with its plastic return."""
    stress = diagonal(0.0 * c.scene.spacing)
    if ti.static(not c.variant.robot):
        stress = medium_stress(c, p)
    elif is_robot(c, p):
        deformation, q = columns(c.state, c.s, c.w, p, F), c.body[c.w, p, 0]
        mu, lam, eta = moduli(c, p)
        stress = scale(q[STIFFNESS], neo_hookean(deformation, mu, lam))
        if ti.static(c.variant.muscle):
            stress = add(stress, fibre_stress(deformation, q[TENSION], c.body[c.w, p, 1]))
        if ti.static(c.variant.damping):
            stress = add(stress, viscous(columns(c.state, c.s, c.w, p, C), eta))
    elif ti.static(c.variant.has_medium):
        stress = medium_stress(c, p)
    return stress


@ti.func
def at_first_node(momentum, mass, slope: ti.template(), offset):
    """Momentum and mass at the first node of a stencil, from those at a particle's offset and the slopes."""
    origin = ti.Vector([momentum[0], momentum[1], momentum[2], mass])
    return origin - offset[0] * slope.x - offset[1] * slope.y - offset[2] * slope.z


@ti.func
def linear_motion(c: ti.template(), p, mass, at: ti.template()):
    """Momentum and mass at the first node of a particle's stencil by its own affine motion, and the slopes."""
    slope = scale(mass * c.scene.spacing, columns(c.state, c.s, c.w, p, C))
    return at_first_node(mass * c.state[c.s, c.w, p, V], mass, slope, at.offset), slope


@ti.func
def contribution(c: ti.template(), p):
    """What a particle adds to its stencil: momentum and mass at the first node and their slopes."""
    at = stencil(c.state[c.s, c.w, p, X], c.scene, layer(c, p), c.variant.width)
    q = c.body[c.w, p, 0]
    m = q[MASS]
    # momentum of the internal forces, -dt V0 tau M^-1 (x_i - x_p) w (Hu et al. 2018, eq. 18); with Kirchhoff stress it
    # is the rest volume, as V sigma = V0 tau
    factor = -ti.static(INVERSE_MOMENT[c.variant.width]) * c.dt * c.scene.inverse * q[VOLUME]
    slope = scale(factor, particle_stress(c, p))
    if not has_transfer(c, p, PIC):
        slope = add(slope, scale(m * c.scene.spacing, columns(c.state, c.s, c.w, p, C)))
    origin = at_first_node(m * scattered_velocity(c, p), m, slope, at.offset)
    return ti.Struct(node=at.node, offset=at.offset, origin=origin, slope=slope)


@ti.func
def no_contribution(dt):
    """A `contribution` of nothing."""
    zero = zero_lanes()
    return ti.Struct(node=0, offset=zero, origin=zero, slope=diagonal(0.0 * dt))


@ti.func
def to_grid(c: ti.template(), p, given: ti.template(), lane: ti.template()):
    """Scatter one particle's `contribution`, or where `lane` is not None that of it, and with the first what has no
    lanes."""
    share = weights(given.offset, c.variant.width)
    at = Around(given, share)
    spread(c.field(MOMENTUM, c.start), at, given.origin, given.slope, lane)
    if ti.static(c.variant.uses(AFLIP)):
        if has_transfer(c, p, AFLIP):
            origin, motion = linear_motion(c, p, c.body[c.w, p, 0][MASS], given)
            spread(c.field(BEFORE, c.start), at, origin, motion, lane)
    if ti.static(c.variant.liquid):
        if p >= c.scene.robot and is_first(lane):
            scatter_ratio(c.field(RATIO, c.start), at, history(c.state, c.s, c.w, p), c.body[c.w, p, 0][MASS])
    if ti.static(c.variant.fbar):
        if p >= c.scene.robot and is_first(lane):
            scatter_rate(c, p)


@ti.func
def update_node(c: ti.template(), m, node, index: ti.template()):
    """Momentum at node m to velocity at `node`, `index` of the whole grid, with gravity and contact."""
    q = c.grid[MOMENTUM, m]
    after = ti.Vector([0.0, 0.0, 0.0, 0.0])
    if q[3] > 0.0:
        r = 1.0 / q[3]
        free = ti.Vector([q[0] * r + c.dt * c.scene.g_x, q[1] * r + c.dt * c.scene.g_y, q[2] * r + c.dt * c.scene.g_z])
        push, none = 0.0 * free, 0.0 * q[3]
        if ti.static(c.variant.skin):
            push = ti.Vector([r * c.grid[PUSH, m][0], r * c.grid[PUSH, m][1], r * c.grid[PUSH, m][2]])
        v = unless_held(c, 0, index, ground_contact(c, 0, free, (push, push, none), index, c.scene.friction))
        after = ti.Vector([v[0], v[1], v[2], q[3]])
    c.grid[VELOCITY, node] = after


@ti.func
def update_at(c: ti.template(), node, index: ti.template()):
    """`update_node`, or `velocity_fields.update_fields`, of a node that comes so many after the first."""
    if ti.static(c.variant.layers > 1):
        update_fields(c, c.start + node, node, index)
    else:
        update_node(c, c.start + node, node, index)


@ti.func
def mirror_image(c: ti.template(), node, index: ti.template(), d: ti.template()):
    """The normal of the wall before `node` in direction d, 0 if there is none, and the node's mirror image before it.

    The image is -1 if it lies outside the window, where there is no matter.
    """
    count, stride = (c.scene.nodes_x, c.scene.nodes_y, c.scene.nodes_z)[d], (c.nodes.sx, c.nodes.sy, 1)[d]
    normal = behind_wall(index[d], count, d, c.variant.ground)
    image, there = node + 2 * normal * stride, index[d] + 2 * normal
    if there < c.window[c.window_slot, c.w, d] or there >= c.window[c.window_slot, c.w, 3 + d]:
        image = -1
    return normal, image


@ti.func
def press_node(c: ti.template(), node, index: ti.template()):
    """Pressure of tight walls on a node behind them and on its mirror image before them, after `update_node`."""
    for d in ti.static(range(3)):
        press_along(c, node, index, d)


@ti.func
def press_along(c: ti.template(), node, index: ti.template(), d: ti.template()):
    """`press_node` by the walls of one direction, whose pairs of nodes have none in common."""
    normal, image = mirror_image(c, node, index, d)
    if normal != 0 and c.grid[VELOCITY, node][3] > 0.0:
        here = c.grid[VELOCITY, node]
        there = 0.0 * here
        if image >= 0:
            there = c.grid[VELOCITY, image]
        behind, before = wall_pressure(normal * here[d], normal * there[d], here[3], there[3])
        here[d] = normal * behind
        c.grid[VELOCITY, node] = here
        if image >= 0:
            there[d] = normal * before
            c.grid[VELOCITY, image] = there


@ti.func
def from_grid(c: ti.template(), p, at: ti.template()):
    """Gather, move and deform one particle with stencil `at`; returns the first node of its new stencil.

    F is updated at the end of the substep with the new C: the other order puts F one step ahead of x.
    """
    width = ti.static(c.variant.width)
    share = weights(at.offset, width)
    near = Around(at, share)
    total, rate = gather_affine(c.field(VELOCITY), near, c.scene.inverse)
    velocity = spatial(total)
    rho, mean, place = 0.0 * c.dt, 0.0 * c.dt, c.state[c.s, c.w, p, X] + c.dt * velocity
    affine, change = rate, scale(c.dt, rate)
    if ti.static(c.variant.fbar):
        if p >= c.scene.robot:
            around, own = mean_rate(c, p)
            change = add(change, diagonal(c.dt / 3.0 * (around - own)))
    if ti.static(c.variant.liquid):
        if p >= c.scene.robot:
            # slots s and t may be the same: all is read before anything is written
            J = history(c.state, c.s, c.w, p)
            rho = total[3] * density_factor(free_fraction(near, c.scene, width), c.scene)
            mean = mean_ratio(c.field(RATIO, c.start), near, J)
            correction = correction_share(c.scene.inverse, c.dt, c.scene.medium)
            place += particle_shift(c, near, J, rho, correction)
    if ti.static(c.variant.uses(AFLIP)):
        if has_transfer(c, p, AFLIP):
            before, affine_before = gather_affine(c.field(BEFORE, c.start), near, c.scene.inverse)
            velocity += FLIP_SHARE * (c.state[c.s, c.w, p, V] - spatial(before))
            affine = add(rate, kept_affine(columns(c.state, c.s, c.w, p, C), affine_before, rate, c.dt))
    if ti.static(c.variant.driven):
        if is_driven(c, p):
            velocity, affine, change = driven_velocity(c, p), scale(0.0, rate), scale(0.0, rate)
            place = c.state[c.s, c.w, p, X] + c.dt * velocity
    c.state[c.t, c.w, p, X] = place
    c.state[c.t, c.w, p, V] = velocity
    put_columns(c.state, c.t, c.w, p, C, affine)
    if is_robot(c, p):
        deformation = columns(c.state, c.s, c.w, p, F)
        put_columns(c.state, c.t, c.w, p, F, add(deformation, matmul(change, deformation)))
    elif ti.static(c.variant.has_medium):
        deform_medium(c, p, add(diagonal(1.0 + 0.0 * c.dt), change), rho, mean)
    cells = place * c.scene.inverse
    return (
        first_node(cells[0], c.scene.nodes_x, width),
        first_node(cells[1], c.scene.nodes_y, width),
        first_node(cells[2], c.scene.nodes_z, width),
    )
