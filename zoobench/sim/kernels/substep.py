"""One particle's or one node's part of a substep; the drivers `serial` and `parallel` loop over these.

A substep is symplectic Euler in MLS-MPM (Hu et al. 2018): scatter mass, momentum and stress, update the nodes'
velocity with gravity and contact, gather, move, deform.

Arrays are those of `layout`. `s` is the slot read, `t` the slot written, `w` the world, `p` the particle; `scene` holds
the constants by name and `nodes` the box of nodes. `start` is the first node of the momenta; velocities and adjoints
begin with the grid. Code that `variant` does not call for is not compiled.
"""

import taichi as ti

from zoobench.sim.kernels.boundary import behind_wall, contact, press
from zoobench.sim.kernels.columns import (
    add,
    diagonal,
    matmul,
    scale,
    spatial,
    zero_lanes,
)
from zoobench.sim.kernels.drift import mean_ratio, scatter_ratio
from zoobench.sim.kernels.elastic import fibre_stress, neo_hookean, viscous
from zoobench.sim.kernels.fbar import mean_rate, scatter_rate
from zoobench.sim.kernels.flip import FLIP_SHARE, kept_affine
from zoobench.sim.kernels.laws.media import deform_medium, medium_stress
from zoobench.sim.kernels.laws.water import correction_share, density_factor, room
from zoobench.sim.kernels.layout import (
    BEFORE,
    MASS,
    MOMENTUM,
    PUSH,
    RATIO,
    STIFFNESS,
    TENSION,
    VELOCITY,
    VOLUME,
    C,
    F,
    V,
    X,
    columns,
    history,
    put_columns,
)
from zoobench.sim.kernels.shifting import particle_shift
from zoobench.sim.kernels.skin_contact import STOP_NODES, rub
from zoobench.sim.kernels.splines import INVERSE_MOMENT, first_node, stencil, weights
from zoobench.sim.kernels.transfer import (
    AFLIP,
    PIC,
    gather_affine,
    scatter,
)
from zoobench.sim.kernels.two_fields import layer


@ti.func
def is_robot(scene: ti.template(), p, variant: ti.template()):
    """True for a particle of the robot; known at compile time where all particles are, or none is."""
    if ti.static(not variant.has_medium or not variant.robot):
        return variant.robot
    return p < scene.robot


@ti.func
def has_transfer(scene: ti.template(), p, variant: ti.template(), transfer: ti.template()):
    """True for a particle with this transfer; known at compile time where all matter has the same or there is one."""
    if ti.static(not variant.robot):
        return variant.medium_transfer == transfer
    if ti.static(not variant.has_medium or variant.transfer == variant.medium_transfer):
        return variant.transfer == transfer
    if ti.static(variant.transfer == transfer):
        return p < scene.robot
    if ti.static(variant.medium_transfer == transfer):
        return p >= scene.robot
    return False


@ti.func
def clear_node(grid: ti.template(), node, variant: ti.template()):
    """Zero the fields that particles are scattered into."""
    grid[MOMENTUM, node] = zero_lanes()
    if ti.static(variant.uses(AFLIP)):
        grid[BEFORE, node] = zero_lanes()
    if ti.static(variant.skin):
        grid[PUSH, node] = zero_lanes()
    if ti.static(variant.ratio):
        grid[RATIO, node] = zero_lanes()


@ti.func
def particle_stress(state: ti.template(), body: ti.template(), scene: ti.template(), s, w, p, variant: ti.template()):
    """Kirchhoff stress [Pa] of a particle at slot s; that of a solid medium was stored with its plastic return."""
    stress = diagonal(0.0 * scene.spacing)
    if ti.static(not variant.robot):
        stress = medium_stress(state, s, w, p, scene.medium, variant.law)
    elif is_robot(scene, p, variant):
        deformation, q = columns(state, s, w, p, F), body[w, p, 0]
        stress = scale(q[STIFFNESS], neo_hookean(deformation, scene.mu, scene.lam))
        if ti.static(variant.muscle):
            stress = add(stress, fibre_stress(deformation, q[TENSION], body[w, p, 1]))
        if ti.static(variant.damping):
            stress = add(stress, viscous(columns(state, s, w, p, C), scene.eta))
    elif ti.static(variant.has_medium):
        stress = medium_stress(state, s, w, p, scene.medium, variant.law)
    return stress


