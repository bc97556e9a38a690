"""One particle's or one node's part of a substep and its adjoint; the drivers `serial` and `parallel` loop over these.

A substep is symplectic Euler in MLS-MPM (Hu et al. 2018): scatter mass, momentum and stress, update the nodes'
velocity with gravity and contact, gather, move, deform.

Arrays are those of `serial`. `s` is the slot read, `t` the slot written, `w` the world, `g` its slab of the grid.
Particles below `F.shape[2]` are the robot's, the rest the medium's. Code that `muscle`, `damping`, `law`, `ground` and
`transfer` switch off is not compiled. `before` is the slab of AFLIP, empty with other transfers, and `ratios` that of
water.
"""

import taichi as ti

from zoobench.sim.kernels.boundary import behind_wall, contact, contact_adjoint, press, press_adjoint
from zoobench.sim.kernels.drift import mean_ratio, mean_ratio_adjoint, scatter_ratio, scatter_ratio_adjoint
from zoobench.sim.kernels.elastic import fibre_stress, fibre_stress_adjoint, neo_hookean, neo_hookean_adjoint, viscous
from zoobench.sim.kernels.flip import FLIP_SHARE, gather_velocity, gather_velocity_adjoint
from zoobench.sim.kernels.linalg import identity, matmul
from zoobench.sim.kernels.media import WATER, deform_medium, deform_medium_adjoint, medium_stress, medium_stress_adjoint
from zoobench.sim.kernels.shifting import density_and_shift_adjoint, particle_shift
from zoobench.sim.kernels.splines import INVERSE_MOMENT, base_node
from zoobench.sim.kernels.transfer import AFLIP, PIC, gather, gather_adjoint, scatter, scatter_adjoint
from zoobench.sim.kernels.water import correction_share, relative_density


@ti.func
def particle_stress(
    C: ti.template(), F: ti.template(), history: ti.template(), tau: ti.template(),
    stiffness: ti.template(), tension: ti.template(), fibre: ti.template(),
    s, w, p, mu, lam, eta, constants, muscle: ti.template(), damping: ti.template(), law: ti.template(),
):  # fmt: skip
    """Kirchhoff stress [Pa] of a particle at slot s; that of a solid medium was stored with its plastic return."""
    stress = 0.0 * identity()
    if p < F.shape[2]:
        stress = stiffness[w, p] * neo_hookean(F[s, w, p], mu, lam)
        if ti.static(muscle):
            stress += fibre_stress(F[s, w, p], tension[w, p], fibre[0, w, p])
        if ti.static(damping):
            stress += viscous(C[s, w, p], eta)
    elif ti.static(law):
        stress = medium_stress(tau, history, C, s, w, p - F.shape[2], p, constants, law)
    return stress


@ti.func
def to_grid(
    x: ti.template(), v: ti.template(), C: ti.template(), F: ti.template(),
    history: ti.template(), tau: ti.template(),
    mass: ti.template(), volume: ti.template(), stiffness: ti.template(), tension: ti.template(), fibre: ti.template(),
    grid: ti.template(), before: ti.template(), ratios: ti.template(),
    g, s, w, p, inverse_spacing, dt, mu, lam, eta, constants,
    muscle: ti.template(), damping: ti.template(), law: ti.template(), width: ti.template(), transfer: ti.template(),
):  # fmt: skip
    """Scatter one particle's mass, momentum and stress."""
    stress = particle_stress(
        C, F, history, tau, stiffness, tension, fibre, s, w, p, mu, lam, eta, constants, muscle, damping, law
    )
    # momentum of the internal forces, -dt V0 tau M^-1 (x_i - x_p) w (Hu et al. 2018, eq. 18); with Kirchhoff stress it
    # is the rest volume, as V sigma = V0 tau
    stress_factor = -ti.static(INVERSE_MOMENT[width]) * dt * inverse_spacing * inverse_spacing * volume[w, p]
    m = mass[w, p]
    affine = stress_factor * stress
    if ti.static(transfer != PIC):
        affine += m * C[s, w, p]
    scatter(grid, g, x[s, w, p], m * v[s, w, p], affine, m, inverse_spacing, width, transfer)
    if ti.static(transfer == AFLIP):
        scatter(before, g, x[s, w, p], m * v[s, w, p], m * C[s, w, p], m, inverse_spacing, width, transfer)
    if ti.static(law == WATER):
        if p >= F.shape[2]:
            scatter_ratio(ratios, g, x[s, w, p], history[s, w, p - F.shape[2]], m, inverse_spacing, width)


