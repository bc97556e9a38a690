"""Mud: a von Mises deviator with the pressure of a fluid, and viscous: Bingham-like beyond yield; no history."""

import taichi as ti

from zoobench.sim.kernels.laws.hencky import constant_deviator, hencky_update, hencky_update_adjoint, no_steepness
from zoobench.sim.kernels.laws.law import Law, Yield, linear_kappa
from zoobench.sim.model.laws.mud import MudMaterial


@ti.func
def fluid_pressure(volume, medium: ti.template()):
    """The pressure K (1 - J) of a fluid, and no tension."""
    mu, bulk = medium.mu, medium.lam + 2.0 / 3.0 * medium.mu
    J = ti.exp(volume)
    g, derivative = -2.0 / 3.0 * mu * volume, -2.0 / 3.0 * mu
    if J < 1.0:
        g += bulk * J * (J - 1.0)
        derivative += bulk * J * (2.0 * J - 1.0)
    return g, derivative


LAW = Law(
    MudMaterial.constants,
    linear_kappa,
    hencky_update,
    hencky_update_adjoint,
    is_viscous=True,
    slides=True,
    surface=Yield(constant_deviator, no_steepness, fluid_pressure),
)
