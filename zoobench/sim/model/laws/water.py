"""Water of particles."""

from dataclasses import dataclass

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.laws.medium import Medium

TOLERATED_SURPLUS = 0.2
"""Surplus of density that water tolerates [-]: noise of stirred particles, and a robot of slightly other density."""

SMALLEST_RATIO, LARGEST_RATIO = 0.9, 1.05
"""Bounds on J of water: surplus density lowers it to 0.9, where the step is still safe; spray raises it to 1.05."""


@dataclass(frozen=True)
class WaterMaterial(Medium):
    """Weakly compressible water with the Tait pressure K/gamma (J^-gamma - 1); its history is the volume ratio J.

    Attributes:
        bulk_modulus: K [Pa], low enough for affordable steps and high enough that the density varies by about 1 %.
        exponent: gamma.
        viscosity: eta [Pa s].
    """

    bulk_modulus: float
    density: float
    exponent: float = 7.0
    viscosity: float = 0.0

    name = "water"
    kernels = "zoobench.sim.kernels.laws.water"
    constants = ("bulk_modulus", "exponent", "density", "viscosity")
    colour = (0.36, 0.62, 0.88)
    flows = True
    is_liquid = True

    @property
    def kappa(self) -> float:
        """At J = 0.9, a compression beyond that of the intended use [Pa]."""
        J, gamma = 0.9, self.exponent
        return float(3.0 * self.bulk_modulus / gamma * ((gamma - 1.0) * J ** (1.0 - gamma) + J))

    def rest_strains(self, load: Array) -> Array:
        """A fluid carries the load by pressure alone."""
        mean = load / self.bulk_modulus
        return np.repeat(-mean[:, None] / 3.0, 3, axis=1)

    def rest_history(self, strain: Array) -> Array:
        """J of the strain."""
        result: Array = np.exp(strain.sum(-1))
        return result

    def returned(self, strain: Array, history: Array) -> tuple[Array, Array]:
        """It never yields."""
        return strain, self.rest_history(strain)

    def stress(self, strain: Array, history: Array | float = 1.0) -> Array:
        """Minus the pressure."""
        result: Array = -self.pressure(np.exp(strain.sum(-1, keepdims=True))) + 0.0 * strain
        return result

    def energy(self, strain: Array, history: Array | float = 1.0) -> Array:
        """The work of the pressure."""
        bulk, gamma = self.bulk_modulus, self.exponent
        pressed = np.minimum(np.exp(strain.sum(-1)), 1.0)
        result: Array = bulk / gamma * ((pressed ** (1.0 - gamma) - 1.0) / (gamma - 1.0) + pressed - 1.0)
        return result

    def pressure(self, J: Array) -> Array:
        """Kirchhoff pressure [Pa] J p at the volume ratio J; no tension."""
        bulk, gamma = self.bulk_modulus, self.exponent
        return np.maximum(bulk / gamma * (J ** (1.0 - gamma) - J), 0.0)


def water_ratio(J: Array, growth: Array, rho: Array, share: float) -> Array:
    """New volume ratio from the old one, det(I + dt C) and the relative density; see `kernels.laws.water`."""
    ratio = np.minimum(J * growth, np.clip(1.0 / rho, 1.0, LARGEST_RATIO))
    surplus = np.maximum(rho * J - 1.0 - TOLERATED_SURPLUS, 0.0)
    return np.maximum(ratio - share * surplus, np.minimum(ratio, SMALLEST_RATIO))
