"""One particle's or one node's part of a substep and its adjoint; the drivers `serial` and `parallel` loop over these.

A substep is symplectic Euler in MLS-MPM (Hu et al. 2018): scatter mass, momentum and stress, update the nodes'
velocity with gravity and contact, gather, move, deform.

Arrays are those of `layout`. `s` is the slot read, `t` the slot written, `w` the world, `p` the particle; `scene` holds
the constants by name and `nodes` the box of nodes. `start` is the first node of the momenta, those of the velocities
and of the adjoints lie at the grid's beginning or at `slab`. Code that `variant` does not call for is not compiled.
"""

import taichi as ti

from zoobench.sim.kernels.boundary import behind_wall, contact, contact_adjoint, press, press_adjoint
from zoobench.sim.kernels.columns import (
    add,
    contract,
    diagonal,
    dot,
    matmul,
    matmul_transposed,
    matrix,
    scale,
    spatial,
    transpose,
    transposed_matmul,
    transposed_matvec,
)
from zoobench.sim.kernels.drift import mean_ratio, mean_ratio_adjoint, scatter_ratio, scatter_ratio_adjoint
from zoobench.sim.kernels.elastic import fibre_stress, fibre_stress_adjoint, neo_hookean, neo_hookean_adjoint, viscous
from zoobench.sim.kernels.flip import FLIP_SHARE
from zoobench.sim.kernels.layout import (
    BEFORE,
    MASS,
    MOMENTUM,
    STIFFNESS,
    TENSION,
    VELOCITY,
    VOLUME,
    C,
    F,
    V,
    X,
    add_columns,
    add_history,
    columns,
    history,
    put_columns,
)
from zoobench.sim.kernels.media import WATER, deform_medium, deform_medium_adjoint, medium_stress, medium_stress_adjoint
from zoobench.sim.kernels.shifting import particle_shift, particle_shift_adjoint
from zoobench.sim.kernels.splines import INVERSE_MOMENT, first_node, stencil, weight_derivatives, weights
from zoobench.sim.kernels.transfer import (
    AFLIP,
    PIC,
    gather,
    gather_adjoint,
    gather_value,
    scatter,
    scatter_adjoint,
    scatter_value,
    value_derivative,
)
from zoobench.sim.kernels.water import correction_share, density_factor, room, room_adjoint


@ti.func
def is_robot(scene: ti.template(), p, variant: ti.template()):
    """True for a particle of the robot; known when a scene without a medium is compiled."""
    if ti.static(variant.law == 0):
        return True
    return p < scene.robot


@ti.func
def particle_stress(state: ti.template(), body: ti.template(), scene: ti.template(), s, w, p, variant: ti.template()):
    """Kirchhoff stress [Pa] of a particle at slot s; that of a solid medium was stored with its plastic return."""
    stress = diagonal(0.0 * scene.spacing)
    if is_robot(scene, p, variant):
        deformation, q = columns(state, s, w, p, F), body[w, p, 0]
        stress = scale(q[STIFFNESS], neo_hookean(deformation, scene.mu, scene.lam))
        if ti.static(variant.muscle):
            stress = add(stress, fibre_stress(deformation, q[TENSION], body[w, p, 1]))
        if ti.static(variant.damping):
            stress = add(stress, viscous(columns(state, s, w, p, C), scene.eta))
    elif ti.static(variant.law):
        stress = medium_stress(state, s, w, p, scene.medium, variant.law)
    return stress


@ti.func
def linear_motion(state: ti.template(), scene: ti.template(), s, w, p, mass, at: ti.template()):
    """Momentum and mass at the first node of a particle's stencil by its own affine motion, and the slopes."""
    slope = scale(mass * scene.spacing, columns(state, s, w, p, C))
    momentum = mass * state[s, w, p, V]
    origin = ti.Vector([momentum[0], momentum[1], momentum[2], mass])
    return origin - at.offset[0] * slope.x - at.offset[1] * slope.y - at.offset[2] * slope.z, slope


