"""Clay: von Mises in Hencky strain; no history."""

from zoobench.sim.kernels.laws.hencky import (
    constant_deviator,
    hencky_update,
    hencky_update_adjoint,
    linear_pressure,
    no_steepness,
)
from zoobench.sim.kernels.laws.law import Law, Yield, linear_kappa
from zoobench.sim.model.laws.clay import ClayMaterial

LAW = Law(
    ClayMaterial.constants,
    linear_kappa,
    hencky_update,
    hencky_update_adjoint,
    surface=Yield(constant_deviator, no_steepness, linear_pressure),
)
