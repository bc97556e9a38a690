"""Constitutive laws of the media as isotropic functions of the left Cauchy-Green tensor b, with their adjoints.

A law maps the trial b of a substep and one scalar of history to the elastic b, the new history and the Kirchhoff
stress. All three depend on b through its principal values and share its eigenvectors; the adjoints need, besides the
derivatives by the principal values, only the divided differences (y_i - y_j) / (b_i - b_j), which stay regular where
principal values meet. `constants` are (mu, lambda, then the law's own), as the materials of `scene` list them.

    SAND  Drucker-Prager, Hencky strain (Klar et al. 2016), history: log-volume gained while loose
    CLAY  von Mises, Hencky strain, no history
    MUD   von Mises deviator with the pressure of a fluid, viscous; no history
    SNOW  fixed corotated with clamped stretches and hardening (Stomakhin et al. 2013), history: plastic volume ratio
    WATER weakly compressible fluid, history: J; b is not stored
"""

import taichi as ti

from zoobench.sim.kernels.drift import returned_ratio, returned_ratio_adjoint
from zoobench.sim.kernels.linalg import assemble, cofactor, eigen_symmetric, identity, matmul, pack, sinhc, unpack
from zoobench.sim.kernels.water import correction_share, water_pressure, water_ratio, water_ratio_adjoint
from zoobench.sim.model.matter import LARGEST_PLASTIC, SMALLEST_PLASTIC, Law

SAND, CLAY, MUD, SNOW, WATER = (int(law) for law in (Law.SAND, Law.CLAY, Law.MUD, Law.SNOW, Law.WATER))

SMALLEST_SQUARE = 1e-12  # of a principal stretch: below it log is held


@ti.func
def cone(constants):
    """Deviatoric Hencky strain that sand bears per volumetric strain: alpha (3 lambda + 2 mu) / (2 mu)."""
    mu, lam, slope = constants[0], constants[1], constants[2]
    return slope * (3.0 * lam + 2.0 * mu) / (2.0 * mu)


@ti.func
def radial_return(strain, history, constants, law: ti.template()):
    """Yield of sand, clay and mud in principal Hencky strains: the deviator is scaled back onto the yield surface.

    Returns the elastic strain, the new history and the ratio of the deviator kept: 1 elastic, 0 loose sand.
    """
    volume = strain.sum() + history
    deviator = strain - strain.sum() / 3.0
    elastic, left, keep = 0.0 * strain, 0.0 * volume, 0.0 * volume
    loose = False
    limit = constants[2] / (2.0 * constants[0])
    if ti.static(law == SAND):
        # volume gained while loose is used up before pressure returns (Tampubolon et al. 2017)
        loose = volume >= 0.0
        left = volume
        limit = -cone(constants) * volume
    if not loose:
        left, keep = 0.0, 1.0
        size = deviator.norm()
        if size > limit:
            keep = limit / size
        elastic = keep * deviator + volume / 3.0
    return elastic, left, keep


@ti.func
def radial_return_adjoint(strain, history, pull, history_pull, constants, law: ti.template()):
    """Adjoint of `radial_return`: pulls on (elastic strain, new history) to pulls on (strain, history)."""
    volume = strain.sum() + history
    deviator = strain - strain.sum() / 3.0
    strain_pull, volume_pull = history_pull + 0.0 * strain, history_pull
    loose = False
    limit, slope = constants[2] / (2.0 * constants[0]), 0.0
    if ti.static(law == SAND):
        loose = volume >= 0.0
        slope = cone(constants)
        limit = -slope * volume
    if not loose:
        mean = pull.sum() / 3.0
        size = deviator.norm()
        keep, radial = 1.0, 0.0
        volume_pull = mean
        if size > limit:
            keep = limit / size
            along = deviator.dot(pull) / size
            volume_pull = mean - slope * along
            radial = keep * along / size
        strain_pull = keep * (pull - mean) - radial * deviator + volume_pull
    return strain_pull, volume_pull


@ti.func
def spherical(volume, constants, law: ti.template()):
    """(g, g') of the volumetric strain: the stress of a Hencky law is 2 mu eps + g(tr eps) I.

    Mud has the pressure K (1 - J) of a fluid.
    """
    g, slope = constants[1] * volume, constants[1]
    if ti.static(law == MUD):
        mu, bulk = constants[0], constants[1] + 2.0 / 3.0 * constants[0]
        J = ti.exp(volume)
        g, slope = -2.0 / 3.0 * mu * volume, -2.0 / 3.0 * mu
        if J < 1.0:  # no tension
            g += bulk * J * (J - 1.0)
            slope += bulk * J * (2.0 * J - 1.0)
    return g, slope


@ti.func
def hencky_update(b, history, constants, law: ti.template()):
    """Elastic b, new history and Kirchhoff stress of sand, clay or mud."""
    squares, frame = eigen_symmetric(b)
    strain = 0.5 * ti.log(ti.max(squares, SMALLEST_SQUARE))
    elastic, left, _ = radial_return(strain, history, constants, law)
    g, _ = spherical(elastic.sum(), constants, law)
    return assemble(frame, ti.exp(2.0 * elastic)), left, assemble(frame, 2.0 * constants[0] * elastic + g)


