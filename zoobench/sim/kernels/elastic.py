"""Constitutive laws of the robot as pure functions for kernels, with their adjoints; NumPy twins in `laws_numpy`.

Stresses are Kirchhoff stresses tau = J sigma [Pa]. An adjoint takes the adjoint of the stress, symmetric, and returns
those of the law's arguments.
"""

import taichi as ti

from zoobench.sim.kernels.linalg import cofactor, identity, matmul, matvec, outer

SMALLEST_J = 0.05
"""J below which log J is held, so that an inverted particle does not make everything NaN; the survey counts them."""


@ti.func
def neo_hookean(F, mu, lam):
    """tau = mu (F F^T - I) + lambda log(J) I, zero at rest: neo-Hookean (Bonet and Wood 2008, sec. 6.4.3)."""
    log_j = ti.log(ti.max(F.determinant(), SMALLEST_J))
    return mu * matmul(F, F.transpose()) + (lam * log_j - mu) * identity()


@ti.func
def neo_hookean_adjoint(F, tau_adjoint, mu, lam):
    """Adjoint of `neo_hookean` by F."""
    J = F.determinant()
    volumetric = 0.0  # while log J is held its derivative is zero
    if J > SMALLEST_J:
        volumetric = lam * tau_adjoint.trace() / J
    # d(F F^T) gives (A + A^T) F = 2 A F for a symmetric A; d log J = F^-T = cof(F) / J
    return (2.0 * mu) * matmul(tau_adjoint, F) + volumetric * cofactor(F)


@ti.func
def fibre_stress(F, tension, fibre):
    """Active stress tension (F d)(F d)^T along the unit rest direction d.

    The tension [Pa] is muscle strength times actuation, and may be negative: a muscle can push.
    """
    stretched = matvec(F, fibre)
    return tension * outer(stretched, stretched)


@ti.func
def fibre_stress_adjoint(F, tau_adjoint, tension, fibre):
    """Adjoint of `fibre_stress` by F, the tension and the fibre."""
    stretched = matvec(F, fibre)
    turned = matvec(tau_adjoint, stretched)
    stretched_adjoint = (2.0 * tension) * turned
    return outer(stretched_adjoint, fibre), stretched.dot(turned), matvec(F.transpose(), stretched_adjoint)


@ti.func
def viscous(C, eta):
    """Kelvin-Voigt stress 2 eta D, D the symmetric part of the velocity gradient C [1/s]; it is its own adjoint."""
    return eta * (C + C.transpose())
