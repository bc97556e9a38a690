"""Sand."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from zoobench.arrays import Array
from zoobench.sim.model.laws.hencky import HenckyMedium, linear_stress, quadratic_energy


@dataclass(frozen=True)
class SandMaterial(HenckyMedium):
    """Drucker-Prager sand with Hencky elasticity (Klar et al. 2016).

    Attributes:
        friction_angle: phi [degrees], as measured in triaxial compression.
    """

    friction_angle: float

    name = "sand"
    kernels = "zoobench.sim.kernels.laws.sand"
    constants = ("mu", "lam", "cone_slope")
    colour = (0.88, 0.74, 0.48)
    yields = True
    is_loose_in_tension = True
    limits: ClassVar[Mapping[str, float]] = {"friction_angle": 90.0}

    @property
    def cone_slope(self) -> float:
        """alpha of the cone |dev eps| <= -alpha (3 lambda + 2 mu) / (2 mu) tr(eps), fitted in triaxial compression.

        alpha = sqrt(2/3) 2 sin(phi) / (3 - sin(phi)); Klar et al. 2016, eq. 31.
        """
        sine = math.sin(math.radians(self.friction_angle))
        return math.sqrt(2.0 / 3.0) * 2.0 * sine / (3.0 - sine)

    @property
    def largest_shear(self) -> float:
        """None: a column's pressure holds its shear."""
        return math.inf

    def largest_deviator(self, volume: Array) -> Array:
        """The cone."""
        return -self.cone_slope * (3.0 * self.lam + 2.0 * self.mu) / (2.0 * self.mu) * volume

    def stress(self, strain: Array, history: Array | float = 1.0) -> Array:
        """2 mu eps + lambda tr(eps)."""
        return linear_stress(strain, self.mu, self.lam)

    def energy(self, strain: Array, history: Array | float = 1.0) -> Array:
        """mu eps:eps + lambda/2 tr(eps)^2."""
        return quadratic_energy(strain, self.mu, self.lam)