@ti.func
def update_node(
    grid: ti.template(), target: ti.template(), g, i, j, k, dt_g, mu_ground,
    terrain: ti.template(), ground: ti.template(), law: ti.template(),
):  # fmt: skip
    """Momentum to velocity with gravity and contact, from `grid` to `target` (maybe the same); `dt_g` is dt g [m/s]."""
    q = grid[g, i, j, k]
    if q[3] > 0.0:
        shape = ti.Vector([grid.shape[1], grid.shape[2], grid.shape[3]])
        free = ti.Vector([q[0], q[1], q[2]]) / q[3] + dt_g
        after = contact(free, ti.Vector([i, j, k]), shape, mu_ground, terrain, ground, law == WATER)
        target[g, i, j, k] = ti.Vector([after[0], after[1], after[2], q[3]])


@ti.func
def press_node(grid: ti.template(), g, i, j, k, ground: ti.template()):
    """Pressure of tight walls on a node behind them and on its mirror image before them, after `update_node`."""
    index, shape = ti.Vector([i, j, k]), ti.Vector([grid.shape[1], grid.shape[2], grid.shape[3]])
    for d in ti.static(range(3)):
        normal = behind_wall(index[d], shape[d], d, ground)
        if normal != 0 and grid[g, i, j, k][3] > 0.0:
            image = index + 2 * normal * ti.Vector.unit(3, d, ti.i32)
            here, there = grid[g, i, j, k], grid[g, image[0], image[1], image[2]]
            behind, before = press(normal * here[d], normal * there[d], here[3], there[3])
            grid[g, i, j, k][d] = normal * behind
            grid[g, image[0], image[1], image[2]][d] = normal * before


@ti.func
def press_node_adjoint(
    grid: ti.template(), grid_velocity: ti.template(), grid_adjoint: ti.template(), g, i, j, k, dt_g,
    ground: ti.template(),
):  # fmt: skip
    """Adjoint of `press_node`: replaces the velocity's adjoint of both nodes, adds to that of their mass.

    `grid` holds momenta and masses, `grid_velocity` the velocities after `press_node`.
    """
    index, shape = ti.Vector([i, j, k]), ti.Vector([grid.shape[1], grid.shape[2], grid.shape[3]])
    for d in ti.static(range(3)):
        normal = behind_wall(index[d], shape[d], d, ground)
        q = grid[g, i, j, k]
        if normal != 0 and q[3] > 0.0:
            image = index + 2 * normal * ti.Vector.unit(3, d, ti.i32)
            here, there = grid_velocity[g, i, j, k], grid_velocity[g, image[0], image[1], image[2]]
            # nothing but gravity acts on the normal velocity of a node behind before `press`
            adjoints = press_adjoint(
                normal * (q[d] / q[3] + dt_g[d]), normal * here[d], normal * there[d], q[3], there[3],
                normal * grid_adjoint[g, i, j, k][d], normal * grid_adjoint[g, image[0], image[1], image[2]][d],
            )  # fmt: skip
            grid_adjoint[g, i, j, k][d] = normal * adjoints[0]
            grid_adjoint[g, image[0], image[1], image[2]][d] = normal * adjoints[1]
            grid_adjoint[g, i, j, k][3] += adjoints[2]
            grid_adjoint[g, image[0], image[1], image[2]][3] += adjoints[3]


