"""Constitutive laws of the robot as pure functions for kernels, with their adjoints; NumPy twins in `laws.elastic`.

Matrices are triples of columns (`columns`). Stresses are Kirchhoff stresses tau = J sigma [Pa]. An adjoint takes the
adjoint of the stress, symmetric, and returns those of the law's arguments.
"""

import taichi as ti

from zoobench.sim.kernels.columns import (
    add,
    cofactor,
    determinant,
    diagonal,
    dot,
    matmul,
    matmul_transposed,
    matvec,
    outer,
    scale,
    trace,
    transpose,
    transposed_matvec,
)

SMALLEST_J = 0.05
"""J below which log J is held, so that an inverted particle does not make everything NaN; the survey counts them."""


@ti.func
def neo_hookean(F: ti.template(), mu, lam):
    """tau = mu (F F^T - I) + lambda log(J) I, zero at rest: neo-Hookean (Bonet and Wood 2008, sec. 6.4.3)."""
    log_j = ti.log(ti.max(determinant(F), SMALLEST_J))
    return add(matmul_transposed(scale(mu, F), F), diagonal(lam * log_j - mu))


@ti.func
def neo_hookean_adjoint(F: ti.template(), tau_adjoint: ti.template(), mu, lam):
    """Adjoint of `neo_hookean` by F."""
    J = determinant(F)
    volumetric = 0.0  # while log J is held its derivative is zero
    if J > SMALLEST_J:
        volumetric = lam * trace(tau_adjoint) / J
    # d(F F^T) gives (A + A^T) F = 2 A F for a symmetric A; d log J = F^-T = cof(F) / J
    return add(scale(2.0 * mu, matmul(tau_adjoint, F)), scale(volumetric, cofactor(F)))


@ti.func
def fibre_stress(F: ti.template(), tension, fibre):
    """Active stress tension (F d)(F d)^T along the unit rest direction d.

    The tension [Pa] is muscle strength times actuation, and may be negative: a muscle can push.
    """
    stretched = matvec(F, fibre)
    return outer(tension * stretched, stretched)


@ti.func
def fibre_stress_adjoint(F: ti.template(), tau_adjoint: ti.template(), tension, fibre):
    """Adjoint of `fibre_stress` by F, the tension and the fibre."""
    stretched = matvec(F, fibre)
    turned = matvec(tau_adjoint, stretched)
    stretched_adjoint = (2.0 * tension) * turned
    return outer(stretched_adjoint, fibre), dot(stretched, turned), transposed_matvec(F, stretched_adjoint)


@ti.func
def viscous(C: ti.template(), eta):
    """Kelvin-Voigt stress 2 eta D, D the symmetric part of the velocity gradient C [1/s]; it is its own adjoint."""
    return scale(eta, add(C, transpose(C)))
