"""Snow: fixed corotated elasticity with clamped principal stretches and hardening (Stomakhin et al. 2013); history:
plastic volume ratio.

Where every principal stretch is inside the clamp, sqrt(b) is a power series near b = I; else the eigenvectors of b are
found. Symmetric tensors are 6-vectors as in `symmetric`.
"""

import taichi as ti

from zoobench.sim.kernels.laws.hencky import SMALLEST_SQUARE
from zoobench.sim.kernels.laws.law import Law
from zoobench.sim.kernels.power_series import NEAR, ROOT, by_precision, series, series_adjoint
from zoobench.sim.kernels.symmetric import (
    deviator,
    double_dot,
    dyad,
    eigen_symmetric,
    invariants,
    square,
    trace_of,
    unit,
)
from zoobench.sim.model.laws.snow import LARGEST_PLASTIC, SMALLEST_PLASTIC, SnowMaterial


@ti.func
def hardening(plastic, medium: ti.template()):
    """Plastic volume ratio held within its bounds, and the ratio of the moduli to those of virgin snow."""
    after = ti.min(ti.max(plastic, SMALLEST_PLASTIC), LARGEST_PLASTIC)
    return after, ti.exp(medium.hardening * (1.0 - after))


@ti.func
def certainly_inside(E, medium: ti.template()):
    """Whether the series hold and no principal stretch of b = I + E can be at the clamp.

    Eigenvalues of a symmetric 3x3 matrix are within sqrt(2/3) |dev E| of their mean.
    """
    shear = deviator(E)
    mean, reach = 1.0 + trace_of(E) / 3.0, ti.sqrt(2.0 / 3.0 * double_dot(shear, shear))
    low, high = 1.0 - medium.critical_compression, 1.0 + medium.critical_stretch
    return double_dot(E, E) < NEAR * NEAR and mean - reach > low * low and mean + reach < high * high


@ti.func
def snow_update(trial, plastic, medium: ti.template(), law: ti.template()):
    """Elastic b, new plastic volume ratio and Kirchhoff stress [Pa] from the trial b (Stomakhin et al. 2013)."""
    b, after, tau = trial, 0.0 * plastic, 0.0 * trial
    if certainly_inside(trial - unit(), medium):
        after, tau = _elastic_near(trial, plastic, medium)
    else:
        b, after, tau = _update_far(trial, plastic, medium)
    return b, after, tau


@ti.func
def snow_update_adjoint(
    trial, plastic, b_adjoint, after_adjoint, tau_adjoint, medium: ti.template(), law: ti.template()
):
    """Adjoint of `snow_update` by the trial b and the old plastic volume ratio."""
    trial_adjoint, plastic_adjoint = 0.0 * trial, 0.0 * plastic
    if certainly_inside(trial - unit(), medium):
        trial_adjoint, plastic_adjoint = _elastic_near_adjoint(trial, plastic, after_adjoint, tau_adjoint, medium)
        trial_adjoint += b_adjoint
    else:
        trial_adjoint, plastic_adjoint = _update_far_adjoint(
            trial, plastic, b_adjoint, after_adjoint, tau_adjoint, medium
        )
    return trial_adjoint, plastic_adjoint


@ti.func
def _soft_stress(E, medium: ti.template()):
    """Kirchhoff stress of virgin snow, 2 mu (b - V) + lambda J (J - 1) I with V = sqrt(b), and J, from E = b - I."""
    inv = invariants(E)
    c = series(inv, ti.static(by_precision(ROOT)))
    growth = inv[0] + inv[1] + inv[2]  # det(b) - 1
    J = ti.sqrt(1.0 + growth)
    pressure = medium.lam * J * growth / (1.0 + J)
    shear = E - (c[0] * unit() + c[1] * E + c[2] * square(E))
    return 2.0 * medium.mu * shear + pressure * unit(), J


@ti.func
def _elastic_near(trial, plastic, medium: ti.template()):
    """New plastic volume ratio and stress by the series; b stays the trial."""
    after, harder = hardening(plastic, medium)
    soft, _ = _soft_stress(trial - unit(), medium)
    return after, harder * soft


@ti.func
def _elastic_near_adjoint(trial, plastic, after_adjoint, tau_adjoint, medium: ti.template()):
    """Adjoint of `_elastic_near`."""
    E = trial - unit()
    inv = invariants(E)
    _, harder = hardening(plastic, medium)
    soft, J = _soft_stress(E, medium)
    plastic_adjoint = 0.0 * plastic  # while the ratio is held at a bound its derivative is zero
    if plastic > SMALLEST_PLASTIC and plastic < LARGEST_PLASTIC:
        plastic_adjoint = after_adjoint - medium.hardening * harder * double_dot(tau_adjoint, soft)
    soft_adjoint = harder * tau_adjoint
    shear_adjoint = 2.0 * medium.mu * soft_adjoint
    # J (J - 1) = J^2 - J, dJ = dJ^2 / (2 J) and d det(b) = cof(b) : db
    growth_adjoint = medium.lam * (1.0 - 0.5 / J) * trace_of(soft_adjoint)
    E2 = square(E)
    # cof(I + E) = (1 + I1 + I2) I - (1 + I1) E + E^2
    cofactor = (1.0 + inv[0] + inv[1]) * unit() - (1.0 + inv[0]) * E + E2
    root_adjoint = series_adjoint(E, E2, inv, ti.static(by_precision(ROOT)), shear_adjoint)
    return shear_adjoint - root_adjoint + growth_adjoint * cofactor, plastic_adjoint


