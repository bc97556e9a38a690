"""The adjoints of `substep`, one particle or one node at a time.

`c` is the `context.Context` of the substep.
"""

import taichi as ti

from zoobench.sim.kernels.anchors import is_driven, scattered_velocity, unless_held
from zoobench.sim.kernels.boundary import behind_wall, contact_adjoint, wall_pressure_adjoint
from zoobench.sim.kernels.columns import (
    add,
    contract,
    diagonal,
    dot,
    matmul_transposed,
    matrix,
    scale,
    spatial,
    trace,
    transpose,
    transposed_matmul,
)
from zoobench.sim.kernels.context import Around, is_none
from zoobench.sim.kernels.drift import mean_ratio, mean_ratio_adjoint, scatter_ratio_adjoint
from zoobench.sim.kernels.elastic import fibre_stress_adjoint, neo_hookean, neo_hookean_adjoint, viscous
from zoobench.sim.kernels.fbar import mean_rate, mean_rate_adjoint, scatter_rate_adjoint
from zoobench.sim.kernels.flip import FLIP_SHARE, kept_affine_adjoint
from zoobench.sim.kernels.lane_scatter import put_contribution, scatter_lane
from zoobench.sim.kernels.laws.media import deform_medium_adjoint, medium_stress_adjoint
from zoobench.sim.kernels.laws.water import correction_share, density_factor, free_fraction, free_fraction_adjoint
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
    add_columns,
    add_history,
    columns,
    history,
    layer,
    medium_layer,
    put_columns,
)
from zoobench.sim.kernels.shifting import particle_shift_adjoint
from zoobench.sim.kernels.skin_contact import STOP_NODES, coulomb_friction, coulomb_friction_adjoint
from zoobench.sim.kernels.splines import INVERSE_MOMENT, stencil, weight_derivatives, weights
from zoobench.sim.kernels.substep import has_transfer, is_robot, linear_motion, mirror_image, moduli, particle_stress
from zoobench.sim.kernels.transfer import (
    AFLIP,
    PIC,
    gather_affine,
    gather_affine_adjoint,
    gather_value,
    motion_adjoint,
)
from zoobench.sim.kernels.velocity_fields import free_velocity, update_fields_adjoint, velocities_before_ground


@ti.func
def press_node_adjoint(c: ti.template(), m, node, index: ti.template()):
    """Adjoint of `press_node`: replaces the velocity's adjoint of both nodes, adds to that of their mass.

    The momentum and mass of the node are at m, its velocity after `press_node` and its adjoint at `node`.
    """
    count, is_behind = (c.scene.nodes_x, c.scene.nodes_y, c.scene.nodes_z), False
    for d in ti.static(range(3)):
        is_behind = is_behind or behind_wall(index[d], count[d], d, c.variant.ground) != 0
    if is_behind:
        free = unpressed(c, m, index)
        for d in ti.static(range(3)):
            press_along_adjoint(c, m, node, index, free, d)


@ti.func
def unpressed(c: ti.template(), m, index: ti.template()):
    """Velocity of a node behind a wall before `press_node`: only gravity and the contact of two fields act on it."""
    free = free_velocity(c, c.grid[MOMENTUM, m])
    if ti.static(c.variant.layers > 1):
        velocities, _contacts = velocities_before_ground(c, m - medium_layer(c), index)
        free = velocities[c.variant.layers - 1]
    return free


@ti.func
def press_along_adjoint(c: ti.template(), m, node, index: ti.template(), free, d: ti.template()):
    """Adjoint of `press_along` for a node whose velocity was `free`."""
    mass = c.grid[MOMENTUM, m][3]
    normal, image = mirror_image(c, node, index, d)
    if normal != 0 and mass > 0.0:
        here, stored = c.grid[VELOCITY, node], c.grid_adjoint[MOMENTUM, node]
        there, image_stored = 0.0 * here, 0.0 * here
        if image >= 0:
            there, image_stored = c.grid[VELOCITY, image], c.grid_adjoint[MOMENTUM, image]
        adjoints = wall_pressure_adjoint(
            normal * free[d], normal * here[d], normal * there[d], mass, there[3],
            normal * stored[d], normal * image_stored[d],
        )  # fmt: skip
        stored[d] = normal * adjoints[0]
        stored[3] += adjoints[2]
        c.grid_adjoint[MOMENTUM, node] = stored
        if image >= 0:
            image_stored[d] = normal * adjoints[1]
            image_stored[3] += adjoints[3]
            c.grid_adjoint[MOMENTUM, image] = image_stored


