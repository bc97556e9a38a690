"""Constitutive laws as pure functions for kernels, with their adjoints. `materials_numpy` holds their twins.

Stresses are Kirchhoff stresses tau = J sigma [Pa]. Isotropic functions of a tensor are differentiated as such, by
divided differences of their principal values, never through the factors of a decomposition: those have no derivative
where principal values meet, which is the state of rest.
"""

import taichi as ti

from zoobench.sim.kernels.linalg import cofactor, identity, matmul, matvec, outer

SMALLEST_J = 0.05  # below it log J is held; the survey counts the particles that are


@ti.func
def neo_hookean(F, mu, lam):
    """tau = mu (F F^T - I) + lambda log(J) I; zero at rest."""
    log_j = ti.log(ti.max(F.determinant(), SMALLEST_J))
    return mu * matmul(F, F.transpose()) + (lam * log_j - mu) * identity()


@ti.func
def neo_hookean_adjoint(F, pull, mu, lam):
    """Adjoint of `neo_hookean` with respect to F for the stress adjoint `pull` (symmetric)."""
    J = F.determinant()
    volumetric = 0.0
    if J > SMALLEST_J:
        volumetric = lam * pull.trace() / J
    return (2.0 * mu) * matmul(pull, F) + volumetric * cofactor(F)


@ti.func
def fibre_stress(F, tension, fibre):
    """Active stress tension (F d)(F d)^T along the unit rest direction d; tension [Pa] is strength times actuation."""
    stretched = matvec(F, fibre)
    return tension * outer(stretched, stretched)


@ti.func
def fibre_stress_adjoint(F, pull, tension, fibre):
    """Adjoints of `fibre_stress` with respect to F, the tension and the fibre, for a symmetric `pull`."""
    stretched = matvec(F, fibre)
    pulled = matvec(pull, stretched)
    stretched_adjoint = (2.0 * tension) * pulled
    return outer(stretched_adjoint, fibre), stretched.dot(pulled), matvec(F.transpose(), stretched_adjoint)


@ti.func
def viscous(C, eta):
    """Viscous stress 2 eta D of the velocity gradient C, D its symmetric part (Kelvin-Voigt); it is its own adjoint."""
    return eta * (C + C.transpose())
