"""Clay."""

from dataclasses import dataclass

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.laws.hencky import HenckyMedium, linear_stress, quadratic_energy, shear_at_yield


@dataclass(frozen=True)
class ClayMaterial(HenckyMedium):
    """Plasticine: von Mises with Hencky elasticity.

    Attributes:
        yield_stress: Frobenius norm of the deviatoric Kirchhoff stress at yield [Pa]; sqrt(2/3) of the uniaxial one.
    """

    yield_stress: float

    name = "clay"
    kernels = "zoobench.sim.kernels.laws.clay"
    constants = ("mu", "lam", "yield_stress")
    colour = (0.72, 0.45, 0.34)
    yields = True
    locks = True

    @property
    def largest_shear(self) -> float:
        """At the yield stress."""
        return shear_at_yield(self.yield_stress, self.mu)

    def largest_deviator(self, volume: Array) -> Array:
        """By the yield stress."""
        return np.full(volume.shape, self.yield_stress / (2.0 * self.mu))

    def stress(self, strain: Array, history: Array | float = 1.0) -> Array:
        """2 mu eps + lambda tr(eps)."""
        return linear_stress(strain, self.mu, self.lam)

    def energy(self, strain: Array, history: Array | float = 1.0) -> Array:
        """mu eps:eps + lambda/2 tr(eps)^2."""
        return quadratic_energy(strain, self.mu, self.lam)