@ti.func
def from_grid_adjoint(c: ti.template(), p):
    """Adjoint of `from_grid`: adds to the nodes' velocity and mass adjoint, or leaves what is to be added in
    `contributions`, if those are not None, for `lane_scatter`.

    The adjoints of v, C and the stress at slot t are used up here; with AFLIP what acts through the motion that the
    particle kept is left in the place of those of v and C, to which `to_grid_adjoint` adds.
    """
    width = ti.static(c.variant.width)
    adds = ti.static(is_none(c.contributions))
    at = stencil(c.state[c.s, c.w, p, X], c.scene, layer(c, p), width)
    share, slopes = weights(at.offset, width), weight_derivatives(at.offset, width)
    near = Around(at, share, slopes)
    # what moved and deformed the particle; with AFLIP its own motion at slot t is another
    velocity, rate = c.state[c.t, c.w, p, V], columns(c.state, c.t, c.w, p, C)
    if ti.static(c.variant.uses(AFLIP)):
        if has_transfer(c, p, AFLIP):
            velocity, rate = gather_affine(c.field(VELOCITY), near, c.scene.inverse)
    rate_adjoint = columns(c.adjoint, 0, c.w, p, C)
    new_x_adjoint, v_adjoint = c.adjoint[0, c.w, p, X], c.adjoint[0, c.w, p, V]
    if ti.static(c.variant.driven):
        if is_driven(c, p):  # neither its velocity nor its deformation depends on what was before
            by_given = v_adjoint + c.dt * new_x_adjoint
            c.body_adjoint[c.w, p, 1] += ti.Vector([by_given[0], by_given[1], by_given[2], 0.0])
            v_adjoint, rate_adjoint = 0.0 * v_adjoint, scale(0.0, rate_adjoint)
            put_columns(c.adjoint, 0, c.w, p, C, rate_adjoint)
            put_columns(c.adjoint, 0, c.w, p, F, rate_adjoint)
    offset_adjoint, mass_adjoint = 0.0 * at.offset, 0.0 * c.dt
    if is_robot(c, p):
        # F' = S F with S = I + dt C
        F_adjoint = columns(c.adjoint, 0, c.w, p, F)
        rate_adjoint = add(rate_adjoint, scale(c.dt, matmul_transposed(F_adjoint, columns(c.state, c.s, c.w, p, F))))
        put_columns(c.adjoint, 0, c.w, p, F, add(F_adjoint, scale(c.dt, transposed_matmul(rate, F_adjoint))))
    elif ti.static(c.variant.has_medium):
        rho, mean, J = 0.0 * c.dt, 0.0 * c.dt, history(c.state, c.s, c.w, p)
        whole, factor = 0.0 * at.offset, 0.0 * c.dt
        if ti.static(c.variant.liquid):
            whole = free_fraction(near, c.scene, width)
            factor = density_factor(whole, c.scene)
            rho = gather_value(c.field(VELOCITY), near)[3] * factor
            mean = mean_ratio(c.field(RATIO, c.start), near, J)
        step = add(diagonal(1.0 + 0.0 * c.dt), scale(c.dt, rate))
        if ti.static(c.variant.fbar):
            mean, own = mean_rate(c, p)
            step = add(step, diagonal(c.dt / 3.0 * (mean - own)))
        step_adjoint, rho_adjoint, mean_adjoint = deform_medium_adjoint(c, p, step, rho, mean)
        rate_adjoint = add(rate_adjoint, scale(c.dt, step_adjoint))
        if ti.static(c.variant.fbar):
            mean_adjoint = c.dt / 3.0 * trace(step_adjoint)
            offset_adjoint += mean_rate_adjoint(c, p, mean, mean_adjoint)
        if ti.static(c.variant.liquid):
            correction = correction_share(c.scene.inverse, c.dt, c.scene.medium)
            by_shift, J_adjoint, more = particle_shift_adjoint(c, near, J, rho, correction, new_x_adjoint)
            add_history(c.adjoint, 0, c.w, p, J_adjoint)
            rho_adjoint += more
            mass_adjoint = rho_adjoint * factor
            offset_adjoint += by_shift + free_fraction_adjoint(near, whole, rho, rho_adjoint, c.scene, width)
            if mean_adjoint != 0.0:
                offset_adjoint += mean_ratio_adjoint(
                    c.field(RATIO, c.start), c.adjoint_of(RATIO), near, mean, mean_adjoint
                )
    if ti.static(c.variant.uses(AFLIP)):
        if has_transfer(c, p, AFLIP):
            before, affine_before = gather_affine(c.field(BEFORE, c.start), near, c.scene.inverse)
            kept_adjoint, by_rate = kept_affine_adjoint(
                columns(c.state, c.s, c.w, p, C), affine_before, rate, c.dt, columns(c.adjoint, 0, c.w, p, C)
            )
            rate_adjoint = add(rate_adjoint, by_rate)
            found = gather_affine_adjoint(
                c.field(BEFORE, c.start), c.added_to(BEFORE), near, c.scene.inverse, before, -FLIP_SHARE * v_adjoint,
                scale(-1.0, kept_adjoint),
            )  # fmt: skip
            offset_adjoint += found.offset
            if ti.static(not adds):
                put_contribution(c, p, 1, found.origin, found.slope)
            c.adjoint[0, c.w, p, V] = FLIP_SHARE * v_adjoint
            put_columns(c.adjoint, 0, c.w, p, C, kept_adjoint)
    value_adjoint = v_adjoint + c.dt * new_x_adjoint  # x' = x + dt v
    if ti.static(c.variant.driven):
        if is_driven(c, p):
            value_adjoint = 0.0 * value_adjoint
    value_adjoint[3] = mass_adjoint
    by_velocity = gather_affine_adjoint(
        c.field(VELOCITY), c.added_to(MOMENTUM), near, c.scene.inverse, velocity, value_adjoint, rate_adjoint
    )
    if ti.static(not adds):
        put_contribution(c, p, 0, by_velocity.origin, by_velocity.slope)
    c.adjoint[0, c.w, p, X] = new_x_adjoint + c.scene.inverse * (offset_adjoint + by_velocity.offset)


