"""Elastic matter: its moduli, and the robot's law, neo-Hookean with active fibres, without the kernel language.

SI units. Arrays may have leading axes; the last two are the tensor's.
"""

from dataclasses import dataclass

import numpy as np

from zoobench.arrays import Array


def lame_parameters(youngs_modulus: float, poissons_ratio: float) -> tuple[float, float]:
    """(mu, lambda) [Pa] from E [Pa] and nu."""
    mu = youngs_modulus / (2 * (1 + poissons_ratio))
    lam = youngs_modulus * poissons_ratio / ((1 + poissons_ratio) * (1 - 2 * poissons_ratio))
    return mu, lam


@dataclass(frozen=True)
class Solid:
    """Elastic moduli and density, the first fields of every material but water.

    Attributes:
        youngs_modulus: E [Pa]; of a body at stiffness 1.
        poissons_ratio: nu [-].
        density: rho [kg/m^3].
    """

    youngs_modulus: float
    poissons_ratio: float
    density: float

    @property
    def lame(self) -> tuple[float, float]:
        """(mu, lambda) [Pa]."""
        return lame_parameters(self.youngs_modulus, self.poissons_ratio)

    @property
    def mu(self) -> float:
        """Shear modulus [Pa]."""
        return self.lame[0]

    @property
    def lam(self) -> float:
        """Lame's first parameter [Pa]."""
        return self.lame[1]

    @property
    def bulk(self) -> float:
        """Bulk modulus lambda + 2/3 mu [Pa]."""
        return self.lam + 2.0 / 3.0 * self.mu


@dataclass(frozen=True)
class ElasticMaterial(Solid):
    """Neo-Hookean matter with active fibres.

    Attributes:
        muscle_strength: s [Pa], the active stress at full actuation; 0 for passive matter.
        viscosity: eta [Pa s] of the Kelvin-Voigt stress 2 eta D, which damps oscillations; 0 for undamped matter.
    """

    muscle_strength: float = 0.0
    viscosity: float = 0.0


def neo_hookean(F: Array, mu: float, lam: float) -> Array:
    """Kirchhoff stress [Pa] mu (F F^T - I) + lambda log(J) I of F `[..., 3, 3]`."""
    log_j = np.log(np.linalg.det(F))[..., None, None]
    result: Array = mu * (F @ np.swapaxes(F, -1, -2) - np.eye(3)) + lam * log_j * np.eye(3)
    return result


def neo_hookean_energy(F: Array, mu: float, lam: float) -> Array:
    """Energy density [J/m^3] mu/2 (tr F^T F - 3) - mu log J + lambda/2 log^2 J; its derivative gives `neo_hookean`."""
    log_j = np.log(np.linalg.det(F))
    result: Array = 0.5 * mu * ((F**2).sum((-1, -2)) - 3.0) - mu * log_j + 0.5 * lam * log_j**2
    return result


def fibre_stress(F: Array, tension: float, fibre: Array) -> Array:
    """Active Kirchhoff stress [Pa] tension (F d)(F d)^T along the unit rest direction d `[..., 3]`."""
    stretched = np.einsum("...ij,...j->...i", F, fibre)
    result: Array = tension * stretched[..., :, None] * stretched[..., None, :]
    return result
