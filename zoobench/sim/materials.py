"""Constitutive laws as pure functions for kernels, with their adjoints. `materials_numpy` holds their twins.

Stresses are Kirchhoff stresses tau = J sigma [Pa]. Isotropic functions of a tensor are differentiated as such, by
divided differences of their principal values, never through the factors of a decomposition: those have no derivative
where principal values meet, which is the state of rest .
"""

import taichi as ti

from zoobench.sim.linalg import assemble, cofactor, eigen_symmetric, identity, matmul, matvec, outer, sinhc

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
def hencky_stress(strain, mu, lam):
    """Principal Kirchhoff stresses 2 mu eps + lambda tr(eps) of principal Hencky strains."""
    return 2.0 * mu * strain + lam * strain.sum()


@ti.func
def drucker_prager(strain, surplus, mu, lam, slope):
    """Return map of sand in principal Hencky strains (Klar et al. 2016, section 7).

    `surplus` is the log-volume gained while the sand was loose; it is used up before pressure returns (volume
    correction of Tampubolon et al. 2017). Returns the elastic strain, the new surplus and the ratio r of the
    deviator kept: 1 elastic, between 0 and 1 shearing, 0 loose.
    """
    volume = strain.sum() + surplus
    deviator = strain - strain.sum() / 3.0
    elastic = 0.0 * strain
    left, keep = volume, 0.0
    if volume < 0.0:
        left, keep = 0.0, 1.0
        size = deviator.norm()
        limit = -slope * (3.0 * lam + 2.0 * mu) / (2.0 * mu) * volume
        if size > limit:
            keep = limit / size
        elastic = keep * deviator + volume / 3.0
    return elastic, left, keep


@ti.func
def drucker_prager_adjoint(strain, surplus, pull, surplus_pull, mu, lam, slope):
    """Adjoint of `drucker_prager`: pulls on (elastic strain, new surplus) to pulls on (strain, surplus)."""
    volume = strain.sum() + surplus
    deviator = strain - strain.sum() / 3.0
    strain_pull = surplus_pull + 0.0 * strain
    volume_pull = surplus_pull
    if volume < 0.0:
        mean = pull.sum() / 3.0
        size = deviator.norm()
        stiffness = slope * (3.0 * lam + 2.0 * mu) / (2.0 * mu)
        limit = -stiffness * volume
        keep = 1.0
        volume_pull = mean
        radial = 0.0
        if size > limit:
            keep = limit / size
            along = deviator.dot(pull) / size
            volume_pull = mean - stiffness * along
            radial = keep * along / size
        strain_pull = keep * (pull - mean) - radial * deviator + volume_pull
    return strain_pull, volume_pull


@ti.func
def sand_update(b, surplus, mu, lam, slope):
    """Plastic return of sand from its trial left Cauchy-Green tensor b = F F^T.

    Returns the elastic b, the new surplus and the Kirchhoff stress.
    """
    squares, frame = eigen_symmetric(b)
    strain = 0.5 * ti.log(ti.max(squares, 1e-12))
    elastic, left, _ = drucker_prager(strain, surplus, mu, lam, slope)
    return assemble(frame, ti.exp(2.0 * elastic)), left, assemble(frame, hencky_stress(elastic, mu, lam))


@ti.func
def sand_update_adjoint(b, surplus, b_pull, surplus_pull, stress_pull, mu, lam, slope):
    """Adjoint of `sand_update` for symmetric pulls: pulls on the trial b (symmetric) and the old surplus.

    Both results share the eigenvectors of b. Off the diagonal of the eigenbasis an isotropic function has the
    derivative (y_i - y_j) / (b_i - b_j); with b = exp(2 eps) each such quotient is a product of sinhc and stays regular
    at b_i = b_j.
    """
    squares, frame = eigen_symmetric(b)
    strain = 0.5 * ti.log(ti.max(squares, 1e-12))
    elastic, _, keep = drucker_prager(strain, surplus, mu, lam, slope)
    back = frame.transpose()
    pull_b = matmul(back, matmul(b_pull, frame))
    pull_t = matmul(back, matmul(stress_pull, frame))
    stretch = ti.exp(elastic)
    elastic_pull = 0.0 * strain
    for i in ti.static(range(3)):
        elastic_pull[i] = 2.0 * stretch[i] * stretch[i] * pull_b[i, i] + 2.0 * mu * pull_t[i, i] + lam * pull_t.trace()
    strain_pull, surplus_new = drucker_prager_adjoint(strain, surplus, elastic_pull, surplus_pull, mu, lam, slope)
    trial = ti.exp(strain)
    inner = 0.0 * b
    for i in ti.static(range(3)):
        inner[i, i] = strain_pull[i] / (2.0 * trial[i] * trial[i])
        for j in ti.static(range(3)):
            if ti.static(i != j):
                rise_b = 2.0 * stretch[i] * stretch[j] * sinhc(elastic[i] - elastic[j])
                run = 2.0 * trial[i] * trial[j] * sinhc(strain[i] - strain[j])
                inner[i, j] = keep * (rise_b * pull_b[i, j] + 2.0 * mu * pull_t[i, j]) / run
    return matmul(frame, matmul(inner, back)), surplus_new