@ti.func
def at_first_node(momentum, mass, slope: ti.template(), offset):
    """Momentum and mass at the first node of a stencil, from those at a particle's offset and the slopes."""
    origin = ti.Vector([momentum[0], momentum[1], momentum[2], mass])
    return origin - offset[0] * slope.x - offset[1] * slope.y - offset[2] * slope.z


@ti.func
def linear_motion(state: ti.template(), scene: ti.template(), s, w, p, mass, at: ti.template()):
    """Momentum and mass at the first node of a particle's stencil by its own affine motion, and the slopes."""
    slope = scale(mass * scene.spacing, columns(state, s, w, p, C))
    return at_first_node(mass * state[s, w, p, V], mass, slope, at.offset), slope


@ti.func
def contribution(
    state: ti.template(), body: ti.template(), nodes: ti.template(), scene: ti.template(), dt, s, w, p,
    variant: ti.template(),
):  # fmt: skip
    """What a particle adds to its stencil: momentum and mass at the first node and their slopes."""
    at = stencil(state[s, w, p, X], scene, layer(nodes, scene, p, variant), variant.width)
    q = body[w, p, 0]
    m = q[MASS]
    # momentum of the internal forces, -dt V0 tau M^-1 (x_i - x_p) w (Hu et al. 2018, eq. 18); with Kirchhoff stress it
    # is the rest volume, as V sigma = V0 tau
    factor = -ti.static(INVERSE_MOMENT[variant.width]) * dt * scene.inverse * q[VOLUME]
    slope = scale(factor, particle_stress(state, body, scene, s, w, p, variant))
    if not has_transfer(scene, p, variant, PIC):
        slope = add(slope, scale(m * scene.spacing, columns(state, s, w, p, C)))
    origin = at_first_node(m * state[s, w, p, V], m, slope, at.offset)
    return ti.Struct(node=at.node, offset=at.offset, origin=origin, slope=slope)


@ti.func
def no_contribution(dt):
    """A `contribution` of nothing."""
    zero = zero_lanes()
    return ti.Struct(node=0, offset=zero, origin=zero, slope=diagonal(0.0 * dt))


@ti.func
def to_grid(
    state: ti.template(), body: ti.template(), grid: ti.template(), start, nodes: ti.template(), scene: ti.template(),
    s, w, p, given: ti.template(), variant: ti.template(),
):  # fmt: skip
    """Scatter one particle's `contribution`."""
    share = weights(given.offset, variant.width)
    scatter(grid, MOMENTUM, start, nodes, given.node, share, given.origin, given.slope, variant.width)
    if ti.static(variant.uses(AFLIP)):
        if has_transfer(scene, p, variant, AFLIP):
            origin, motion = linear_motion(state, scene, s, w, p, body[w, p, 0][MASS], given)
            scatter(grid, BEFORE, start, nodes, given.node, share, origin, motion, variant.width)
    if ti.static(variant.liquid):
        if p >= scene.robot:
            mass = body[w, p, 0][MASS]
            scatter_ratio(grid, nodes, start + given.node, share, history(state, s, w, p), mass, variant.width)
    if ti.static(variant.fbar):
        if p >= scene.robot:
            scatter_rate(state, body, grid, start, layer(nodes, scene, p, variant), scene, s, w, p)


@ti.func
def update_node(
    grid: ti.template(), m, node, i, j, k, dt, scene: ti.template(), terrain: ti.template(), variant: ti.template()
):
    """Momentum at node m to velocity at `node`, (i, j, k) of the whole grid, with gravity and contact."""
    q = grid[MOMENTUM, m]
    after = ti.Vector([0.0, 0.0, 0.0, 0.0])
    if q[3] > 0.0:
        r = 1.0 / q[3]
        free = ti.Vector([q[0] * r + dt * scene.g_x, q[1] * r + dt * scene.g_y, q[2] * r + dt * scene.g_z])
        count = ti.Vector([scene.nodes_x, scene.nodes_y, scene.nodes_z])
        if ti.static(variant.skin):
            pushed = ti.Vector([r * grid[PUSH, m][0], r * grid[PUSH, m][1], r * grid[PUSH, m][2]])
            free = rub(free + pushed, pushed, scene.friction)
        held = contact(
            free, ti.Vector([i, j, k]), count, scene.friction, terrain, variant.ground, variant.liquid,
            STOP_NODES * variant.skin,
        )  # fmt: skip
        after = ti.Vector([held[0], held[1], held[2], q[3]])
    grid[VELOCITY, node] = after


