"""Sand, clay and mud: elasticity in Hencky strain with a radial return onto the yield surface, and its adjoint.

`constants` are (mu, lambda, then the law's own), as `matter` lists them; how the adjoint of an isotropic function is
written, `media` says.
"""

import taichi as ti

from zoobench.sim.kernels.linalg import assemble, eigen_symmetric, matmul, sinhc
from zoobench.sim.model.matter import Law

SAND, MUD = int(Law.SAND), int(Law.MUD)

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