@ti.func
def hencky_update_adjoint(b, history, b_pull, history_pull, stress_pull, constants, law: ti.template()):
    """Adjoint of `hencky_update` for symmetric pulls: pulls on the trial b and the old history.

    With b = exp(2 eps) every divided difference is a product of sinhc.
    """
    mu = constants[0]
    squares, frame = eigen_symmetric(b)
    strain = 0.5 * ti.log(ti.max(squares, SMALLEST_SQUARE))
    elastic, _, keep = radial_return(strain, history, constants, law)
    _, slope = spherical(elastic.sum(), constants, law)
    back = frame.transpose()
    pull_b = matmul(back, matmul(b_pull, frame))
    pull_t = matmul(back, matmul(stress_pull, frame))
    stretch, trial = ti.exp(elastic), ti.exp(strain)
    elastic_pull = 0.0 * strain
    for i in ti.static(range(3)):
        elastic_pull[i] = (
            2.0 * stretch[i] * stretch[i] * pull_b[i, i] + 2.0 * mu * pull_t[i, i] + slope * pull_t.trace()
        )
    strain_pull, before = radial_return_adjoint(strain, history, elastic_pull, history_pull, constants, law)
    inner = 0.0 * b
    for i in ti.static(range(3)):
        inner[i, i] = strain_pull[i] / (2.0 * trial[i] * trial[i])
        for j in ti.static(range(3)):
            if ti.static(i != j):
                rise_b = 2.0 * stretch[i] * stretch[j] * sinhc(elastic[i] - elastic[j])
                run = 2.0 * trial[i] * trial[j] * sinhc(strain[i] - strain[j])
                inner[i, j] = keep * (rise_b * pull_b[i, j] + 2.0 * mu * pull_t[i, j]) / run
    return matmul(frame, matmul(inner, back)), before


@ti.func
def snow_stretch(stretch, plastic, constants):
    """Clamped principal stretches, and the plastic volume ratio before it is held within its bounds."""
    held = ti.min(ti.max(stretch, 1.0 - constants[2]), 1.0 + constants[3])
    ratio = (stretch[0] / held[0]) * (stretch[1] / held[1]) * (stretch[2] / held[2])
    return held, plastic * ratio


@ti.func
def snow_update(b, plastic, constants):
    """Elastic b, new plastic volume ratio and Kirchhoff stress of snow."""
    mu, lam = constants[0], constants[1]
    squares, frame = eigen_symmetric(b)
    held, grown = snow_stretch(ti.sqrt(ti.max(squares, SMALLEST_SQUARE)), plastic, constants)
    after = ti.min(ti.max(grown, SMALLEST_PLASTIC), LARGEST_PLASTIC)
    hardening = ti.exp(constants[4] * (1.0 - after))
    J = held[0] * held[1] * held[2]
    stress = hardening * (2.0 * mu * held * (held - 1.0) + lam * J * (J - 1.0))
    return assemble(frame, held * held), after, assemble(frame, stress)


@ti.func
def snow_update_adjoint(b, plastic, b_pull, plastic_pull, stress_pull, constants):
    """Adjoint of `snow_update` for symmetric pulls: pulls on the trial b and the old plastic volume ratio."""
    mu, lam, low, high = constants[0], constants[1], 1.0 - constants[2], 1.0 + constants[3]
    squares, frame = eigen_symmetric(b)
    stretch = ti.sqrt(ti.max(squares, SMALLEST_SQUARE))
    held, grown = snow_stretch(stretch, plastic, constants)
    after = ti.min(ti.max(grown, SMALLEST_PLASTIC), LARGEST_PLASTIC)
    hardening = ti.exp(constants[4] * (1.0 - after))
    J = held[0] * held[1] * held[2]
    back = frame.transpose()
    pull_b = matmul(back, matmul(b_pull, frame))
    pull_t = matmul(back, matmul(stress_pull, frame))
    soft = 2.0 * mu * held * (held - 1.0) + lam * J * (J - 1.0)
    work = pull_t[0, 0] * soft[0] + pull_t[1, 1] * soft[1] + pull_t[2, 2] * soft[2]
    after_pull = plastic_pull - constants[4] * hardening * work
    grown_pull = 0.0 * after_pull
    if grown > SMALLEST_PLASTIC and grown < LARGEST_PLASTIC:
        grown_pull = after_pull
    volume_pull = hardening * lam * (2.0 * J - 1.0) * pull_t.trace()
    inner = 0.0 * b
    for i in ti.static(range(3)):
        held_pull = 2.0 * held[i] * pull_b[i, i] + hardening * 2.0 * mu * (2.0 * held[i] - 1.0) * pull_t[i, i]
        held_pull += (volume_pull * J - grown_pull * grown) / held[i]
        stretch_pull = grown_pull * grown / stretch[i]
        if stretch[i] > low and stretch[i] < high:
            stretch_pull += held_pull
        inner[i, i] = stretch_pull / (2.0 * stretch[i])
        for j in ti.static(range(3)):
            if ti.static(i != j):
                gap = stretch[i] - stretch[j]
                slope = 0.0
                if ti.abs(gap) > 1e-6 * stretch[i]:
                    slope = (held[i] - held[j]) / gap
                elif stretch[i] > low and stretch[i] < high:
                    slope = 1.0
                both = held[i] + held[j]
                rise = both * pull_b[i, j] + hardening * 2.0 * mu * (both - 1.0) * pull_t[i, j]
                inner[i, j] = slope * rise / (stretch[i] + stretch[j])
    return matmul(frame, matmul(inner, back)), grown_pull * grown / plastic


