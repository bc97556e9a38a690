"""Materials: the constants of every constitutive law, with their elastic moduli and step limits.

SI units. `law` selects the kernel functions in `media`, which take `constants`.
"""

import math
from dataclasses import dataclass
from enum import IntEnum


class Law(IntEnum):
    """The constitutive laws of media; 0 stands for no medium."""

    SAND = 1
    CLAY = 2
    MUD = 3
    SNOW = 4
    WATER = 5


DECOMPOSED = frozenset({Law.SAND, Law.CLAY, Law.MUD, Law.SNOW})
"""Laws that need the principal values of strain; those of the robot and of water do not."""

LOCKING = frozenset({Law.CLAY, Law.MUD})
"""Laws whose flow keeps the volume, against which the particles of a cell would lock; see `kernels.fbar`."""

SMALLEST_PLASTIC, LARGEST_PLASTIC = 0.8, 20.0
"""Bounds on snow's plastic volume ratio: compacted by a fifth, it hardens no further, so that the step stays safe.

0.8 is the largest of 0.6, 0.7, 0.8 and 0.9 that does not change scores. Square waves of full strength and mixed phases
do not reach it in 200 frames, all muscles in unison do in 2e-5 of the particle-frames, and the scores of random
controllers agree with those at 0.6 to 5e-5 m/s; 0.9 changes them by millimetres per second. The declared step is 59 to
a frame instead of 158; an ordinary episode takes 25 to 33 either way, as the step follows the state.
"""

TOLERATED_SURPLUS = 0.2
"""Surplus of density that water tolerates [-]: noise of stirred particles, and a robot of slightly other density."""

SMALLEST_RATIO, LARGEST_RATIO = 0.9, 1.05
"""Bounds on J of water: surplus density lowers it to 0.9, where the step is still safe; spray raises it to 1.05."""

Constants = tuple[float, float, float, float, float]


def lame_parameters(youngs_modulus: float, poissons_ratio: float) -> tuple[float, float]:
    """(mu, lambda) [Pa] from E [Pa] and nu."""
    mu = youngs_modulus / (2 * (1 + poissons_ratio))
    lam = youngs_modulus * poissons_ratio / ((1 + poissons_ratio) * (1 - 2 * poissons_ratio))
    return mu, lam


@dataclass(frozen=True)
class _Solid:
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
    def kappa(self) -> float:
        """Stiffness of the isolated particle, 2 mu + 3 lambda in Hencky strain [Pa]; yield only lowers it."""
        mu, lam = self.lame
        return 2.0 * mu + 3.0 * lam


@dataclass(frozen=True)
class ElasticMaterial(_Solid):
    """Neo-Hookean matter with active fibres.

    Attributes:
        muscle_strength: s [Pa], the active stress at full actuation; 0 for passive matter.
        viscosity: eta [Pa s] of the Kelvin-Voigt stress 2 eta D, which damps oscillations; 0 for undamped matter.
    """

    muscle_strength: float = 0.0
    viscosity: float = 0.0


@dataclass(frozen=True)
class SandMaterial(_Solid):
    """Drucker-Prager sand with Hencky elasticity (Klar et al. 2016).

    Attributes:
        friction_angle: phi [degrees], as measured in triaxial compression.
    """

    friction_angle: float
    law = Law.SAND

    @property
    def cone_slope(self) -> float:
        """alpha of the cone |dev eps| <= -alpha (3 lambda + 2 mu) / (2 mu) tr(eps), fitted in triaxial compression.

        alpha = sqrt(2/3) 2 sin(phi) / (3 - sin(phi)); Klar et al. 2016, eq. 31.
        """
        sine = math.sin(math.radians(self.friction_angle))
        return math.sqrt(2.0 / 3.0) * 2.0 * sine / (3.0 - sine)

    @property
    def constants(self) -> Constants:
        """(mu, lambda, alpha)."""
        return (*self.lame, self.cone_slope, 0.0, 0.0)


@dataclass(frozen=True)
class ClayMaterial(_Solid):
    """Plasticine: von Mises with Hencky elasticity.

    Attributes:
        yield_stress: Frobenius norm of the deviatoric Kirchhoff stress at yield [Pa]; sqrt(2/3) of the uniaxial one.
    """

    yield_stress: float
    law = Law.CLAY

    @property
    def constants(self) -> Constants:
        """(mu, lambda, yield stress)."""
        return (*self.lame, self.yield_stress, 0.0, 0.0)


@dataclass(frozen=True)
class MudMaterial(_Solid):
    """Wet mud: Bingham-like in shear, a fluid in volume (pressure K (1 - J), no tension).

    Attributes:
        yield_stress: Frobenius norm of the deviatoric Kirchhoff stress at yield [Pa].
        viscosity: eta [Pa s].
    """

    yield_stress: float
    viscosity: float
    law = Law.MUD

    @property
    def constants(self) -> Constants:
        """(mu, lambda, yield stress, 0, viscosity)."""
        return (*self.lame, self.yield_stress, 0.0, self.viscosity)


@dataclass(frozen=True)
class SnowMaterial(_Solid):
    """Snow after Stomakhin et al. 2013.

    Attributes:
        critical_compression, critical_stretch: theta_c, theta_s: elastic stretches stay within 1 - theta_c and
            1 + theta_s.
        hardening: xi; the moduli grow as exp(xi (1 - J_P)).
    """

    critical_compression: float
    critical_stretch: float
    hardening: float
    law = Law.SNOW

    @property
    def constants(self) -> Constants:
        """(mu, lambda, theta_c, theta_s, xi)."""
        return (*self.lame, self.critical_compression, self.critical_stretch, self.hardening)

    @property
    def kappa(self) -> float:
        """Stiffness of the isolated particle [Pa] at the most hardening: corotated, at the largest elastic stretch."""
        mu, lam = self.lame
        s = 1.0 + self.critical_stretch
        hardest = math.exp(self.hardening * (1.0 - SMALLEST_PLASTIC))
        return hardest * (2.0 * mu * (2.0 * s**2 - s) + 3.0 * lam * (2.0 * s**6 - s**3))


@dataclass(frozen=True)
class WaterMaterial:
    """Weakly compressible water with the Tait pressure K/gamma (J^-gamma - 1).

    Attributes:
        bulk_modulus: K [Pa], low enough for affordable steps and high enough that the density varies by about 1 %.
        exponent: gamma.
        viscosity: eta [Pa s].
    """

    bulk_modulus: float
    density: float
    exponent: float = 7.0
    viscosity: float = 0.0
    law = Law.WATER

    @property
    def constants(self) -> Constants:
        """(0, K, gamma, density, viscosity)."""
        return (0.0, self.bulk_modulus, self.exponent, self.density, self.viscosity)

    @property
    def kappa(self) -> float:
        """Stiffness of the isolated particle [Pa] at J = 0.9, a compression beyond that of the intended use."""
        J, gamma = 0.9, self.exponent
        return float(3.0 * self.bulk_modulus / gamma * ((gamma - 1.0) * J ** (1.0 - gamma) + J))


Medium = SandMaterial | ClayMaterial | MudMaterial | SnowMaterial | WaterMaterial