@ti.func
def scatter_contribution(c: ti.template(), p, lane):
    """One lane of what `from_grid_adjoint` left in `contributions`, to the nodes of the particle's stencil."""
    at = stencil(c.state[c.s, c.w, p, X], c.scene, layer(c, p), c.variant.width)
    share = weights(at.offset, c.variant.width)
    for number in ti.static(range(1 + c.variant.uses(AFLIP))):
        if number == 0 or has_transfer(c, p, AFLIP):
            origin, x, y, z = [c.contributions[c.w, p, 4 * number + row] for row in ti.static(range(4))]
            field = c.adjoint_of((MOMENTUM, BEFORE)[number])
            scatter_lane(field, Around(at, share), origin, matrix(x, y, z), lane)


@ti.func
def update_node_adjoint(c: ti.template(), m, node, index: ti.template()):
    """Adjoint of `update_node`: the velocity's adjoint at `node` becomes those of momentum (0..2) and mass (3).

    The mass may have an adjoint of its own already, from the density of water.
    """
    q = c.grid[MOMENTUM, m]
    before = ti.Vector([0.0, 0.0, 0.0, 0.0])  # an empty node is at rest whatever its momentum: it has no derivative
    push_adjoint = before
    if q[3] > 0.0:
        r = 1.0 / q[3]
        free = ti.Vector([q[0] * r, q[1] * r, q[2] * r])
        fallen = ti.Vector([free[0] + c.dt * c.scene.g_x, free[1] + c.dt * c.scene.g_y, free[2] + c.dt * c.scene.g_z])
        row = c.grid_adjoint[MOMENTUM, node]
        stored = unless_held(c, 0, index, row)
        rubbed, pushed = fallen, 0.0 * fallen
        if ti.static(c.variant.skin):
            pushed = ti.Vector([r * c.grid[PUSH, m][0], r * c.grid[PUSH, m][1], r * c.grid[PUSH, m][2]])
            fallen = fallen + pushed
            rubbed = coulomb_friction(fallen, pushed, c.scene.friction)
        a = r * contact_adjoint(
            c, rubbed, ti.Vector([stored[0], stored[1], stored[2]]), index, c.scene.friction, c.variant.liquid,
            STOP_NODES * c.variant.skin,
        )  # fmt: skip
        mass_adjoint = row[3]
        if ti.static(c.variant.skin):
            a, by_push = coulomb_friction_adjoint(fallen, pushed, a, c.scene.friction)
            push_adjoint = ti.Vector([a[0] + by_push[0], a[1] + by_push[1], a[2] + by_push[2], 0.0])
            mass_adjoint -= dot(push_adjoint, pushed)
        before = ti.Vector([a[0], a[1], a[2], mass_adjoint - (a[0] * free[0] + a[1] * free[1] + a[2] * free[2])])
    c.grid_adjoint[MOMENTUM, node] = before
    if ti.static(c.variant.skin):
        c.grid_adjoint[PUSH, node] = push_adjoint