@ti.func
def shear_rate(C):
    """Deviator of the symmetric part of the velocity gradient [1/s]."""
    return 0.5 * (C + C.transpose()) - C.trace() / 3.0 * identity()


@ti.func
def medium_stress(
    tau: ti.template(), history: ti.template(), C: ti.template(), s, w, q, p, constants, law: ti.template()
):  # fmt: skip
    """Kirchhoff stress [Pa] of medium particle q (p among all) at slot s, the viscous part of a fluid included."""
    stress = 0.0 * identity()
    if ti.static(law == WATER):
        pressure, _ = water_pressure(history[s, w, q], constants)
        stress -= pressure * identity()
    else:
        stress += unpack(tau[s, w, q])
    if ti.static(law in (MUD, WATER)):
        stress += 2.0 * constants[4] * shear_rate(C[s, w, p])
    return stress


@ti.func
def medium_stress_adjoint(
    tau_adj: ti.template(), history_adj: ti.template(), C_adj: ti.template(), history: ti.template(),
    s, w, q, p, pull, constants, law: ti.template(),
):  # fmt: skip
    """Adjoint of `medium_stress` for a symmetric pull: additions to the adjoints of C and J, and that of tau."""
    if ti.static(law == WATER):
        _, slope = water_pressure(history[s, w, q], constants)
        history_adj[0, w, q] -= slope * pull.trace()
    else:
        tau_adj[0, w, q] = pack(pull)
    if ti.static(law in (MUD, WATER)):
        C_adj[0, w, p] += 2.0 * constants[4] * shear_rate(pull)


@ti.func
def deform_medium(
    b: ti.template(), history: ti.template(), tau: ti.template(), s, t, w, q, step, crowd, mean, inverse_spacing, dt,
    constants, law: ti.template(),
):  # fmt: skip
    """Carry a medium particle from slot s to t through the deformation increment `step` = I + dt C.

    `crowd` is the density around it over that at rest, `mean` the mean J; only water heeds them.
    """
    if ti.static(law == WATER):
        share = correction_share(inverse_spacing, dt, constants)
        history[t, w, q] = water_ratio(returned_ratio(history[s, w, q], mean, share), step.determinant(), crowd, share)
    else:
        trial = matmul(step, matmul(unpack(b[s, w, q]), step.transpose()))
        b_new, after, stress = 0.0 * trial, 0.0 * trial[0, 0], 0.0 * trial
        if ti.static(law == SNOW):
            b_new, after, stress = snow_update(trial, history[s, w, q], constants)
        else:
            b_new, after, stress = hencky_update(trial, history[s, w, q], constants, law)
        b[t, w, q] = pack(b_new)
        tau[t, w, q] = pack(stress)
        history[t, w, q] = after


@ti.func
def deform_medium_adjoint(
    b: ti.template(), history: ti.template(), b_adj: ti.template(), history_adj: ti.template(), tau_adj: ti.template(),
    s, w, q, step, crowd, mean, inverse_spacing, dt, constants, law: ti.template(),
):  # fmt: skip
    """Adjoint of `deform_medium`: updates the state's adjoints, returns those of `step`, `crowd` and `mean`."""
    step_pull, crowd_pull, mean_pull = 0.0 * step, 0.0 * dt, 0.0 * dt
    if ti.static(law == WATER):
        share = correction_share(inverse_spacing, dt, constants)
        J = history[s, w, q]
        J_pull, growth_pull, crowd_pull = water_ratio_adjoint(
            returned_ratio(J, mean, share), step.determinant(), crowd, share, history_adj[0, w, q]
        )
        history_adj[0, w, q], mean_pull = returned_ratio_adjoint(J, mean, share, J_pull)
        step_pull = growth_pull * cofactor(step)
    else:
        old = unpack(b[s, w, q])
        trial = matmul(step, matmul(old, step.transpose()))
        b_pull, tau_pull = unpack(b_adj[0, w, q]), unpack(tau_adj[0, w, q])
        pull, after = 0.0 * trial, 0.0 * trial[0, 0]
        if ti.static(law == SNOW):
            pull, after = snow_update_adjoint(
                trial, history[s, w, q], b_pull, history_adj[0, w, q], tau_pull, constants
            )
        else:
            pull, after = hencky_update_adjoint(
                trial, history[s, w, q], b_pull, history_adj[0, w, q], tau_pull, constants, law
            )
        step_pull = 2.0 * matmul(pull, matmul(step, old))
        b_adj[0, w, q] = pack(matmul(step.transpose(), matmul(pull, step)))
        history_adj[0, w, q] = after
    return step_pull, crowd_pull, mean_pull
