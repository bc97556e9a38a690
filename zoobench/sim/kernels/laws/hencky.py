"""What sand, clay and mud share: elasticity in Hencky strain log(b) / 2, radial return onto the yield surface of `law`,
and its adjoint.

Near b = I, where beds in use stay, logarithm and exponential are power series: the return needs the trace and the norm
of the strain alone, and the adjoint is the same program in reverse. Elsewhere the eigenvectors of b are found, and the
adjoint is that of an isotropic function as `media` has it. Symmetric tensors are 6-vectors as in `symmetric`.
"""

import taichi as ti

from zoobench.sim.kernels.power_series import EXPONENTIAL, HALF_LOGARITHM, NEAR, by_precision, series, series_adjoint
from zoobench.sim.kernels.symmetric import (
    deviator,
    double_dot,
    dyad,
    eigen_symmetric,
    invariants,
    sinhc,
    square,
    trace_of,
    unit,
)

SMALLEST_SQUARE = 1e-12
"""Squared principal stretch below which its logarithm is held."""


@ti.func
def constant_deviator(volume, medium: ti.template()):
    """Norm of the deviatoric strain at a yield stress (von Mises)."""
    return medium.yield_stress / (2.0 * medium.mu)


@ti.func
def no_steepness(medium: ti.template()):
    """Of a yield surface that does not depend on the volume."""
    return 0.0


@ti.func
def linear_pressure(volume, medium: ti.template()):
    """lambda tr(eps), and its derivative."""
    return medium.lam * volume, medium.lam


@ti.func
def radial_return(volume, size, medium: ti.template(), law: ti.template()):
    """Ratio of the deviator kept at volumetric strain `volume` and deviator norm `size`, and the new history.

    The ratio scales the deviator back onto the yield surface: 1 elastic, 0 loose.
    """
    keep, left = 1.0 + 0.0 * volume, 0.0 * volume
    limit = law.surface.largest_deviator(volume, medium)
    if size > limit:
        keep = limit / size
    if ti.static(law.surface.is_loose_in_tension):
        if volume >= 0.0:
            keep, left = 0.0, volume
    return keep, left


@ti.func
def radial_return_adjoint(volume, size, along, mean, left_adjoint, medium: ti.template(), law: ti.template()):
    """Adjoints of elastic = keep deviator + volume / 3 I, by that of the elastic strain, A, and of the new history.

    `along` is deviator : A and `mean` tr(A) / 3. Returns keep and r of the deviator's adjoint keep dev(A) - r deviator,
    and the adjoint of the volume.
    """
    keep, radial, volume_adjoint = 1.0 + 0.0 * volume, 0.0 * volume, mean
    limit, slope = law.surface.largest_deviator(volume, medium), law.surface.steepness(medium)
    if size > limit:
        # elastic = limit n + volume / 3 with n = deviator / size: dn = (I - n n^T) d deviator / size, and
        # d limit = -slope d volume
        keep = limit / size
        radial = keep * along / (size * size)
        volume_adjoint -= slope * along / size
    if ti.static(law.surface.is_loose_in_tension):
        if volume >= 0.0:
            keep, radial, volume_adjoint = 0.0, 0.0, left_adjoint
    return keep, radial, volume_adjoint


@ti.func
def hencky_update(trial, history, medium: ti.template(), law: ti.template()):
    """Elastic b, new history and Kirchhoff stress [Pa] from the trial b."""
    E = trial - unit()
    b, left, tau = trial, 0.0 * history, 0.0 * trial
    if double_dot(E, E) < NEAR * NEAR:
        b, left, tau = _update_near(trial, history, medium, law)
    else:
        b, left, tau = _update_far(trial, history, medium, law)
    return b, left, tau


