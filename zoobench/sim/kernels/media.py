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

from zoobench.sim.kernels.corotated import snow_update, snow_update_adjoint
from zoobench.sim.kernels.drift import relaxed_ratio, relaxed_ratio_adjoint
from zoobench.sim.kernels.hencky import hencky_update, hencky_update_adjoint
from zoobench.sim.kernels.linalg import cofactor, identity, matmul, pack, unpack
from zoobench.sim.kernels.water import correction_share, water_pressure, water_ratio, water_ratio_adjoint
from zoobench.sim.model.matter import Law

SAND, CLAY, MUD, SNOW, WATER = (int(law) for law in (Law.SAND, Law.CLAY, Law.MUD, Law.SNOW, Law.WATER))


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
        b_new, after, stress = pack(trial), 0.0 * trial[0, 0], pack(trial)
        if ti.static(law == SNOW):
            b_new, after, stress = snow_update(pack(trial), history[s, w, q], constants)
        else:
            b_new, after, stress = hencky_update(pack(trial), history[s, w, q], constants, law)
        b[t, w, q] = b_new
        tau[t, w, q] = stress
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
        packed_adjoint, old_adjoint = pack(trial), 0.0 * trial[0, 0]
        if ti.static(law == SNOW):
            packed_adjoint, old_adjoint = snow_update_adjoint(
                pack(trial), history[s, w, q], b_adj[0, w, q], history_adj[0, w, q], tau_adj[0, w, q], constants
            )
        else:
            packed_adjoint, old_adjoint = hencky_update_adjoint(
                pack(trial), history[s, w, q], b_adj[0, w, q], history_adj[0, w, q], tau_adj[0, w, q], constants, law
            )
        trial_adjoint = unpack(packed_adjoint)
        # trial = S b S^T: 2 A S b by S and S^T A S by b, for the symmetric adjoint A of the trial
        step_adjoint = 2.0 * matmul(trial_adjoint, matmul(step, old))
        b_adj[0, w, q] = pack(matmul(step.transpose(), matmul(trial_adjoint, step)))
        history_adj[0, w, q] = old_adjoint
    return step_adjoint, rho_adjoint, mean_adjoint