@ti.func
def from_grid(
    x: ti.template(), v: ti.template(), C: ti.template(), F: ti.template(),
    b: ti.template(), history: ti.template(), tau: ti.template(),
    grid: ti.template(), before: ti.template(), ratios: ti.template(), g, s, t, w, p, inverse_spacing, dt, constants,
    law: ti.template(), width: ti.template(), transfer: ti.template(),
):  # fmt: skip
    """Gather, move and deform one particle; returns the first node of its new stencil.

    F is updated at the end of the substep with the new C: the other order puts F one step ahead of x.
    """
    velocity, affine = gather(grid, g, x[s, w, p], inverse_spacing, width, transfer)
    rho, mean, place = 0.0 * dt, 0.0 * dt, x[s, w, p] + dt * velocity
    if ti.static(law == WATER):
        if p >= F.shape[2]:
            # slots s and t may be the same: all is read before anything is written
            rho = relative_density(grid, g, x[s, w, p], inverse_spacing, constants[3], width)
            mean = mean_ratio(ratios, g, x[s, w, p], history[s, w, p - F.shape[2]], inverse_spacing, width)
            share = correction_share(inverse_spacing, dt, constants)
            place += particle_shift(
                grid, g, x[s, w, p], history[s, w, p - F.shape[2]], rho, share, inverse_spacing, width
            )
    kept = velocity
    if ti.static(transfer == AFLIP):
        kept += FLIP_SHARE * (v[s, w, p] - gather_velocity(before, g, x[s, w, p], inverse_spacing, width))
    step = identity() + dt * affine
    x[t, w, p] = place
    v[t, w, p] = kept
    C[t, w, p] = affine
    if p < F.shape[2]:
        F[t, w, p] = matmul(step, F[s, w, p])
    elif ti.static(law):
        deform_medium(b, history, tau, s, t, w, p - F.shape[2], step, rho, mean, inverse_spacing, dt, constants, law)
    return base_node(place, inverse_spacing, grid, width)


@ti.func
def from_grid_adjoint(
    x: ti.template(), v: ti.template(), C: ti.template(), F: ti.template(), b: ti.template(), history: ti.template(),
    grid_velocity: ti.template(), before: ti.template(), ratios: ti.template(),
    grid_adjoint: ti.template(), before_adjoint: ti.template(), ratios_adjoint: ti.template(),
    x_adj: ti.template(), v_adj: ti.template(), C_adj: ti.template(), F_adj: ti.template(),
    b_adj: ti.template(), history_adj: ti.template(), tau_adj: ti.template(),
    g, s, t, w, p, inverse_spacing, dt, constants,
    law: ti.template(), width: ti.template(), transfer: ti.template(),
):  # fmt: skip
    """Adjoint of `from_grid`: adds to the nodes' velocity and mass adjoint.

    The adjoints of v, C and tau at slot t are used up here, but with AFLIP that of v: `to_grid_adjoint` needs it for
    the share that the particle kept.
    """
    step = identity() + dt * C[t, w, p]
    affine_adjoint = C_adj[0, w, p]
    place_adjoint = 0.0 * v_adj[0, w, p]
    if p < F.shape[2]:
        # F' = S F with S = I + dt C
        F_adjoint = F_adj[0, w, p]
        affine_adjoint += dt * matmul(F_adjoint, F[s, w, p].transpose())
        F_adj[0, w, p] = matmul(step.transpose(), F_adjoint)
    elif ti.static(law):
        q = p - F.shape[2]
        rho, mean = 0.0 * dt, 0.0 * dt
        if ti.static(law == WATER):
            rho = relative_density(grid_velocity, g, x[s, w, p], inverse_spacing, constants[3], width)
            mean = mean_ratio(ratios, g, x[s, w, p], history[s, w, q], inverse_spacing, width)
        step_adjoint, rho_adjoint, mean_adjoint = deform_medium_adjoint(
            b, history, b_adj, history_adj, tau_adj, s, w, q, step, rho, mean, inverse_spacing, dt, constants, law
        )
        affine_adjoint += dt * step_adjoint
        if ti.static(law == WATER):
            place_adjoint, J_adjoint = density_and_shift_adjoint(
                grid_velocity, grid_adjoint, g, x[s, w, p], history[s, w, q], rho, rho_adjoint, x_adj[0, w, p],
                inverse_spacing, dt, constants, width,
            )  # fmt: skip
            history_adj[0, w, q] += J_adjoint
            if mean_adjoint != 0.0:
                place_adjoint += mean_ratio_adjoint(
                    ratios, ratios_adjoint, g, x[s, w, p], mean, mean_adjoint, inverse_spacing, width
                )
    new_x_adjoint = x_adj[0, w, p]  # x' = x + dt v: it adds dt times itself to the velocity's
    velocity = v[t, w, p]
    if ti.static(transfer == AFLIP):
        velocity = gather_velocity(grid_velocity, g, x[s, w, p], inverse_spacing, width)
        place_adjoint += gather_velocity_adjoint(
            before, before_adjoint, g, x[s, w, p], -FLIP_SHARE * v_adj[0, w, p], inverse_spacing, width
        )
    x_adj[0, w, p] = new_x_adjoint + place_adjoint + gather_adjoint(
        grid_velocity, grid_adjoint, g, x[s, w, p], velocity, v_adj[0, w, p] + dt * new_x_adjoint, affine_adjoint,
        inverse_spacing, width, transfer,
    )  # fmt: skip