@ti.func
def hencky_update_adjoint(
    trial, history, b_adjoint, left_adjoint, tau_adjoint, medium: ti.template(), law: ti.template()
):
    """Adjoint of `hencky_update` by the trial b and the old history."""
    E = trial - unit()
    trial_adjoint, history_adjoint = 0.0 * trial, 0.0 * history
    if double_dot(E, E) < NEAR * NEAR:
        trial_adjoint, history_adjoint = _update_near_adjoint(
            trial, history, b_adjoint, left_adjoint, tau_adjoint, medium, law
        )
    else:
        trial_adjoint, history_adjoint = _update_far_adjoint(
            trial, history, b_adjoint, left_adjoint, tau_adjoint, medium, law
        )
    return trial_adjoint, history_adjoint


@ti.func
def _half_logarithm(E, E2, inv):
    """Deviator and trace of the Hencky strain log(I + E) / 2."""
    c = series(inv, ti.static(by_precision(HALF_LOGARITHM)))
    return deviator(c[1] * E + c[2] * E2), 3.0 * c[0] + c[1] * trace_of(E) + c[2] * trace_of(E2)


@ti.func
def _update_near(trial, history, medium: ti.template(), law: ti.template()):
    """`hencky_update` by series."""
    E = trial - unit()
    strain, total = _half_logarithm(E, square(E), invariants(E))
    volume = total + history
    size = ti.sqrt(double_dot(strain, strain))
    keep, left = radial_return(volume, size, medium, law)
    b, tau = unit(), 0.0 * trial
    if ti.static(not law.surface.is_loose_in_tension) or volume < 0.0:
        elastic = keep * strain
        g, _ = law.surface.spherical(volume, medium)
        tau = 2.0 * medium.mu * elastic + (2.0 / 3.0 * medium.mu * volume + g) * unit()
        b = trial
        if keep < 1.0 or history != 0.0:
            X = 2.0 * elastic
            c = series(invariants(X), ti.static(by_precision(EXPONENTIAL)))
            b = ti.exp(2.0 / 3.0 * volume) * (c[0] * unit() + c[1] * X + c[2] * square(X))
    return b, left, tau


@ti.func
def _update_near_adjoint(
    trial, history, b_adjoint, left_adjoint, tau_adjoint, medium: ti.template(), law: ti.template()
):
    """Adjoint of `_update_near`."""
    E = trial - unit()
    E2, inv = square(E), invariants(E)
    strain, total = _half_logarithm(E, E2, inv)
    volume = total + history
    size = ti.sqrt(double_dot(strain, strain))
    keep, _ = radial_return(volume, size, medium, law)
    direct, elastic_adjoint = 0.0 * trial, 0.0 * trial
    mean, history_adjoint = 0.0 * volume, 0.0 * volume
    if ti.static(not law.surface.is_loose_in_tension) or volume < 0.0:
        _, derivative = law.surface.spherical(volume, medium)
        elastic_adjoint = 2.0 * medium.mu * tau_adjoint
        mean = (2.0 / 3.0 * medium.mu + derivative) * trace_of(tau_adjoint)
        if keep < 1.0 or history != 0.0:
            # b = exp(2/3 volume) exp(X) with X = 2 keep strain
            X = 2.0 * keep * strain
            X2, X_inv, growth = square(X), invariants(X), ti.exp(2.0 / 3.0 * volume)
            c = series(X_inv, ti.static(by_precision(EXPONENTIAL)))
            b = growth * (c[0] * unit() + c[1] * X + c[2] * X2)
            mean += 2.0 / 3.0 * double_dot(b, b_adjoint)
            elastic_adjoint += (2.0 * growth) * series_adjoint(
                X, X2, X_inv, ti.static(by_precision(EXPONENTIAL)), b_adjoint
            )
        else:
            direct = b_adjoint
            history_adjoint = 2.0 / 3.0 * double_dot(trial, b_adjoint)
    along = double_dot(strain, elastic_adjoint)
    keep, radial, volume_adjoint = radial_return_adjoint(volume, size, along, mean, left_adjoint, medium, law)
    strain_adjoint = deviator(keep * elastic_adjoint) - radial * strain + volume_adjoint * unit()
    E_adjoint = series_adjoint(E, E2, inv, ti.static(by_precision(HALF_LOGARITHM)), strain_adjoint)
    return direct + E_adjoint, history_adjoint + volume_adjoint


