"""Constitutive laws of the media as isotropic functions of the left Cauchy-Green tensor b, with their adjoints.

A law maps the trial b of a substep and one scalar of history to the elastic b, the new history and the Kirchhoff
stress. All three depend on b through its principal values and share its eigenvectors. In that eigenframe the adjoint of
such a function y is, besides the derivatives by the principal values on the diagonal, the divided difference
(y_i - y_j) / (b_i - b_j) off it (Daleckii and Krein 1965). Written without cancellation, these stay regular where
principal values meet, which is the state of rest; the adjoint of the eigenvectors has b_i - b_j in a denominator
instead (Giles 2008; Ionescu et al. 2015). `constants` are (mu, lambda, then the law's own), as `matter` lists them.

    SAND  Drucker-Prager, Hencky strain (Klar et al. 2016), history: log-volume gained while loose
    CLAY  von Mises, Hencky strain, no history
    MUD   von Mises deviator with the pressure of a fluid, and viscous: Bingham-like beyond yield; no history
    SNOW  fixed corotated with clamped stretches and hardening (Stomakhin et al. 2013), history: plastic volume ratio
    WATER weakly compressible fluid, history: J; b is not stored
"""

import taichi as ti

from zoobench.sim.kernels.drift import relaxed_ratio, relaxed_ratio_adjoint
from zoobench.sim.kernels.linalg import assemble, cofactor, eigen_symmetric, identity, matmul, pack, sinhc, unpack
from zoobench.sim.kernels.water import correction_share, water_pressure, water_ratio, water_ratio_adjoint
from zoobench.sim.model.matter import LARGEST_PLASTIC, SMALLEST_PLASTIC, Law

SAND, CLAY, MUD, SNOW, WATER = (int(law) for law in (Law.SAND, Law.CLAY, Law.MUD, Law.SNOW, Law.WATER))

SMALLEST_SQUARE = 1e-12
"""Squared principal stretch below which its logarithm is held."""


@ti.func
def cone(constants):
    """Deviatoric Hencky strain at yield by compressive volumetric strain: alpha (3 lambda + 2 mu) / (2 mu).

    The Drucker-Prager cone (Klar et al. 2016); `SandMaterial.cone_slope` is alpha.
    """
    mu, lam, alpha = constants[0], constants[1], constants[2]
    return alpha * (3.0 * lam + 2.0 * mu) / (2.0 * mu)


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
        # tr(eps) >= 0: the tip of the cone, no stress (Klar et al. 2016); the volume gained there is used up before
        # pressure returns (Tampubolon et al. 2017)
        loose = volume >= 0.0
        left = volume
        limit = -cone(constants) * volume
    if not loose:
        left, keep = 0.0, 1.0
        size = deviator.norm()
        if size > limit:  # |dev tau| = 2 mu |dev eps| is beyond the cone (sand) or the yield stress (von Mises)
            keep = limit / size
        elastic = keep * deviator + volume / 3.0
    return elastic, left, keep


@ti.func
def radial_return_adjoint(strain, history, elastic_adjoint, left_adjoint, constants, law: ti.template()):
    """Adjoint of `radial_return` by strain and history, from those of the elastic strain and the new history."""
    volume = strain.sum() + history
    deviator = strain - strain.sum() / 3.0
    strain_adjoint, volume_adjoint = left_adjoint + 0.0 * strain, left_adjoint
    loose = False
    limit, slope = constants[2] / (2.0 * constants[0]), 0.0
    if ti.static(law == SAND):
        loose = volume >= 0.0
        slope = cone(constants)
        limit = -slope * volume
    if not loose:
        mean = elastic_adjoint.sum() / 3.0
        size = deviator.norm()
        keep, radial = 1.0, 0.0
        volume_adjoint = mean
        if size > limit:
            # elastic = limit n + volume / 3 with n = deviator / size: dn = (I - n n^T) d deviator / size, and for sand
            # d limit = -slope d volume
            keep = limit / size
            along = deviator.dot(elastic_adjoint) / size
            volume_adjoint = mean - slope * along
            radial = keep * along / size
        strain_adjoint = keep * (elastic_adjoint - mean) - radial * deviator + volume_adjoint
    return strain_adjoint, volume_adjoint