@ti.func
def mirror_image(
    nodes: ti.template(), window: ti.template(), s, w, node, index: ti.template(), scene: ti.template(),
    d: ti.template(), ground: ti.template(),
):  # fmt: skip
    """The normal of the wall before `node` in direction d, 0 if there is none, and the node's mirror image before it.

    The image is -1 if it lies outside the window, where there is no matter.
    """
    count, stride = (scene.nodes_x, scene.nodes_y, scene.nodes_z)[d], (nodes.sx, nodes.sy, 1)[d]
    normal = behind_wall(index[d], count, d, ground)
    image, there = node + 2 * normal * stride, index[d] + 2 * normal
    if there < window[s, w, d] or there >= window[s, w, 3 + d]:
        image = -1
    return normal, image


@ti.func
def press_node(
    grid: ti.template(), nodes: ti.template(), window: ti.template(), s, w, node, index: ti.template(),
    scene: ti.template(), ground: ti.template(),
):  # fmt: skip
    """Pressure of tight walls on a node behind them and on its mirror image before them, after `update_node`."""
    for d in ti.static(range(3)):
        press_along(grid, nodes, window, s, w, node, index, scene, d, ground)


@ti.func
def press_along(
    grid: ti.template(), nodes: ti.template(), window: ti.template(), s, w, node, index: ti.template(),
    scene: ti.template(), d: ti.template(), ground: ti.template(),
):  # fmt: skip
    """`press_node` by the walls of one direction, whose pairs of nodes have none in common."""
    normal, image = mirror_image(nodes, window, s, w, node, index, scene, d, ground)
    if normal != 0 and grid[VELOCITY, node][3] > 0.0:
        here = grid[VELOCITY, node]
        there = 0.0 * here
        if image >= 0:
            there = grid[VELOCITY, image]
        behind, before = press(normal * here[d], normal * there[d], here[3], there[3])
        here[d] = normal * behind
        grid[VELOCITY, node] = here
        if image >= 0:
            there[d] = normal * before
            grid[VELOCITY, image] = there


@ti.func
def from_grid(
    state: ti.template(), grid: ti.template(), start, nodes: ti.template(), at: ti.template(), scene: ti.template(), dt,
    s, t, w, p, variant: ti.template(),
):  # fmt: skip
    """Gather, move and deform one particle with stencil `at`; returns the first node of its new stencil.

    F is updated at the end of the substep with the new C: the other order puts F one step ahead of x.
    """
    width = ti.static(variant.width)
    share = weights(at.offset, width)
    total, rate = gather_affine(grid, VELOCITY, 0, nodes, at, share, scene.inverse, width)
    velocity = spatial(total)
    rho, mean, place = 0.0 * dt, 0.0 * dt, state[s, w, p, X] + dt * velocity
    affine, change = rate, scale(dt, rate)
    if ti.static(variant.fbar):
        if p >= scene.robot:
            around, own = mean_rate(state, grid, start, layer(nodes, scene, p, variant), scene, s, w, p)
            change = add(change, diagonal(dt / 3.0 * (around - own)))
    if ti.static(variant.liquid):
        if p >= scene.robot:
            # slots s and t may be the same: all is read before anything is written
            J = history(state, s, w, p)
            rho = total[3] * density_factor(room(at, share, scene, width), scene)
            mean = mean_ratio(grid, nodes, start + at.node, share, J, width)
            correction = correction_share(scene.inverse, dt, scene.medium)
            place += particle_shift(grid, nodes, at, scene, J, rho, correction, width)
    if ti.static(variant.uses(AFLIP)):
        if has_transfer(scene, p, variant, AFLIP):
            before, affine_before = gather_affine(grid, BEFORE, start, nodes, at, share, scene.inverse, width)
            velocity += FLIP_SHARE * (state[s, w, p, V] - spatial(before))
            affine = add(rate, kept_affine(columns(state, s, w, p, C), affine_before, rate, dt))
    state[t, w, p, X] = place
    state[t, w, p, V] = velocity
    put_columns(state, t, w, p, C, affine)
    if is_robot(scene, p, variant):
        deformation = columns(state, s, w, p, F)
        put_columns(state, t, w, p, F, add(deformation, matmul(change, deformation)))
    elif ti.static(variant.has_medium):
        deform_medium(state, s, t, w, p, add(diagonal(1.0 + 0.0 * dt), change), rho, mean, scene, dt, variant.law)
    cells = place * scene.inverse
    return (
        first_node(cells[0], scene.nodes_x, width),
        first_node(cells[1], scene.nodes_y, width),
        first_node(cells[2], scene.nodes_z, width),
    )