@ti.func
def update_node_adjoint(
    grid: ti.template(), grid_adjoint: ti.template(), g, i, j, k, dt_g, mu_ground,
    terrain: ti.template(), ground: ti.template(), law: ti.template(),
):  # fmt: skip
    """Adjoint of `update_node`: the velocity's adjoint becomes those of momentum (0..2) and mass (3).

    The mass may have an adjoint of its own already, from the density of water.
    """
    q = grid[g, i, j, k]
    if q[3] > 0.0:
        shape = ti.Vector([grid.shape[1], grid.shape[2], grid.shape[3]])
        free = ti.Vector([q[0], q[1], q[2]]) / q[3]
        stored = grid_adjoint[g, i, j, k]
        v_adjoint = ti.Vector([stored[0], stored[1], stored[2]])
        index = ti.Vector([i, j, k])
        v_adjoint = (
            contact_adjoint(free + dt_g, v_adjoint, index, shape, mu_ground, terrain, ground, law == WATER) / q[3]
        )
        grid_adjoint[g, i, j, k] = ti.Vector(
            [v_adjoint[0], v_adjoint[1], v_adjoint[2], stored[3] - v_adjoint.dot(free)]
        )
    else:  # an empty node is at rest whatever its momentum: it has no derivative
        grid_adjoint[g, i, j, k] = ti.Vector([0.0, 0.0, 0.0, 0.0])