@ti.func
def contribution(
    state: ti.template(), body: ti.template(), nodes: ti.template(), scene: ti.template(), dt, s, w, p,
    variant: ti.template(),
):  # fmt: skip
    """What a particle adds to its stencil: momentum and mass at the first node and their slopes."""
    at = stencil(state[s, w, p, X], scene, nodes, variant.width)
    q = body[w, p, 0]
    m = q[MASS]
    # momentum of the internal forces, -dt V0 tau M^-1 (x_i - x_p) w (Hu et al. 2018, eq. 18); with Kirchhoff stress it
    # is the rest volume, as V sigma = V0 tau
    factor = -ti.static(INVERSE_MOMENT[variant.width]) * dt * scene.inverse * q[VOLUME]
    slope = scale(factor, particle_stress(state, body, scene, s, w, p, variant))
    if ti.static(variant.transfer != PIC):
        slope = add(slope, scale(m * scene.spacing, columns(state, s, w, p, C)))
    momentum = m * state[s, w, p, V]
    origin = ti.Vector([momentum[0], momentum[1], momentum[2], m])
    return ti.Struct(
        node=at.node,
        offset=at.offset,
        origin=origin - at.offset[0] * slope.x - at.offset[1] * slope.y - at.offset[2] * slope.z,
        slope=slope,
    )


@ti.func
def to_grid(
    state: ti.template(), body: ti.template(), grid: ti.template(), start, nodes: ti.template(), scene: ti.template(),
    s, w, p, given: ti.template(), variant: ti.template(),
):  # fmt: skip
    """Scatter one particle's `contribution`."""
    share = weights(given.offset, variant.width)
    scatter(grid, MOMENTUM, start, nodes, given.node, share, given.origin, given.slope, variant.width)
    if ti.static(variant.transfer == AFLIP):
        origin, motion = linear_motion(state, scene, s, w, p, body[w, p, 0][MASS], given)
        scatter(grid, BEFORE, start, nodes, given.node, share, origin, motion, variant.width)
    if ti.static(variant.law == WATER):
        if p >= scene.robot:
            mass = body[w, p, 0][MASS]
            scatter_ratio(grid, nodes, start + given.node, share, history(state, s, w, p), mass, variant.width)


@ti.func
def update_node(
    grid: ti.template(), m, l, i, j, k, dt, scene: ti.template(), terrain: ti.template(), variant: ti.template()
):
    """Momentum at node m to velocity at node l, (i, j, k) of the whole grid, with gravity and contact."""
    q = grid[MOMENTUM, m]
    after = ti.Vector([0.0, 0.0, 0.0, 0.0])
    if q[3] > 0.0:
        r = 1.0 / q[3]
        free = ti.Vector([q[0] * r + dt * scene.g_x, q[1] * r + dt * scene.g_y, q[2] * r + dt * scene.g_z])
        count = ti.Vector([scene.nodes_x, scene.nodes_y, scene.nodes_z])
        held = contact(
            free, ti.Vector([i, j, k]), count, scene.friction, terrain, variant.ground, variant.law == WATER
        )
        after = ti.Vector([held[0], held[1], held[2], q[3]])
    grid[VELOCITY, l] = after


@ti.func
def mirror_image(
    nodes: ti.template(), window: ti.template(), s, w, l, index: ti.template(), scene: ti.template(),
    d: ti.template(), ground: ti.template(),
):  # fmt: skip
    """The normal of the wall before node l in direction d, 0 if there is none, and the node's mirror image before it.

    The image is -1 if it lies outside the window, where there is no matter.
    """
    count, stride = (scene.nodes_x, scene.nodes_y, scene.nodes_z)[d], (nodes.sx, nodes.sy, 1)[d]
    normal = behind_wall(index[d], count, d, ground)
    image, there = l + 2 * normal * stride, index[d] + 2 * normal
    if there < window[s, w, d] or there >= window[s, w, 3 + d]:
        image = -1
    return normal, image