@ti.func
def update_at_adjoint(c: ti.template(), node, index: ti.template()):
    """Adjoint of `update_at`."""
    if ti.static(c.variant.layers > 1):
        update_fields_adjoint(c, c.start + node, node, index)
    else:
        update_node_adjoint(c, c.start + node, node, index)


@ti.func
def to_grid_adjoint(c: ti.template(), p):
    """Adjoint of `to_grid`: state adjoints at slot s, and additions to those of the parameters that have one."""
    width = ti.static(c.variant.width)
    at = stencil(c.state[c.s, c.w, p, X], c.scene, layer(c, p), width)
    share, slopes = weights(at.offset, width), weight_derivatives(at.offset, width)
    near = Around(at, share, slopes)
    q, velocity, rate = c.body[c.w, p, 0], c.state[c.s, c.w, p, V], columns(c.state, c.s, c.w, p, C)
    m = q[MASS]
    stress = particle_stress(c, p)
    factor = -ti.static(INVERSE_MOMENT[width]) * c.dt * c.scene.inverse
    slope = scale(factor * q[VOLUME], stress)
    if not has_transfer(c, p, PIC):
        slope = add(slope, scale(m * c.scene.spacing, rate))
    origin = m * scattered_velocity(c, p)
    origin = origin - (at.offset[0] * slope.x + at.offset[1] * slope.y + at.offset[2] * slope.z)
    origin[3] = m
    offset_adjoint, total, affine_adjoint = motion_adjoint(c.adjoint_of(MOMENTUM), near, origin, slope)
    mass_adjoint, v_adjoint = total[3], spatial(total)
    rate_adjoint = scale(c.scene.spacing, affine_adjoint)
    if ti.static(c.variant.uses(PIC)):
        if has_transfer(c, p, PIC):
            rate_adjoint = diagonal(0.0 * c.dt)
    if ti.static(c.variant.uses(AFLIP)):
        if has_transfer(c, p, AFLIP):
            first, motion = linear_motion(c, p, m, at)
            more_offset, more, more_affine = motion_adjoint(c.adjoint_of(BEFORE), near, first, motion)
            offset_adjoint += more_offset
            mass_adjoint += more[3]
            v_adjoint += spatial(more)
            rate_adjoint = add(rate_adjoint, scale(c.scene.spacing, more_affine))
    # adjoints of the momentum m v and of m C so far
    mass_adjoint += dot(v_adjoint, velocity) + contract(rate_adjoint, rate)
    v_adjoint *= m
    rate_adjoint = scale(m, rate_adjoint)
    if has_transfer(c, p, AFLIP):
        v_adjoint += c.adjoint[0, c.w, p, V]
        rate_adjoint = add(rate_adjoint, columns(c.adjoint, 0, c.w, p, C))
    elif ti.static(c.variant.fbar):
        if p >= c.scene.robot:
            rate_adjoint = add(rate_adjoint, columns(c.adjoint, 0, c.w, p, C))
    c.adjoint[0, c.w, p, V] = v_adjoint
    put_columns(c.adjoint, 0, c.w, p, C, rate_adjoint)
    # the stress is symmetric, so only the symmetric part of its adjoint acts
    even = scale(0.5 * factor, add(affine_adjoint, transpose(affine_adjoint)))
    tau_adjoint = scale(q[VOLUME], even)
    if ti.static(c.variant.liquid):
        if p >= c.scene.robot:
            more_offset, J_adjoint, more_mass = scatter_ratio_adjoint(
                c.adjoint_of(RATIO), near, history(c.state, c.s, c.w, p), m
            )
            offset_adjoint += more_offset
            mass_adjoint += more_mass
            add_history(c.adjoint, 0, c.w, p, J_adjoint)
    if ti.static(c.variant.fbar):
        if p >= c.scene.robot:
            more_offset, more_mass = scatter_rate_adjoint(c, p, m)
            offset_adjoint += more_offset
            mass_adjoint += more_mass
    c.adjoint[0, c.w, p, X] += c.scene.inverse * offset_adjoint
    if p < c.body_adjoint.shape[1]:  # a medium's mass has an adjoint only where the robot displaces it
        c.body_adjoint[c.w, p, 0] += ti.Vector([mass_adjoint, contract(even, stress), 0.0, 0.0])
    if ti.static(not c.variant.robot):
        medium_stress_adjoint(c, p, tau_adjoint)
    elif is_robot(c, p):
        robot_stress_adjoint(c, p, tau_adjoint)
    elif ti.static(c.variant.has_medium):
        medium_stress_adjoint(c, p, tau_adjoint)