@ti.func
def _principal_stretch(squares):
    """Principal stretches of their squares; by element, as native vectors have no root."""
    return ti.Vector([ti.sqrt(ti.max(squares[i], SMALLEST_SQUARE)) for i in range(3)])


@ti.func
def _clamped(stretch, plastic, medium: ti.template()):
    """Clamped principal stretches, and the plastic volume ratio before it is held within its bounds."""
    low, high = 1.0 - medium.critical_compression, 1.0 + medium.critical_stretch
    held = ti.Vector([ti.min(ti.max(stretch[i], low), high) for i in range(3)])
    ratio = (stretch[0] / held[0]) * (stretch[1] / held[1]) * (stretch[2] / held[2])
    return held, plastic * ratio


@ti.func
def _update_far(trial, plastic, medium: ti.template()):
    """`snow_update` by eigenvectors."""
    mu, lam = medium.mu, medium.lam
    squares, frame = eigen_symmetric(trial)
    held, grown = _clamped(_principal_stretch(squares), plastic, medium)
    after, harder = hardening(grown, medium)
    J = held[0] * held[1] * held[2]
    # fixed corotated: tau = 2 mu (F - R) F^T + lambda J (J - 1) I in principal values
    stress = harder * (2.0 * mu * held * (held - 1.0) + lam * J * (J - 1.0))
    b, tau = 0.0 * trial, 0.0 * trial
    for i in ti.static(range(3)):
        across = dyad(frame, i, i)
        b += held[i] * held[i] * across
        tau += stress[i] * across
    return b, after, tau


@ti.func
def _update_far_adjoint(trial, plastic, b_adjoint, new_plastic_adjoint, tau_adjoint, medium: ti.template()):
    """Adjoint of `_update_far`."""
    mu, lam, low, high = medium.mu, medium.lam, 1.0 - medium.critical_compression, 1.0 + medium.critical_stretch
    squares, frame = eigen_symmetric(trial)
    stretch = _principal_stretch(squares)
    held, grown = _clamped(stretch, plastic, medium)
    _, harder = hardening(grown, medium)
    J = held[0] * held[1] * held[2]
    soft = 2.0 * mu * held * (held - 1.0) + lam * J * (J - 1.0)
    soft_adjoint = harder * tau_adjoint
    work = 0.0 * J
    for i in ti.static(range(3)):
        work += double_dot(soft_adjoint, dyad(frame, i, i)) * soft[i]
    after_adjoint = new_plastic_adjoint - medium.hardening * work
    grown_adjoint = 0.0 * after_adjoint  # while the ratio is held at a bound its derivative is zero
    if grown > SMALLEST_PLASTIC and grown < LARGEST_PLASTIC:
        grown_adjoint = after_adjoint
    volume_adjoint = lam * (2.0 * J - 1.0) * trace_of(soft_adjoint)
    trial_adjoint = 0.0 * trial
    for i in ti.static(range(3)):
        across = dyad(frame, i, i)
        held_adjoint = double_dot(2.0 * held[i] * b_adjoint + 2.0 * mu * (2.0 * held[i] - 1.0) * soft_adjoint, across)
        held_adjoint += (volume_adjoint * J - grown_adjoint * grown) / held[i]
        stretch_adjoint = grown_adjoint * grown / stretch[i]
        if stretch[i] > low and stretch[i] < high:
            stretch_adjoint += held_adjoint
        trial_adjoint += stretch_adjoint / (2.0 * stretch[i]) * across  # stretch = sqrt(b)
    for i, j in ti.static(((0, 1), (0, 2), (1, 2))):
        # h for held, s for stretch: that of b is (h_i^2 - h_j^2) / (s_i^2 - s_j^2), that of the stress
        # 2 mu (h_i - h_j) (h_i + h_j - 1) / (s_i^2 - s_j^2)
        gap, both = stretch[i] - stretch[j], held[i] + held[j]
        divided = 0.0  # of the clamp; at equal stretches its derivative
        if ti.abs(gap) > 1e-6 * stretch[i]:
            divided = (held[i] - held[j]) / gap
        elif stretch[i] > low and stretch[i] < high:
            divided = 1.0
        across = dyad(frame, i, j)
        rise = double_dot(both * b_adjoint + 2.0 * mu * (both - 1.0) * soft_adjoint, across)
        trial_adjoint += 2.0 * divided * rise / (stretch[i] + stretch[j]) * across
    return trial_adjoint, grown_adjoint * grown / plastic


@ti.func
def snow_kappa(plastic, medium: ti.template()):
    """At its present hardening and largest elastic stretch [Pa].

    The derivative of the corotated stress by log stretch, equal in all directions, at s = 1 + theta_s.
    """
    s = 1.0 + medium.critical_stretch
    soft = 2.0 * medium.mu * (2.0 * s - 1.0) * s + 3.0 * medium.lam * (2.0 * s**3 - 1.0) * s**3
    return ti.exp(medium.hardening * (1.0 - plastic)) * soft


LAW = Law(SnowMaterial.constants, snow_kappa, snow_update, snow_update_adjoint)