@ti.func
def press_node(
    grid: ti.template(), nodes: ti.template(), window: ti.template(), s, w, l, index: ti.template(),
    scene: ti.template(), ground: ti.template(),
):  # fmt: skip
    """Pressure of tight walls on a node behind them and on its mirror image before them, after `update_node`."""
    for d in ti.static(range(3)):
        normal, image = mirror_image(nodes, window, s, w, l, index, scene, d, ground)
        if normal != 0 and grid[VELOCITY, l][3] > 0.0:
            here = grid[VELOCITY, l]
            there = 0.0 * here
            if image >= 0:
                there = grid[VELOCITY, image]
            behind, before = press(normal * here[d], normal * there[d], here[3], there[3])
            here[d] = normal * behind
            grid[VELOCITY, l] = here
            if image >= 0:
                there[d] = normal * before
                grid[VELOCITY, image] = there


@ti.func
def press_node_adjoint(
    grid: ti.template(), grid_adjoint: ti.template(), nodes: ti.template(), window: ti.template(), s, w, m, l,
    index: ti.template(), dt, scene: ti.template(), ground: ti.template(),
):  # fmt: skip
    """Adjoint of `press_node`: replaces the velocity's adjoint of both nodes, adds to that of their mass.

    The momentum and mass of the node are at m, its velocity after `press_node` and its adjoint at l.
    """
    gravity = (scene.g_x, scene.g_y, scene.g_z)
    for d in ti.static(range(3)):
        normal, image = mirror_image(nodes, window, s, w, l, index, scene, d, ground)
        q = grid[MOMENTUM, m]
        if normal != 0 and q[3] > 0.0:
            here, stored = grid[VELOCITY, l], grid_adjoint[MOMENTUM, l]
            there, image_stored = 0.0 * here, 0.0 * here
            if image >= 0:
                there, image_stored = grid[VELOCITY, image], grid_adjoint[MOMENTUM, image]
            # nothing but gravity acts on the normal velocity of a node behind before `press`
            adjoints = press_adjoint(
                normal * (q[d] / q[3] + dt * gravity[d]), normal * here[d], normal * there[d], q[3], there[3],
                normal * stored[d], normal * image_stored[d],
            )  # fmt: skip
            stored[d] = normal * adjoints[0]
            stored[3] += adjoints[2]
            grid_adjoint[MOMENTUM, l] = stored
            if image >= 0:
                image_stored[d] = normal * adjoints[1]
                image_stored[3] += adjoints[3]
                grid_adjoint[MOMENTUM, image] = image_stored


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
    total, by_x, by_y, by_z = gather(grid, VELOCITY, nodes, at.node, share, width)
    velocity, factor = spatial(total), ti.static(INVERSE_MOMENT[width]) * scene.inverse
    # first moments about the first node, then about the particle: sum w v_i (x_i - x_p)^T / M
    rate = matrix(
        spatial(factor * (by_x - at.offset[0] * total)),
        spatial(factor * (by_y - at.offset[1] * total)),
        spatial(factor * (by_z - at.offset[2] * total)),
    )
    rho, mean, place = 0.0 * dt, 0.0 * dt, state[s, w, p, X] + dt * velocity
    if ti.static(variant.law == WATER):
        if p >= scene.robot:
            # slots s and t may be the same: all is read before anything is written
            J = history(state, s, w, p)
            rho = total[3] * density_factor(room(at, share, scene, width), scene)
            mean = mean_ratio(grid, nodes, start + at.node, share, J, width)
            correction = correction_share(scene.inverse, dt, scene.medium)
            place += particle_shift(grid, nodes, at, scene, J, rho, correction, width)
    if ti.static(variant.transfer == AFLIP):
        before = spatial(gather_value(grid, BEFORE, nodes, start + at.node, share, width))
        velocity += FLIP_SHARE * (state[s, w, p, V] - before)
    state[t, w, p, X] = place
    state[t, w, p, V] = velocity
    put_columns(state, t, w, p, C, rate)
    change = scale(dt, rate)
    if is_robot(scene, p, variant):
        deformation = columns(state, s, w, p, F)
        put_columns(state, t, w, p, F, add(deformation, matmul(change, deformation)))
    elif ti.static(variant.law):
        deform_medium(state, s, t, w, p, add(diagonal(1.0 + 0.0 * dt), change), rho, mean, scene, dt, variant.law)
    cells = place * scene.inverse
    return (
        first_node(cells[0], scene.nodes_x, width),
        first_node(cells[1], scene.nodes_y, width),
        first_node(cells[2], scene.nodes_z, width),
    )


