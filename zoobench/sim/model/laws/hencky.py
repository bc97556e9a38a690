"""The common law of sand, clay and mud: elasticity in Hencky strain, and a radial return onto a yield surface."""

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.laws.medium import SolidMedium


@dataclass(frozen=True)
class HenckyMedium(SolidMedium):
    """A medium whose deviator is scaled back onto the yield surface; see `kernels.laws.hencky`.

    Attributes:
        is_loose_in_tension: whether it bears no tension and remembers, as its history, the volume gained while loose.
    """

    is_loose_in_tension: ClassVar[bool] = False

    @property
    def kappa(self) -> float:
        """2 mu + 3 lambda in Hencky strain [Pa]; yield only lowers it."""
        mu, lam = self.lame
        return 2.0 * mu + 3.0 * lam

    @abstractmethod
    def largest_deviator(self, volume: Array) -> Array:
        """Norm of the deviatoric strain at yield, by the volumetric strain `[...]`."""

    def rest_history(self, strain: Array) -> Array:
        """Zero."""
        return np.zeros(strain.shape[:-1])

    def returned(self, strain: Array, history: Array) -> tuple[Array, Array]:
        """The radial return."""
        elastic, after, _ = self.radial_return(strain, history)
        return elastic, after

    def radial_return(self, strain: Array, history: Array) -> tuple[Array, Array, Array]:
        """`returned`, and the ratio of the deviator kept: 1 elastic, 0 loose."""
        total = strain.sum(-1)
        volume = total + history
        deviator = strain - total[..., None] / 3.0
        size = np.linalg.norm(deviator, axis=-1)
        loose = (volume >= 0.0) & self.is_loose_in_tension
        limit = self.largest_deviator(volume)
        sheared = ~loose & (size > limit)
        keep = np.where(loose, 0.0, np.where(sheared, limit / np.where(size > 0, size, 1.0), 1.0))
        elastic = np.where(loose[..., None], 0.0, keep[..., None] * deviator + volume[..., None] / 3.0)
        return elastic, np.where(loose, volume, 0.0), keep


@dataclass(frozen=True)
class VonMisesMedium(HenckyMedium):
    """A Hencky medium whose deviatoric stress yields at one limit, whatever the pressure.

    Attributes:
        yield_stress: Frobenius norm of the deviatoric Kirchhoff stress at yield [Pa]; sqrt(2/3) of the uniaxial one.
    """

    yield_stress: float

    yields = True
    locks = True

    @property
    def largest_shear(self) -> float:
        """Shear of a confined column at yield, where |dev tau| = 2 mu sqrt(2/3) shear is the yield stress."""
        return self.yield_stress / float(2.0 * self.mu * np.sqrt(2.0 / 3.0))

    def largest_deviator(self, volume: Array) -> Array:
        """That of the yield stress, whatever the volume."""
        return np.full(volume.shape, self.yield_stress / (2.0 * self.mu))


def linear_stress(strain: Array, mu: float, lam: float) -> Array:
    """Principal stresses `[..., 3]` [Pa] 2 mu eps + lambda tr(eps) of Hencky strains `[..., 3]`."""
    result: Array = 2.0 * mu * strain + lam * strain.sum(-1, keepdims=True)
    return result


def quadratic_energy(strain: Array, mu: float, lam: float) -> Array:
    """Energy density [J/m^3] mu eps:eps + lambda/2 tr(eps)^2 of Hencky strains `[..., 3]`."""
    result: Array = mu * np.square(strain).sum(-1) + 0.5 * lam * strain.sum(-1) ** 2
    return result
