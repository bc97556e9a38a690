"""The adjoints of `substep`, one particle or one node at a time.

Arrays and names are those of `substep`; `adjoint` holds those of the state at one slot, `body_adjoint` those of the
parameters, `grid_adjoint` those of the nodes.
"""

import taichi as ti

from zoobench.sim.kernels.boundary import behind_wall, contact_adjoint, press_adjoint
from zoobench.sim.kernels.columns import (
    add,
    contract,
    diagonal,
    dot,
    matmul_transposed,
    scale,
    spatial,
    trace,
    transpose,
    transposed_matmul,
    transposed_matvec,
)
from zoobench.sim.kernels.drift import mean_ratio, mean_ratio_adjoint, scatter_ratio_adjoint
from zoobench.sim.kernels.elastic import fibre_stress_adjoint, neo_hookean, neo_hookean_adjoint, viscous
from zoobench.sim.kernels.fbar import mean_rate, mean_rate_adjoint, scatter_rate_adjoint
from zoobench.sim.kernels.flip import FLIP_SHARE, kept_affine_adjoint
from zoobench.sim.kernels.lane_scatter import is_none, put_contribution
from zoobench.sim.kernels.laws.media import deform_medium_adjoint, medium_stress_adjoint
from zoobench.sim.kernels.laws.water import correction_share, density_factor, room, room_adjoint
from zoobench.sim.kernels.layout import (
    BEFORE,
    MASS,
    MOMENTUM,
    PUSH,
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
from zoobench.sim.kernels.shifting import particle_shift_adjoint
from zoobench.sim.kernels.skin_contact import STOP_NODES, rub, rub_adjoint
from zoobench.sim.kernels.splines import INVERSE_MOMENT, stencil, weight_derivatives, weights
from zoobench.sim.kernels.substep import has_transfer, is_robot, linear_motion, mirror_image, particle_stress
from zoobench.sim.kernels.transfer import (
    AFLIP,
    PIC,
    central_moments,
    gather_affine,
    gather_affine_adjoint,
    gather_value,
    scatter_adjoint,
)
from zoobench.sim.kernels.two_fields import free_velocity, layer, meeting


@ti.func
def press_node_adjoint(
    grid: ti.template(), grid_adjoint: ti.template(), nodes: ti.template(), window: ti.template(), s, w, m, node,
    index: ti.template(), dt, scene: ti.template(), terrain: ti.template(), variant: ti.template(),
):  # fmt: skip
    """Adjoint of `press_node`: replaces the velocity's adjoint of both nodes, adds to that of their mass.

    The momentum and mass of the node are at m, its velocity after `press_node` and its adjoint at `node`.
    """
    count, is_behind = (scene.nodes_x, scene.nodes_y, scene.nodes_z), False
    for d in ti.static(range(3)):
        is_behind = is_behind or behind_wall(index[d], count[d], d, variant.ground) != 0
    if is_behind:
        free = unpressed(grid, nodes, window, s, w, m, index, dt, scene, terrain, variant)
        for d in ti.static(range(3)):
            press_along_adjoint(
                grid, grid_adjoint, nodes, window, s, w, m, node, index, free, scene, d, variant.ground
            )  # fmt: skip


@ti.func
def unpressed(
    grid: ti.template(), nodes: ti.template(), window: ti.template(), s, w, m, index: ti.template(), dt,
    scene: ti.template(), terrain: ti.template(), variant: ti.template(),
):  # fmt: skip
    """Velocity of a node behind a wall before `press_node`: only gravity and the contact of two fields act on it."""
    free = free_velocity(grid[MOMENTUM, m], dt, scene)
    if ti.static(variant.two_fields):
        free = meeting(grid, m - nodes.size, nodes, window, s, w, index, dt, scene, terrain, variant).u
    return free


@ti.func
def press_along_adjoint(
    grid: ti.template(), grid_adjoint: ti.template(), nodes: ti.template(), window: ti.template(), s, w, m, node,
    index: ti.template(), free, scene: ti.template(), d: ti.template(), ground: ti.template(),
):  # fmt: skip
    """Adjoint of `press_along` for a node whose velocity was `free`."""
    mass = grid[MOMENTUM, m][3]
    normal, image = mirror_image(nodes, window, s, w, node, index, scene, d, ground)
    if normal != 0 and mass > 0.0:
        here, stored = grid[VELOCITY, node], grid_adjoint[MOMENTUM, node]
        there, image_stored = 0.0 * here, 0.0 * here
        if image >= 0:
            there, image_stored = grid[VELOCITY, image], grid_adjoint[MOMENTUM, image]
        adjoints = press_adjoint(
            normal * free[d], normal * here[d], normal * there[d], mass, there[3],
            normal * stored[d], normal * image_stored[d],
        )  # fmt: skip
        stored[d] = normal * adjoints[0]
        stored[3] += adjoints[2]
        grid_adjoint[MOMENTUM, node] = stored
        if image >= 0:
            image_stored[d] = normal * adjoints[1]
            image_stored[3] += adjoints[3]
            grid_adjoint[MOMENTUM, image] = image_stored


@ti.func
def from_grid_adjoint(
    state: ti.template(), adjoint: ti.template(), grid: ti.template(), grid_adjoint: ti.template(),
    contributions: ti.template(), start, nodes: ti.template(), scene: ti.template(), dt, s, t, w, p,
    variant: ti.template(),
):  # fmt: skip
    """Adjoint of `from_grid`: adds to the nodes' velocity and mass adjoint, or leaves what is to be added in
    `contributions`, if those are not None, for `lane_scatter`.

    The adjoints of v, C and the stress at slot t are used up here; with AFLIP what acts through the motion that the
    particle kept is left in the place of those of v and C, to which `to_grid_adjoint` adds.
    """
    width = ti.static(variant.width)
    adds = ti.static(is_none(contributions))
    at = stencil(state[s, w, p, X], scene, layer(nodes, scene, p, variant), width)
    share, slopes = weights(at.offset, width), weight_derivatives(at.offset, width)
    # what moved and deformed the particle; with AFLIP its own motion at slot t is another
    velocity, rate = state[t, w, p, V], columns(state, t, w, p, C)
    if ti.static(variant.uses(AFLIP)):
        if has_transfer(scene, p, variant, AFLIP):
            velocity, rate = gather_affine(grid, VELOCITY, 0, nodes, at, share, scene.inverse, width)
    rate_adjoint = columns(adjoint, 0, w, p, C)
    new_x_adjoint, v_adjoint = adjoint[0, w, p, X], adjoint[0, w, p, V]
    offset_adjoint, mass_adjoint = 0.0 * at.offset, 0.0 * dt
    if is_robot(scene, p, variant):
        # F' = S F with S = I + dt C
        F_adjoint = columns(adjoint, 0, w, p, F)
        rate_adjoint = add(rate_adjoint, scale(dt, matmul_transposed(F_adjoint, columns(state, s, w, p, F))))
        put_columns(adjoint, 0, w, p, F, add(F_adjoint, scale(dt, transposed_matmul(rate, F_adjoint))))
    elif ti.static(variant.has_medium):
        rho, mean, J = 0.0 * dt, 0.0 * dt, history(state, s, w, p)
        whole, factor = 0.0 * at.offset, 0.0 * dt
        if ti.static(variant.liquid):
            whole = room(at, share, scene, width)
            factor = density_factor(whole, scene)
            rho = gather_value(grid, VELOCITY, nodes, at.node, share, width)[3] * factor
            mean = mean_ratio(grid, nodes, start + at.node, share, J, width)
        step = add(diagonal(1.0 + 0.0 * dt), scale(dt, rate))
        if ti.static(variant.fbar):
            mean, own = mean_rate(state, grid, start, layer(nodes, scene, p, variant), scene, s, w, p)
            step = add(step, diagonal(dt / 3.0 * (mean - own)))
        step_adjoint, rho_adjoint, mean_adjoint = deform_medium_adjoint(
            state, adjoint, s, w, p, step, rho, mean, scene, dt, variant.law
        )
        rate_adjoint = add(rate_adjoint, scale(dt, step_adjoint))
        if ti.static(variant.fbar):
            mean_adjoint = dt / 3.0 * trace(step_adjoint)
            offset_adjoint += mean_rate_adjoint(
                state, adjoint, grid, grid_adjoint, start, layer(nodes, scene, p, variant), scene, s, w, p, mean,
                mean_adjoint,
            )  # fmt: skip
        if ti.static(variant.liquid):
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
    if ti.static(variant.uses(AFLIP)):
        if has_transfer(scene, p, variant, AFLIP):
            before, affine_before = gather_affine(grid, BEFORE, start, nodes, at, share, scene.inverse, width)
            kept_adjoint, by_rate = kept_affine_adjoint(
                columns(state, s, w, p, C), affine_before, rate, dt, columns(adjoint, 0, w, p, C)
            )
            rate_adjoint = add(rate_adjoint, by_rate)
            found = gather_affine_adjoint(
                grid, BEFORE, start, grid_adjoint, BEFORE, nodes, at, share, slopes, scene.inverse, before,
                -FLIP_SHARE * v_adjoint, scale(-1.0, kept_adjoint), width, adds,
            )  # fmt: skip
            offset_adjoint += found.offset
            if ti.static(not adds):
                put_contribution(contributions, w, p, 1, found.origin, found.slope)
            adjoint[0, w, p, V] = FLIP_SHARE * v_adjoint
            put_columns(adjoint, 0, w, p, C, kept_adjoint)
    value_adjoint = v_adjoint + dt * new_x_adjoint  # x' = x + dt v
    value_adjoint[3] = mass_adjoint
    by_velocity = gather_affine_adjoint(
        grid, VELOCITY, 0, grid_adjoint, MOMENTUM, nodes, at, share, slopes, scene.inverse, velocity, value_adjoint,
        rate_adjoint, width, adds,
    )  # fmt: skip
    if ti.static(not adds):
        put_contribution(contributions, w, p, 0, by_velocity.origin, by_velocity.slope)
    adjoint[0, w, p, X] = new_x_adjoint + scene.inverse * (offset_adjoint + by_velocity.offset)


@ti.func
def update_node_adjoint(
    grid: ti.template(), grid_adjoint: ti.template(), m, node, i, j, k, dt, scene: ti.template(),
    terrain: ti.template(), variant: ti.template(),
):  # fmt: skip
    """Adjoint of `update_node`: the velocity's adjoint at `node` becomes those of momentum (0..2) and mass (3).

    The mass may have an adjoint of its own already, from the density of water.
    """
    q = grid[MOMENTUM, m]
    before = ti.Vector([0.0, 0.0, 0.0, 0.0])  # an empty node is at rest whatever its momentum: it has no derivative
    push_adjoint = before
    if q[3] > 0.0:
        r = 1.0 / q[3]
        free = ti.Vector([q[0] * r, q[1] * r, q[2] * r])
        fallen = ti.Vector([free[0] + dt * scene.g_x, free[1] + dt * scene.g_y, free[2] + dt * scene.g_z])
        stored = grid_adjoint[MOMENTUM, node]
        count = ti.Vector([scene.nodes_x, scene.nodes_y, scene.nodes_z])
        rubbed, pushed = fallen, 0.0 * fallen
        if ti.static(variant.skin):
            pushed = ti.Vector([r * grid[PUSH, m][0], r * grid[PUSH, m][1], r * grid[PUSH, m][2]])
            fallen = fallen + pushed
            rubbed = rub(fallen, pushed, scene.friction)
        a = r * contact_adjoint(
            rubbed, ti.Vector([stored[0], stored[1], stored[2]]), ti.Vector([i, j, k]), count, scene.friction,
            terrain, variant.ground, variant.liquid, STOP_NODES * variant.skin,
        )  # fmt: skip
        mass_adjoint = stored[3]
        if ti.static(variant.skin):
            a, by_push = rub_adjoint(fallen, pushed, a, scene.friction)
            push_adjoint = ti.Vector([a[0] + by_push[0], a[1] + by_push[1], a[2] + by_push[2], 0.0])
            mass_adjoint -= dot(push_adjoint, pushed)
        before = ti.Vector([a[0], a[1], a[2], mass_adjoint - (a[0] * free[0] + a[1] * free[1] + a[2] * free[2])])
    grid_adjoint[MOMENTUM, node] = before
    if ti.static(variant.skin):
        grid_adjoint[PUSH, node] = push_adjoint


@ti.func
def motion_adjoint(
    grid_adjoint: ti.template(), field: ti.template(), nodes: ti.template(), at: ti.template(),
    origin, slope: ti.template(), width: ti.template(),
):  # fmt: skip
    """Adjoint of scattering `origin` and `slope`: by offset, momentum and mass, and the affine matrix."""
    share, slopes = weights(at.offset, width), weight_derivatives(at.offset, width)
    offset_adjoint, total, first_x, first_y, first_z = scatter_adjoint(
        grid_adjoint, field, nodes, at.node, share, slopes, origin, slope, width
    )
    # the offset acts through the weights and through origin = momentum - slope offset
    offset_adjoint = offset_adjoint - transposed_matvec(slope, total)
    return offset_adjoint, total, central_moments(at.offset, total, first_x, first_y, first_z)


@ti.func
def to_grid_adjoint(
    state: ti.template(), body: ti.template(), adjoint: ti.template(), body_adjoint: ti.template(),
    grid_adjoint: ti.template(), nodes: ti.template(), scene: ti.template(), dt, s, w, p, variant: ti.template(),
):  # fmt: skip
    """Adjoint of `to_grid`: state adjoints at slot s, and additions to those of the parameters that have one."""
    width = ti.static(variant.width)
    at = stencil(state[s, w, p, X], scene, layer(nodes, scene, p, variant), width)
    q, velocity, rate = body[w, p, 0], state[s, w, p, V], columns(state, s, w, p, C)
    m = q[MASS]
    stress = particle_stress(state, body, scene, s, w, p, variant)
    factor = -ti.static(INVERSE_MOMENT[width]) * dt * scene.inverse
    slope = scale(factor * q[VOLUME], stress)
    if not has_transfer(scene, p, variant, PIC):
        slope = add(slope, scale(m * scene.spacing, rate))
    origin = m * velocity
    origin = origin - (at.offset[0] * slope.x + at.offset[1] * slope.y + at.offset[2] * slope.z)
    origin[3] = m
    offset_adjoint, total, affine_adjoint = motion_adjoint(grid_adjoint, MOMENTUM, nodes, at, origin, slope, width)
    mass_adjoint, v_adjoint = total[3], spatial(total)
    rate_adjoint = scale(scene.spacing, affine_adjoint)
    if ti.static(variant.uses(PIC)):
        if has_transfer(scene, p, variant, PIC):
            rate_adjoint = diagonal(0.0 * dt)
    if ti.static(variant.uses(AFLIP)):
        if has_transfer(scene, p, variant, AFLIP):
            first, motion = linear_motion(state, scene, s, w, p, m, at)
            more_offset, more, more_affine = motion_adjoint(grid_adjoint, BEFORE, nodes, at, first, motion, width)
            offset_adjoint += more_offset
            mass_adjoint += more[3]
            v_adjoint += spatial(more)
            rate_adjoint = add(rate_adjoint, scale(scene.spacing, more_affine))
    # adjoints of the momentum m v and of m C so far
    mass_adjoint += dot(v_adjoint, velocity) + contract(rate_adjoint, rate)
    v_adjoint *= m
    rate_adjoint = scale(m, rate_adjoint)
    if has_transfer(scene, p, variant, AFLIP):
        v_adjoint += adjoint[0, w, p, V]
        rate_adjoint = add(rate_adjoint, columns(adjoint, 0, w, p, C))
    elif ti.static(variant.fbar):
        if p >= scene.robot:
            rate_adjoint = add(rate_adjoint, columns(adjoint, 0, w, p, C))
    adjoint[0, w, p, V] = v_adjoint
    put_columns(adjoint, 0, w, p, C, rate_adjoint)
    # the stress is symmetric, so only the symmetric part of its adjoint acts
    even = scale(0.5 * factor, add(affine_adjoint, transpose(affine_adjoint)))
    tau_adjoint = scale(q[VOLUME], even)
    if ti.static(variant.liquid):
        if p >= scene.robot:
            share, slopes = weights(at.offset, width), weight_derivatives(at.offset, width)
            more_offset, J_adjoint, more_mass = scatter_ratio_adjoint(
                grid_adjoint, nodes, at.node, share, slopes, history(state, s, w, p), m, width
            )
            offset_adjoint += more_offset
            mass_adjoint += more_mass
            add_history(adjoint, 0, w, p, J_adjoint)
    if ti.static(variant.fbar):
        if p >= scene.robot:
            own_layer = layer(nodes, scene, p, variant)
            more_offset, more_mass = scatter_rate_adjoint(state, adjoint, grid_adjoint, own_layer, scene, s, w, p, m)
            offset_adjoint += more_offset
            mass_adjoint += more_mass
    adjoint[0, w, p, X] += scene.inverse * offset_adjoint
    if p < body_adjoint.shape[1]:  # a medium's mass has an adjoint only where the robot displaces it
        body_adjoint[w, p, 0] += ti.Vector([mass_adjoint, contract(even, stress), 0.0, 0.0])
    if ti.static(not variant.robot):
        medium_stress_adjoint(state, adjoint, s, w, p, tau_adjoint, scene.medium, variant.law)
    elif is_robot(scene, p, variant):
        robot_stress_adjoint(state, body, adjoint, body_adjoint, scene, s, w, p, tau_adjoint, variant)
    elif ti.static(variant.has_medium):
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