@ti.func
def spherical(volume, constants, law: ti.template()):
    """g and its derivative by the volumetric strain; the stress of a Hencky law is 2 mu eps + g(tr eps) I.

    For sand and clay g = lambda tr(eps). Mud has the pressure K (1 - J) of a fluid instead, and no tension.
    """
    g, derivative = constants[1] * volume, constants[1]
    if ti.static(law == MUD):
        mu, bulk = constants[0], constants[1] + 2.0 / 3.0 * constants[0]
        J = ti.exp(volume)
        g, derivative = -2.0 / 3.0 * mu * volume, -2.0 / 3.0 * mu
        if J < 1.0:
            g += bulk * J * (J - 1.0)
            derivative += bulk * J * (2.0 * J - 1.0)
    return g, derivative


@ti.func
def hencky_update(b, history, constants, law: ti.template()):
    """Elastic b, new history and Kirchhoff stress of sand, clay or mud, from eps = log(b) / 2."""
    squares, frame = eigen_symmetric(b)
    strain = 0.5 * ti.log(ti.max(squares, SMALLEST_SQUARE))
    elastic, left, _ = radial_return(strain, history, constants, law)
    g, _ = spherical(elastic.sum(), constants, law)
    return assemble(frame, ti.exp(2.0 * elastic)), left, assemble(frame, 2.0 * constants[0] * elastic + g)


@ti.func
def hencky_update_adjoint(b, history, b_adjoint, left_adjoint, tau_adjoint, constants, law: ti.template()):
    """Adjoint of `hencky_update` by the trial b and the old history, for symmetric adjoints of its results."""
    mu = constants[0]
    squares, frame = eigen_symmetric(b)
    strain = 0.5 * ti.log(ti.max(squares, SMALLEST_SQUARE))
    elastic, _, keep = radial_return(strain, history, constants, law)
    _, derivative = spherical(elastic.sum(), constants, law)
    transposed = frame.transpose()
    b_inner = matmul(transposed, matmul(b_adjoint, frame))
    tau_inner = matmul(transposed, matmul(tau_adjoint, frame))
    stretch, trial = ti.exp(elastic), ti.exp(strain)
    elastic_adjoint = 0.0 * strain
    for i in ti.static(range(3)):
        elastic_adjoint[i] = (
            2.0 * stretch[i] * stretch[i] * b_inner[i, i] + 2.0 * mu * tau_inner[i, i] + derivative * tau_inner.trace()
        )
    strain_adjoint, history_adjoint = radial_return_adjoint(
        strain, history, elastic_adjoint, left_adjoint, constants, law
    )
    inner = 0.0 * b
    for i in ti.static(range(3)):
        inner[i, i] = strain_adjoint[i] / (2.0 * trial[i] * trial[i])
        for j in ti.static(range(3)):
            if ti.static(i != j):
                # b_i - b_j = 2 s_i s_j sinhc(eps_i - eps_j) (eps_i - eps_j) with s = exp(eps), and the return scales
                # eps_i - eps_j by keep: the differences cancel in the quotient
                rise_b = 2.0 * stretch[i] * stretch[j] * sinhc(elastic[i] - elastic[j])
                run = 2.0 * trial[i] * trial[j] * sinhc(strain[i] - strain[j])
                inner[i, j] = keep * (rise_b * b_inner[i, j] + 2.0 * mu * tau_inner[i, j]) / run
    return matmul(frame, matmul(inner, transposed)), history_adjoint


@ti.func
def snow_stretch(stretch, plastic, constants):
    """Clamped principal stretches, and the plastic volume ratio before it is held within its bounds."""
    held = ti.min(ti.max(stretch, 1.0 - constants[2]), 1.0 + constants[3])
    ratio = (stretch[0] / held[0]) * (stretch[1] / held[1]) * (stretch[2] / held[2])
    return held, plastic * ratio


