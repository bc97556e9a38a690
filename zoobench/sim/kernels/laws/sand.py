"""Sand: Drucker-Prager in Hencky strain (Klar et al. 2016); history: log-volume gained while loose.

At tr(eps) >= 0, the tip of the cone, there is no stress; the volume gained there is used up before pressure returns
(Tampubolon et al. 2017).
"""

import taichi as ti

from zoobench.sim.kernels.laws.hencky import hencky_update, hencky_update_adjoint, linear_pressure
from zoobench.sim.kernels.laws.law import Law, Yield, linear_kappa
from zoobench.sim.model.laws.sand import SandMaterial


@ti.func
def steepness(medium: ti.template()):
    """Deviatoric Hencky strain at yield by compressive volumetric strain: alpha (3 lambda + 2 mu) / (2 mu).

    The Drucker-Prager cone; `SandMaterial.cone_slope` is alpha.
    """
    mu, lam, alpha = medium.mu, medium.lam, medium.cone_slope
    return alpha * (3.0 * lam + 2.0 * mu) / (2.0 * mu)


@ti.func
def largest_deviator(volume, medium: ti.template()):
    """The cone."""
    return -steepness(medium) * volume


LAW = Law(
    SandMaterial.constants,
    linear_kappa,
    hencky_update,
    hencky_update_adjoint,
    surface=Yield(largest_deviator, steepness, linear_pressure, is_loose_in_tension=True),
)