@ti.func
def from_grid_adjoint(
    state: ti.template(), adjoint: ti.template(), grid: ti.template(), grid_adjoint: ti.template(), start,
    nodes: ti.template(), scene: ti.template(), dt, s, t, w, p, variant: ti.template(),
):  # fmt: skip
    """Adjoint of `from_grid`: adds to the nodes' velocity and mass adjoint.

    The adjoints of v, C and the stress at slot t are used up here, but with AFLIP that of v: `to_grid_adjoint` needs it
    for the share that the particle kept.
    """
    width = ti.static(variant.width)
    at = stencil(state[s, w, p, X], scene, nodes, width)
    share, slopes = weights(at.offset, width), weight_derivatives(at.offset, width)
    rate, rate_adjoint = columns(state, t, w, p, C), columns(adjoint, 0, w, p, C)
    new_x_adjoint, v_adjoint = adjoint[0, w, p, X], adjoint[0, w, p, V]
    offset_adjoint, mass_adjoint = 0.0 * at.offset, 0.0 * dt
    if is_robot(scene, p, variant):
        # F' = S F with S = I + dt C
        F_adjoint = columns(adjoint, 0, w, p, F)
        rate_adjoint = add(rate_adjoint, scale(dt, matmul_transposed(F_adjoint, columns(state, s, w, p, F))))
        put_columns(adjoint, 0, w, p, F, add(F_adjoint, scale(dt, transposed_matmul(rate, F_adjoint))))
    elif ti.static(variant.law):
        rho, mean, J = 0.0 * dt, 0.0 * dt, history(state, s, w, p)
        whole, factor = 0.0 * at.offset, 0.0 * dt
        if ti.static(variant.law == WATER):
            whole = room(at, share, scene, width)
            factor = density_factor(whole, scene)
            rho = gather_value(grid, VELOCITY, nodes, at.node, share, width)[3] * factor
            mean = mean_ratio(grid, nodes, start + at.node, share, J, width)
        step = add(diagonal(1.0 + 0.0 * dt), scale(dt, rate))
        step_adjoint, rho_adjoint, mean_adjoint = deform_medium_adjoint(
            state, adjoint, s, w, p, step, rho, mean, scene, dt, variant.law
        )
        rate_adjoint = add(rate_adjoint, scale(dt, step_adjoint))
        if ti.static(variant.law == WATER):
            correction = correction_share(scene.inverse, dt, scene.medium)
            by_shift, J_adjoint, more = particle_shift_adjoint(
                grid, grid_adjoint, nodes, at, scene, J, rho, correction, new_x_adjoint, width
            )
            add_history(adjoint, 0, w, p, J_adjoint)
            rho_adjoint += more
            mass_adjoint = rho_adjoint * factor
            offset_adjoint += by_shift + room_adjoint(at, slopes, whole, rho, rho_adjoint, scene, width)
            if mean_adjoint != 0.0:
                offset_adjoint += mean_ratio_adjoint(
                    grid, start + at.node, grid_adjoint, at.node, nodes, share, slopes, mean, mean_adjoint, width
                )
    velocity = state[t, w, p, V]
    if ti.static(variant.transfer == AFLIP):
        velocity = spatial(gather_value(grid, VELOCITY, nodes, at.node, share, width))
        kept_adjoint = -FLIP_SHARE * v_adjoint
        scatter_value(grid_adjoint, BEFORE, nodes, at.node, share, kept_adjoint, width)
        offset_adjoint += value_derivative(
            grid, BEFORE, nodes, start + at.node, share, slopes, kept_adjoint, width
        )
    # adjoint of the weighted velocity at a node: origin + slopes; of the weighted mass there: mass_adjoint
    slope = scale(ti.static(INVERSE_MOMENT[width]) * scene.inverse, rate_adjoint)
    origin = v_adjoint + dt * new_x_adjoint  # x' = x + dt v
    origin = origin - (at.offset[0] * slope.x + at.offset[1] * slope.y + at.offset[2] * slope.z)
    origin[3] = mass_adjoint
    offset_adjoint += gather_adjoint(
        grid, VELOCITY, grid_adjoint, nodes, at.node, share, slopes, origin, slope, width
    )
    # the offset also stands in C = moments - velocity offset^T
    adjoint[0, w, p, X] = new_x_adjoint + scene.inverse * (offset_adjoint - transposed_matvec(slope, velocity))


