"""Snow."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.laws.medium import SolidMedium

SMALLEST_PLASTIC, LARGEST_PLASTIC = 0.8, 20.0
"""Bounds on snow's plastic volume ratio: compacted by a fifth, it hardens no further, so that the step stays safe.

0.8 is the largest of 0.6, 0.7, 0.8 and 0.9 that does not change scores. Square waves of full strength and mixed phases
do not reach it in 200 frames, all muscles in unison do in 2e-5 of the particle-frames, and the scores of random
controllers agree with those at 0.6 to 5e-5 m/s; 0.9 changes them by millimetres per second. The declared step is 59 to
a frame instead of 158; an ordinary episode takes 25 to 33 either way, as the step follows the state.
"""


@dataclass(frozen=True)
class SnowMaterial(SolidMedium):
    """Snow after Stomakhin et al. 2013; its history is the plastic volume ratio.

    Attributes:
        critical_compression, critical_stretch: theta_c, theta_s: elastic stretches stay within 1 - theta_c and
            1 + theta_s.
        hardening: xi; the moduli grow as exp(xi (1 - J_P)).
    """

    critical_compression: float
    critical_stretch: float
    hardening: float

    name = "snow"
    kernels = "zoobench.sim.kernels.laws.snow"
    constants = ("mu", "lam", "critical_compression", "critical_stretch", "hardening")
    colour = (0.97, 0.98, 1.0)
    yields = True
    limits: ClassVar[Mapping[str, float]] = {"critical_compression": 1.0}

    @property
    def kappa(self) -> float:
        """Corotated, at the most hardening and the largest elastic stretch [Pa]."""
        mu, lam = self.lame
        s = 1.0 + self.critical_stretch
        hardest = math.exp(self.hardening * (1.0 - SMALLEST_PLASTIC))
        return hardest * (2.0 * mu * (2.0 * s**2 - s) + 3.0 * lam * (2.0 * s**6 - s**3))

    @property
    def largest_shear(self) -> float:
        """None: the loads of beds are far from the clamps."""
        return math.inf

    def rest_history(self, strain: Array) -> Array:
        """One."""
        return np.ones(strain.shape[:-1])

    def returned(self, strain: Array, history: Array) -> tuple[Array, Array]:
        """Stretches are clamped, and the plastic volume ratio takes the rest."""
        low, high = 1.0 - self.critical_compression, 1.0 + self.critical_stretch
        elastic = np.clip(strain, np.log(low), np.log(high))
        grown = history * np.exp((strain - elastic).sum(-1))
        return elastic, np.clip(grown, SMALLEST_PLASTIC, LARGEST_PLASTIC)

    def stress(self, strain: Array, history: Array | float = 1.0) -> Array:
        """Fixed corotated: 2 mu s (s - 1) + lambda J (J - 1) of the stretches s, hardened."""
        mu, lam = self.lame
        J, stretch = np.exp(strain.sum(-1, keepdims=True)), np.exp(strain)
        hardening = np.exp(self.hardening * (1.0 - np.asarray(history)[..., None]))
        result: Array = hardening * (2.0 * mu * stretch * (stretch - 1.0) + lam * J * (J - 1.0))
        return result

    def energy(self, strain: Array, history: Array | float = 1.0) -> Array:
        """mu (s - 1)^2 + lambda/2 (J - 1)^2 of the stretches s, hardened."""
        mu, lam = self.lame
        soft = mu * np.square(np.exp(strain) - 1.0).sum(-1) + 0.5 * lam * (np.exp(strain.sum(-1)) - 1.0) ** 2
        result: Array = np.exp(self.hardening * (1.0 - np.asarray(history))) * soft
        return result
