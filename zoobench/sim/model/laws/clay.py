"""Clay."""

from dataclasses import dataclass

from zoobench.arrays import Array
from zoobench.sim.model.laws.hencky import VonMisesMedium, linear_stress, quadratic_energy


@dataclass(frozen=True)
class ClayMaterial(VonMisesMedium):
    """Plasticine: von Mises with Hencky elasticity."""

    name = "clay"
    kernels = "zoobench.sim.kernels.laws.clay"
    constants = ("mu", "lam", "yield_stress")
    colour = (0.72, 0.45, 0.34)

    def stress(self, strain: Array, history: Array | float = 1.0) -> Array:
        """2 mu eps + lambda tr(eps)."""
        return linear_stress(strain, self.mu, self.lam)

    def energy(self, strain: Array, history: Array | float = 1.0) -> Array:
        """mu eps:eps + lambda/2 tr(eps)^2."""
        return quadratic_energy(strain, self.mu, self.lam)