@ti.func
def update_node_adjoint(
    grid: ti.template(), grid_adjoint: ti.template(), m, l, i, j, k, dt, scene: ti.template(), terrain: ti.template(),
    variant: ti.template(),
):  # fmt: skip
    """Adjoint of `update_node`: the velocity's adjoint at node l becomes those of momentum (0..2) and mass (3).

    The mass may have an adjoint of its own already, from the density of water.
    """
    q = grid[MOMENTUM, m]
    before = ti.Vector([0.0, 0.0, 0.0, 0.0])  # an empty node is at rest whatever its momentum: it has no derivative
    if q[3] > 0.0:
        r = 1.0 / q[3]
        free = ti.Vector([q[0] * r, q[1] * r, q[2] * r])
        fallen = ti.Vector([free[0] + dt * scene.g_x, free[1] + dt * scene.g_y, free[2] + dt * scene.g_z])
        stored = grid_adjoint[MOMENTUM, l]
        count = ti.Vector([scene.nodes_x, scene.nodes_y, scene.nodes_z])
        a = r * contact_adjoint(
            fallen, ti.Vector([stored[0], stored[1], stored[2]]), ti.Vector([i, j, k]), count, scene.friction,
            terrain, variant.ground, variant.law == WATER,
        )  # fmt: skip
        before = ti.Vector([a[0], a[1], a[2], stored[3] - (a[0] * free[0] + a[1] * free[1] + a[2] * free[2])])
    grid_adjoint[MOMENTUM, l] = before


@ti.func
def motion_adjoint(
    state: ti.template(), grid_adjoint: ti.template(), field: ti.template(), nodes: ti.template(), at: ti.template(),
    scene: ti.template(), s, w, p, origin, slope: ti.template(), width: ti.template(),
):  # fmt: skip
    """Adjoint of scattering `origin` and `slope`: those of the offset, of momentum and mass, and of the affine matrix."""
    share, slopes = weights(at.offset, width), weight_derivatives(at.offset, width)
    offset_adjoint, total, first_x, first_y, first_z = scatter_adjoint(
        grid_adjoint, field, nodes, at.node, share, slopes, origin, slope, width
    )
    # the offset acts through the weights and through origin = momentum - slope offset
    offset_adjoint = offset_adjoint - transposed_matvec(slope, total)
    by_offset = matrix(
        spatial(first_x - at.offset[0] * total),
        spatial(first_y - at.offset[1] * total),
        spatial(first_z - at.offset[2] * total),
    )
    return offset_adjoint, total, by_offset