@ti.func
def snow_update(b, plastic, constants):
    """Elastic b, new plastic volume ratio and Kirchhoff stress of snow (Stomakhin et al. 2013)."""
    mu, lam = constants[0], constants[1]
    squares, frame = eigen_symmetric(b)
    held, grown = snow_stretch(ti.sqrt(ti.max(squares, SMALLEST_SQUARE)), plastic, constants)
    after = ti.min(ti.max(grown, SMALLEST_PLASTIC), LARGEST_PLASTIC)
    hardening = ti.exp(constants[4] * (1.0 - after))
    J = held[0] * held[1] * held[2]
    # fixed corotated: tau = 2 mu (F - R) F^T + lambda J (J - 1) I in principal values
    stress = hardening * (2.0 * mu * held * (held - 1.0) + lam * J * (J - 1.0))
    return assemble(frame, held * held), after, assemble(frame, stress)


@ti.func
def snow_update_adjoint(b, plastic, b_adjoint, new_plastic_adjoint, tau_adjoint, constants):
    """Adjoint of `snow_update` by the trial b and the old plastic volume ratio, for adjoints that are symmetric."""
    mu, lam, low, high = constants[0], constants[1], 1.0 - constants[2], 1.0 + constants[3]
    squares, frame = eigen_symmetric(b)
    stretch = ti.sqrt(ti.max(squares, SMALLEST_SQUARE))
    held, grown = snow_stretch(stretch, plastic, constants)
    after = ti.min(ti.max(grown, SMALLEST_PLASTIC), LARGEST_PLASTIC)
    hardening = ti.exp(constants[4] * (1.0 - after))
    J = held[0] * held[1] * held[2]
    transposed = frame.transpose()
    b_inner = matmul(transposed, matmul(b_adjoint, frame))
    tau_inner = matmul(transposed, matmul(tau_adjoint, frame))
    soft = 2.0 * mu * held * (held - 1.0) + lam * J * (J - 1.0)
    work = tau_inner[0, 0] * soft[0] + tau_inner[1, 1] * soft[1] + tau_inner[2, 2] * soft[2]
    after_adjoint = new_plastic_adjoint - constants[4] * hardening * work
    grown_adjoint = 0.0 * after_adjoint  # while the ratio is held at a bound its derivative is zero
    if grown > SMALLEST_PLASTIC and grown < LARGEST_PLASTIC:
        grown_adjoint = after_adjoint
    volume_adjoint = hardening * lam * (2.0 * J - 1.0) * tau_inner.trace()
    inner = 0.0 * b
    for i in ti.static(range(3)):
        held_adjoint = 2.0 * held[i] * b_inner[i, i] + hardening * 2.0 * mu * (2.0 * held[i] - 1.0) * tau_inner[i, i]
        held_adjoint += (volume_adjoint * J - grown_adjoint * grown) / held[i]
        stretch_adjoint = grown_adjoint * grown / stretch[i]
        if stretch[i] > low and stretch[i] < high:
            stretch_adjoint += held_adjoint
        inner[i, i] = stretch_adjoint / (2.0 * stretch[i])  # stretch = sqrt(b)
        for j in ti.static(range(3)):
            if ti.static(i != j):
                # h for held, s for stretch: that of b is (h_i^2 - h_j^2) / (s_i^2 - s_j^2), that of the stress
                # 2 mu (h_i - h_j) (h_i + h_j - 1) / (s_i^2 - s_j^2)
                gap = stretch[i] - stretch[j]
                divided = 0.0  # of the clamp; at equal stretches its derivative
                if ti.abs(gap) > 1e-6 * stretch[i]:
                    divided = (held[i] - held[j]) / gap
                elif stretch[i] > low and stretch[i] < high:
                    divided = 1.0
                both = held[i] + held[j]
                rise = both * b_inner[i, j] + hardening * 2.0 * mu * (both - 1.0) * tau_inner[i, j]
                inner[i, j] = divided * rise / (stretch[i] + stretch[j])
    return matmul(frame, matmul(inner, transposed)), grown_adjoint * grown / plastic


