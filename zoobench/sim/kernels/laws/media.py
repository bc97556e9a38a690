"""Stress and deformation of a medium's particles by its `law`: isotropic functions of the left Cauchy-Green tensor b,
with their adjoints.

A law maps the trial b of a substep and one scalar of history to the elastic b, the new history and the Kirchhoff
stress. Near b = I it is computed by power series, without principal values, and so is its adjoint (`power_series`).
Elsewhere all three depend on b through its principal values and share its eigenvectors. In that eigenframe the adjoint
of such a function y is, besides the derivatives by the principal values on the diagonal, the divided difference
(y_i - y_j) / (b_i - b_j) off it (Daleckii and Krein 1965). Written without cancellation, these stay regular where
principal values meet, which is the state of rest; the adjoint of the eigenvectors has b_i - b_j in a denominator
instead (Giles 2008; Ionescu et al. 2015). Of a liquid J is the history, and b is not stored.
"""

import taichi as ti

from zoobench.sim.kernels.columns import (
    add,
    cofactor,
    determinant,
    diagonal,
    from_symmetric,
    matmul,
    matmul_transposed,
    scale,
    to_symmetric,
    trace,
    transpose,
    transposed_matmul,
)
from zoobench.sim.kernels.drift import relaxed_ratio, relaxed_ratio_adjoint
from zoobench.sim.kernels.laws.water import correction_share, water_ratio, water_ratio_adjoint
from zoobench.sim.kernels.layout import STRAIN, STRESS, C, add_columns, add_history, columns, history, symmetric


@ti.func
def shear_rate(a: ti.template()):
    """Deviator of the symmetric part of a velocity gradient [1/s]."""
    return add(scale(0.5, add(a, transpose(a))), diagonal(-trace(a) * (1.0 / 3.0)))


@ti.func
def medium_stress(c: ti.template(), p):
    """Kirchhoff stress [Pa] of a medium's particle at slot s, with 2 eta dev(D) where it is viscous."""
    stress = diagonal(0.0)
    if ti.static(c.variant.law.is_liquid):
        pressure, _ = c.variant.law.pressure(history(c.state, c.s, c.w, p), c.scene.medium)
        stress = diagonal(-pressure)
    else:
        stress = from_symmetric(symmetric(c.state, c.s, c.w, p, STRESS))
    if ti.static(c.variant.law.is_viscous):
        stress = add(stress, scale(2.0 * c.scene.medium.viscosity, shear_rate(columns(c.state, c.s, c.w, p, C))))
    return stress


@ti.func
def medium_stress_adjoint(c: ti.template(), p, tau_adjoint: ti.template()):
    """Adjoint of `medium_stress`: adds to those of C and J, sets that of the stored stress."""
    if ti.static(c.variant.law.is_liquid):
        _, derivative = c.variant.law.pressure(history(c.state, c.s, c.w, p), c.scene.medium)
        add_history(c.adjoint, 0, c.w, p, -derivative * trace(tau_adjoint))
    else:
        put_symmetric(c.adjoint, 0, c.w, p, STRESS, to_symmetric(tau_adjoint), 0.0)
    if ti.static(c.variant.law.is_viscous):
        add_columns(c.adjoint, 0, c.w, p, C, scale(2.0 * c.scene.medium.viscosity, shear_rate(tau_adjoint)))


@ti.func
def put_symmetric(rows: ti.template(), s, w, p, row: ti.template(), a, scalar):
    """Store a symmetric tensor (xx yy zz xy xz yz) and a scalar from a row on."""
    rows[s, w, p, row] = ti.Vector([a[0], a[1], a[2], a[3]])
    rows[s, w, p, row + 1] = ti.Vector([a[4], a[5], scalar, 0.0])


@ti.func
def elastic_trial(step: ti.template(), b: ti.template()):
    """S b S^T: F = S F_old in terms of b = F F^T, by which plasticity need not store F."""
    return matmul_transposed(matmul(step, b), step)


@ti.func
def deform_medium(c: ti.template(), p, step: ti.template(), rho, mean):
    """Carry a medium's particle from slot s to t through the deformation increment `step` = I + dt C.

    The relative density `rho` and the local `mean` of J act on a liquid alone.
    """
    if ti.static(c.variant.law.is_liquid):
        share = correction_share(c.scene.inverse, c.dt, c.scene.medium)
        J = water_ratio(relaxed_ratio(history(c.state, c.s, c.w, p), mean, share), determinant(step), rho, share)
        c.state[c.t, c.w, p, STRAIN + 1] = ti.Vector([0.0, 0.0, J, 0.0])
    else:
        trial = to_symmetric(elastic_trial(step, from_symmetric(symmetric(c.state, c.s, c.w, p, STRAIN))))
        b_new, after, stress = c.variant.law.update(trial, history(c.state, c.s, c.w, p), c.scene.medium, c.variant.law)
        put_symmetric(c.state, c.t, c.w, p, STRAIN, b_new, after)
        put_symmetric(c.state, c.t, c.w, p, STRESS, stress, 0.0)


@ti.func
def deform_medium_adjoint(c: ti.template(), p, step: ti.template(), rho, mean):
    """Adjoint of `deform_medium`: updates the state's adjoints, returns those of `step`, `rho` and `mean`."""
    step_adjoint, rho_adjoint, mean_adjoint = diagonal(0.0 * c.dt), 0.0 * c.dt, 0.0 * c.dt
    after_adjoint = history(c.adjoint, 0, c.w, p)
    if ti.static(c.variant.law.is_liquid):
        share = correction_share(c.scene.inverse, c.dt, c.scene.medium)
        J = history(c.state, c.s, c.w, p)
        J_adjoint, growth_adjoint, rho_adjoint = water_ratio_adjoint(
            relaxed_ratio(J, mean, share), determinant(step), rho, share, after_adjoint
        )
        J_adjoint, mean_adjoint = relaxed_ratio_adjoint(J, mean, share, J_adjoint)
        c.adjoint[0, c.w, p, STRAIN + 1] = ti.Vector([0.0, 0.0, J_adjoint, 0.0])
        step_adjoint = scale(growth_adjoint, cofactor(step))  # d det(A) = cof(A) : dA
    else:
        old = from_symmetric(symmetric(c.state, c.s, c.w, p, STRAIN))
        half = matmul(step, old)
        trial = to_symmetric(matmul_transposed(half, step))
        b_adjoint, tau_adjoint = symmetric(c.adjoint, 0, c.w, p, STRAIN), symmetric(c.adjoint, 0, c.w, p, STRESS)
        trial_adjoint, old_adjoint = c.variant.law.update_adjoint(
            trial, history(c.state, c.s, c.w, p), b_adjoint, after_adjoint, tau_adjoint, c.scene.medium, c.variant.law
        )
        # trial = S b S^T: 2 A S b by S and S^T A S by b, for the symmetric adjoint A of the trial
        turned = from_symmetric(trial_adjoint)
        step_adjoint = scale(2.0, matmul(turned, half))
        b_new_adjoint = to_symmetric(transposed_matmul(step, matmul(turned, step)))
        put_symmetric(c.adjoint, 0, c.w, p, STRAIN, b_new_adjoint, old_adjoint)
    return step_adjoint, rho_adjoint, mean_adjoint