@ti.func
def to_grid_adjoint(
    x: ti.template(), v: ti.template(), C: ti.template(), F: ti.template(),
    history: ti.template(), tau: ti.template(),
    mass: ti.template(), volume: ti.template(), stiffness: ti.template(), tension: ti.template(), fibre: ti.template(),
    grid_adjoint: ti.template(), before_adjoint: ti.template(), ratios_adjoint: ti.template(),
    x_adj: ti.template(), v_adj: ti.template(), C_adj: ti.template(), F_adj: ti.template(),
    history_adj: ti.template(), tau_adj: ti.template(),
    mass_adj: ti.template(), volume_adj: ti.template(), stiffness_adj: ti.template(),
    tension_adj: ti.template(), fibre_adj: ti.template(),
    g, s, w, p, inverse_spacing, dt, mu, lam, eta, constants,
    muscle: ti.template(), damping: ti.template(), law: ti.template(), width: ti.template(), transfer: ti.template(),
):  # fmt: skip
    """Adjoint of `to_grid`: state adjoints at slot s, and additions to those of the parameters that have one."""
    stress = particle_stress(
        C, F, history, tau, stiffness, tension, fibre, s, w, p, mu, lam, eta, constants, muscle, damping, law
    )
    stress_factor = -ti.static(INVERSE_MOMENT[width]) * dt * inverse_spacing * inverse_spacing
    m = mass[w, p]
    affine = (stress_factor * volume[w, p]) * stress
    if ti.static(transfer != PIC):
        affine += m * C[s, w, p]
    x_adjoint, momentum_adjoint, affine_adjoint, mass_adjoint = scatter_adjoint(
        grid_adjoint, g, x[s, w, p], m * v[s, w, p], affine, m, inverse_spacing, width, transfer
    )
    v_adjoint, rate_adjoint = m * momentum_adjoint, affine_adjoint
    if ti.static(transfer == PIC):
        rate_adjoint = 0.0 * affine_adjoint
    if ti.static(transfer == AFLIP):
        more_x, more_momentum, more_rate, more_mass = scatter_adjoint(
            before_adjoint, g, x[s, w, p], m * v[s, w, p], m * C[s, w, p], m, inverse_spacing, width, transfer
        )
        x_adjoint += more_x
        momentum_adjoint += more_momentum
        mass_adjoint += more_mass
        rate_adjoint += more_rate
        v_adjoint = m * momentum_adjoint + FLIP_SHARE * v_adj[0, w, p]
    x_adj[0, w, p] += x_adjoint
    v_adj[0, w, p] = v_adjoint
    C_adj[0, w, p] = m * rate_adjoint
    # the stress is symmetric, so only the symmetric part of its adjoint acts
    symmetric = (0.5 * stress_factor) * (affine_adjoint + affine_adjoint.transpose())
    tau_adjoint = volume[w, p] * symmetric
    if p < mass_adj.shape[1]:  # a medium's mass has an adjoint only where the robot displaces it
        mass_adj[w, p] += mass_adjoint + momentum_adjoint.dot(v[s, w, p]) + (rate_adjoint * C[s, w, p]).sum()
        volume_adj[w, p] += (symmetric * stress).sum()
    if p < F.shape[2]:
        deform = F[s, w, p]
        F_adjoint = F_adj[0, w, p] + stiffness[w, p] * neo_hookean_adjoint(deform, tau_adjoint, mu, lam)
        if ti.static(muscle):
            more, tension_adjoint, fibre_adjoint = fibre_stress_adjoint(
                deform, tau_adjoint, tension[w, p], fibre[0, w, p]
            )
            F_adjoint += more
            tension_adj[w, p] += tension_adjoint
            fibre_adj[0, w, p] += fibre_adjoint
        if ti.static(damping):
            C_adj[0, w, p] += viscous(tau_adjoint, eta)
        F_adj[0, w, p] = F_adjoint
        # the passive stress is linear in the stiffness
        stiffness_adj[w, p] += (tau_adjoint * neo_hookean(deform, mu, lam)).sum()
    elif ti.static(law):
        if ti.static(law == WATER):
            more_x, J_adjoint, more_mass = scatter_ratio_adjoint(
                ratios_adjoint, g, x[s, w, p], history[s, w, p - F.shape[2]], m, inverse_spacing, width
            )
            x_adj[0, w, p] += more_x
            history_adj[0, w, p - F.shape[2]] += J_adjoint
            if p < mass_adj.shape[1]:
                mass_adj[w, p] += more_mass
        medium_stress_adjoint(
            tau_adj, history_adj, C_adj, history, s, w, p - F.shape[2], p, tau_adjoint, constants, law
        )