@ti.func
def shear_rate(C):
    """Deviator of the symmetric part of the velocity gradient [1/s]."""
    return 0.5 * (C + C.transpose()) - C.trace() / 3.0 * identity()


@ti.func
def medium_stress(
    tau: ti.template(), history: ti.template(), C: ti.template(), s, w, q, p, constants, law: ti.template()
):  # fmt: skip
    """Kirchhoff stress [Pa] of medium particle q (p among all) at slot s, with 2 eta dev(D) of a fluid."""
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
    s, w, q, p, tau_adjoint, constants, law: ti.template(),
):  # fmt: skip
    """Adjoint of `medium_stress`: adds to those of C and J, sets that of tau."""
    if ti.static(law == WATER):
        _, derivative = water_pressure(history[s, w, q], constants)
        history_adj[0, w, q] -= derivative * tau_adjoint.trace()
    else:
        tau_adj[0, w, q] = pack(tau_adjoint)
    if ti.static(law in (MUD, WATER)):
        C_adj[0, w, p] += 2.0 * constants[4] * shear_rate(tau_adjoint)


@ti.func
def deform_medium(
    b: ti.template(), history: ti.template(), tau: ti.template(), s, t, w, q, step, rho, mean, inverse_spacing, dt,
    constants, law: ti.template(),
):  # fmt: skip
    """Carry a medium particle from slot s to t through the deformation increment `step` = I + dt C.

    The relative density `rho` and the local `mean` of J act on water alone.
    """
    if ti.static(law == WATER):
        share = correction_share(inverse_spacing, dt, constants)
        history[t, w, q] = water_ratio(relaxed_ratio(history[s, w, q], mean, share), step.determinant(), rho, share)
    else:
        # F = (I + dt C) F_old in terms of b = F F^T: the elastic trial, by which plasticity need not store F
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
    s, w, q, step, rho, mean, inverse_spacing, dt, constants, law: ti.template(),
):  # fmt: skip
    """Adjoint of `deform_medium`: updates the state's adjoints, returns those of `step`, `rho` and `mean`."""
    step_adjoint, rho_adjoint, mean_adjoint = 0.0 * step, 0.0 * dt, 0.0 * dt
    if ti.static(law == WATER):
        share = correction_share(inverse_spacing, dt, constants)
        J = history[s, w, q]
        J_adjoint, growth_adjoint, rho_adjoint = water_ratio_adjoint(
            relaxed_ratio(J, mean, share), step.determinant(), rho, share, history_adj[0, w, q]
        )
        history_adj[0, w, q], mean_adjoint = relaxed_ratio_adjoint(J, mean, share, J_adjoint)
        step_adjoint = growth_adjoint * cofactor(step)  # d det(A) = cof(A) : dA
    else:
        old = unpack(b[s, w, q])
        trial = matmul(step, matmul(old, step.transpose()))
        b_adjoint, tau_adjoint = unpack(b_adj[0, w, q]), unpack(tau_adj[0, w, q])
        trial_adjoint, old_adjoint = 0.0 * trial, 0.0 * trial[0, 0]
        if ti.static(law == SNOW):
            trial_adjoint, old_adjoint = snow_update_adjoint(
                trial, history[s, w, q], b_adjoint, history_adj[0, w, q], tau_adjoint, constants
            )
        else:
            trial_adjoint, old_adjoint = hencky_update_adjoint(
                trial, history[s, w, q], b_adjoint, history_adj[0, w, q], tau_adjoint, constants, law
            )
        # trial = S b S^T: 2 A S b by S and S^T A S by b, for the symmetric adjoint A of the trial
        step_adjoint = 2.0 * matmul(trial_adjoint, matmul(step, old))
        b_adj[0, w, q] = pack(matmul(step.transpose(), matmul(trial_adjoint, step)))
        history_adj[0, w, q] = old_adjoint
    return step_adjoint, rho_adjoint, mean_adjoint
