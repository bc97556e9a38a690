"""Mud."""

from dataclasses import dataclass

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.laws.hencky import VonMisesMedium


@dataclass(frozen=True)
class MudMaterial(VonMisesMedium):
    """Wet mud: Bingham-like in shear, a fluid in volume (pressure K (1 - J), no tension).

    Attributes:
        viscosity: eta [Pa s].
    """

    viscosity: float

    name = "mud"
    kernels = "zoobench.sim.kernels.laws.mud"
    constants = ("mu", "lam", "yield_stress", "viscosity")
    colour = (0.46, 0.38, 0.27)
    flows = True

    def stress(self, strain: Array, history: Array | float = 1.0) -> Array:
        """2 mu dev(eps) + K J (J - 1), without tension."""
        volume = strain.sum(-1, keepdims=True)
        J = np.exp(volume)
        result: Array = 2.0 * self.mu * (strain - volume / 3.0) + np.minimum(self.bulk * J * (J - 1.0), 0.0)
        return result

    def energy(self, strain: Array, history: Array | float = 1.0) -> Array:
        """mu dev(eps):dev(eps) + K/2 (J - 1)^2, of compression."""
        volume = strain.sum(-1)
        deviator = strain - volume[..., None] / 3.0
        pressed = np.minimum(np.exp(volume) - 1.0, 0.0)
        result: Array = self.mu * np.square(deviator).sum(-1) + 0.5 * self.bulk * pressed**2
        return result