@ti.func
def _principal_strain(squares):
    """Hencky strains of squared principal stretches; by element, as native vectors have no logarithm."""
    return ti.Vector([0.5 * ti.log(ti.max(squares[i], SMALLEST_SQUARE)) for i in range(3)])


@ti.func
def _exponential(x):
    """exp of each of three numbers."""
    return ti.Vector([ti.exp(x[i]) for i in range(3)])


@ti.func
def _principal_return(strain, history, medium: ti.template(), law: ti.template()):
    """Elastic principal strains, new history and the ratio of the deviator kept, from principal trial strains."""
    volume = strain.sum() + history
    shear = strain - strain.sum() / 3.0
    keep, left = radial_return(volume, shear.norm(), medium, law)
    return keep * shear + (volume - left) / 3.0, left, keep


@ti.func
def _update_far(trial, history, medium: ti.template(), law: ti.template()):
    """`hencky_update` by eigenvectors."""
    squares, frame = eigen_symmetric(trial)
    strain = _principal_strain(squares)
    elastic, left, _ = _principal_return(strain, history, medium, law)
    g, _ = law.surface.spherical(elastic.sum(), medium)
    squared, stress = _exponential(2.0 * elastic), 2.0 * medium.mu * elastic + g
    b, tau = 0.0 * trial, 0.0 * trial
    for i in ti.static(range(3)):
        across = dyad(frame, i, i)
        b += squared[i] * across
        tau += stress[i] * across
    return b, left, tau


@ti.func
def _update_far_adjoint(
    trial, history, b_adjoint, left_adjoint, tau_adjoint, medium: ti.template(), law: ti.template()
):
    """Adjoint of `_update_far`."""
    squares, frame = eigen_symmetric(trial)
    strain = _principal_strain(squares)
    elastic, _, keep = _principal_return(strain, history, medium, law)
    _, derivative = law.surface.spherical(elastic.sum(), medium)
    old, new = _exponential(strain), _exponential(elastic)
    stress_adjoint = 2.0 * medium.mu * tau_adjoint
    elastic_adjoint = derivative * trace_of(tau_adjoint) + 0.0 * strain
    for i in ti.static(range(3)):
        elastic_adjoint[i] += double_dot(2.0 * new[i] * new[i] * b_adjoint + stress_adjoint, dyad(frame, i, i))
    shear, mean = strain - strain.sum() / 3.0, elastic_adjoint.sum() / 3.0
    _, radial, volume_adjoint = radial_return_adjoint(
        strain.sum() + history, shear.norm(), shear.dot(elastic_adjoint), mean, left_adjoint, medium, law
    )
    strain_adjoint = keep * (elastic_adjoint - mean) - radial * shear + volume_adjoint
    trial_adjoint = 0.0 * trial
    for i in ti.static(range(3)):
        trial_adjoint += strain_adjoint[i] / (2.0 * old[i] * old[i]) * dyad(frame, i, i)
    for i, j in ti.static(((0, 1), (0, 2), (1, 2))):
        # b_i - b_j = 2 s_i s_j sinhc(eps_i - eps_j) (eps_i - eps_j) with s = exp(eps), and the return scales
        # eps_i - eps_j by keep: the differences cancel in the quotient
        rise = 2.0 * new[i] * new[j] * sinhc(elastic[i] - elastic[j])
        run = old[i] * old[j] * sinhc(strain[i] - strain[j])
        across = dyad(frame, i, j)
        trial_adjoint += keep / run * double_dot(rise * b_adjoint + stress_adjoint, across) * across
    return trial_adjoint, volume_adjoint