@ti.func
def to_grid_adjoint(
    state: ti.template(), body: ti.template(), adjoint: ti.template(), body_adjoint: ti.template(),
    grid_adjoint: ti.template(), nodes: ti.template(), scene: ti.template(), dt, s, w, p, variant: ti.template(),
):  # fmt: skip
    """Adjoint of `to_grid`: state adjoints at slot s, and additions to those of the parameters that have one."""
    width = ti.static(variant.width)
    at = stencil(state[s, w, p, X], scene, nodes, width)
    q, velocity, rate = body[w, p, 0], state[s, w, p, V], columns(state, s, w, p, C)
    m = q[MASS]
    stress = particle_stress(state, body, scene, s, w, p, variant)
    factor = -ti.static(INVERSE_MOMENT[width]) * dt * scene.inverse
    slope = scale(factor * q[VOLUME], stress)
    if ti.static(variant.transfer != PIC):
        slope = add(slope, scale(m * scene.spacing, rate))
    origin = m * velocity
    origin = origin - (at.offset[0] * slope.x + at.offset[1] * slope.y + at.offset[2] * slope.z)
    origin[3] = m
    offset_adjoint, total, affine_adjoint = motion_adjoint(
        state, grid_adjoint, MOMENTUM, nodes, at, scene, s, w, p, origin, slope, width
    )
    mass_adjoint, v_adjoint = total[3], spatial(total)
    rate_adjoint = scale(scene.spacing, affine_adjoint)
    if ti.static(variant.transfer == PIC):
        rate_adjoint = diagonal(0.0 * dt)
    if ti.static(variant.transfer == AFLIP):
        first, motion = linear_motion(state, scene, s, w, p, m, at)
        more_offset, more, more_affine = motion_adjoint(
            state, grid_adjoint, BEFORE, nodes, at, scene, s, w, p, first, motion, width
        )
        offset_adjoint += more_offset
        mass_adjoint += more[3]
        v_adjoint += spatial(more)
        rate_adjoint = add(rate_adjoint, scale(scene.spacing, more_affine))
    # adjoints of the momentum m v and of m C so far
    mass_adjoint += dot(v_adjoint, velocity) + contract(rate_adjoint, rate)
    v_adjoint *= m
    if ti.static(variant.transfer == AFLIP):
        v_adjoint += FLIP_SHARE * adjoint[0, w, p, V]
    adjoint[0, w, p, V] = v_adjoint
    put_columns(adjoint, 0, w, p, C, scale(m, rate_adjoint))
    # the stress is symmetric, so only the symmetric part of its adjoint acts
    even = scale(0.5 * factor, add(affine_adjoint, transpose(affine_adjoint)))
    tau_adjoint = scale(q[VOLUME], even)
    if ti.static(variant.law == WATER):
        if p >= scene.robot:
            share, slopes = weights(at.offset, width), weight_derivatives(at.offset, width)
            more_offset, J_adjoint, more_mass = scatter_ratio_adjoint(
                grid_adjoint, nodes, at.node, share, slopes, history(state, s, w, p), m, width
            )
            offset_adjoint += more_offset
            mass_adjoint += more_mass
            add_history(adjoint, 0, w, p, J_adjoint)
    adjoint[0, w, p, X] += scene.inverse * offset_adjoint
    if p < body_adjoint.shape[1]:  # a medium's mass has an adjoint only where the robot displaces it
        body_adjoint[w, p, 0] += ti.Vector([mass_adjoint, contract(even, stress), 0.0, 0.0])
    if is_robot(scene, p, variant):
        robot_stress_adjoint(state, body, adjoint, body_adjoint, scene, s, w, p, tau_adjoint, variant)
    elif ti.static(variant.law):
        medium_stress_adjoint(state, adjoint, s, w, p, tau_adjoint, scene.medium, variant.law)


@ti.func
def robot_stress_adjoint(
    state: ti.template(), body: ti.template(), adjoint: ti.template(), body_adjoint: ti.template(),
    scene: ti.template(), s, w, p, tau_adjoint: ti.template(), variant: ti.template(),
):  # fmt: skip
    """Adjoint of the robot's `particle_stress`: adds to those of F and C, of stiffness, tension and fibre."""
    deformation, q = columns(state, s, w, p, F), body[w, p, 0]
    F_adjoint = add(
        columns(adjoint, 0, w, p, F),
        scale(q[STIFFNESS], neo_hookean_adjoint(deformation, tau_adjoint, scene.mu, scene.lam)),
    )
    tension_adjoint = 0.0 * scene.spacing
    if ti.static(variant.muscle):
        more, by_tension, fibre_adjoint = fibre_stress_adjoint(deformation, tau_adjoint, q[TENSION], body[w, p, 1])
        F_adjoint = add(F_adjoint, more)
        tension_adjoint = by_tension
        body_adjoint[w, p, 1] += fibre_adjoint
    if ti.static(variant.damping):
        add_columns(adjoint, 0, w, p, C, viscous(tau_adjoint, scene.eta))
    put_columns(adjoint, 0, w, p, F, F_adjoint)
    # the passive stress is linear in the stiffness
    stiffness_adjoint = contract(tau_adjoint, neo_hookean(deformation, scene.mu, scene.lam))
    body_adjoint[w, p, 0] += ti.Vector([0.0, 0.0, stiffness_adjoint, tension_adjoint])