@ti.func
def robot_stress_adjoint(c: ti.template(), p, tau_adjoint: ti.template()):
    """Adjoint of the robot's `particle_stress`: adds to those of F and C, of stiffness, tension and fibre."""
    deformation, q = columns(c.state, c.s, c.w, p, F), c.body[c.w, p, 0]
    mu, lam, eta = moduli(c, p)
    F_adjoint = add(
        columns(c.adjoint, 0, c.w, p, F),
        scale(q[STIFFNESS], neo_hookean_adjoint(deformation, tau_adjoint, mu, lam)),
    )
    tension_adjoint = 0.0 * c.scene.spacing
    if ti.static(c.variant.muscle):
        more, by_tension, fibre_adjoint = fibre_stress_adjoint(deformation, tau_adjoint, q[TENSION], c.body[c.w, p, 1])
        F_adjoint = add(F_adjoint, more)
        tension_adjoint = by_tension
        c.body_adjoint[c.w, p, 1] += fibre_adjoint
    if ti.static(c.variant.damping):
        add_columns(c.adjoint, 0, c.w, p, C, viscous(tau_adjoint, eta))
    put_columns(c.adjoint, 0, c.w, p, F, F_adjoint)
    # the passive stress is linear in the stiffness
    stiffness_adjoint = contract(tau_adjoint, neo_hookean(deformation, mu, lam))
    c.body_adjoint[c.w, p, 0] += ti.Vector([0.0, 0.0, stiffness_adjoint, tension_adjoint])
