"""Constants of environments that can be set: gravity, the robot's material, and of media."""

from dataclasses import dataclass

from zoobench.errors import UsageError
from zoobench.sim.model.grid_water import GridWater
from zoobench.sim.model.ground_skin import SKIN, GroundSkin
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.laws.water import WaterMaterial

_LEAST_DENSITY = 1e-3  # of a robot [kg/m^3]


@dataclass(frozen=True, kw_only=True)
class Physics:
    """Gravity, and the robot's material where its body has stiffness 1 and density ratio 1.

    * `gravity`: downward [m/s^2], 0 or more; 3.8 in SoftZoo's reference.
    * `youngs_modulus`: E of the robot [Pa].
    * `poissons_ratio`: nu of the robot [-], above -1 and below 0.5.
    * `density`: of the robot [kg/m^3].
    * `muscle_strength`: active stress of a muscle at full activity [Pa], above 0; it does not change with
      `youngs_modulus`.
    * `damping`: viscosity eta of the robot's stress 2 eta D [Pa s]; 0 is undamped.
    """

    # The robot of SoftZoo's reference implementation on land, with muscles of 0.15 E and a viscosity similar to
    # silicone's (loss factor 2 eta omega / E = 0.3 at the 80 rad/s of the fastest controllers). Muscles are half as
    # strong as the usual 0.3 E, and damped, so that the robot does not tear: with all muscles in phase at 80 rad/s a
    # robot with 0.3 E tears within 10 frames, one with 0.15 E but no damping within 20 (ground, h = 1/128). This one
    # reaches a stretch ratio of 1.6.
    gravity: float = 9.81
    youngs_modulus: float = 1e4
    poissons_ratio: float = 0.2
    density: float = 1000.0
    muscle_strength: float = 1.5e3
    damping: float = 20.0

    def __post_init__(self) -> None:
        if self.gravity < 0.0:
            raise UsageError(f"A gravity of {self.gravity:g} m/s^2 would point upward. Give 0 or more.")
        if 0.0 < self.density < _LEAST_DENSITY:
            raise UsageError(
                f"A density of {self.density:g} kg/m^3 is that of no solid: air has 1.2. "
                f"Give {_LEAST_DENSITY:g} or more."
            )
        if self.muscle_strength == 0.0:
            raise UsageError(
                "A muscle_strength of 0 Pa moves nothing. Give a positive strength; the score of a robot "
                "at rest is the reading idle_score of every run."
            )

    @property
    def robot(self) -> ElasticMaterial:
        """The robot's material."""
        return ElasticMaterial(
            youngs_modulus=self.youngs_modulus,
            poissons_ratio=self.poissons_ratio,
            density=self.density,
            muscle_strength=self.muscle_strength,
            viscosity=self.damping,
        )


LAND = Physics()

# A swimmer is stiffer than in the reference implementation (1e5 Pa), since it has to push water: bent by a wave of its
# muscles, a body follows up to its first frequency of bending in water, which for the fish is 5 Hz at 1e5 Pa and some
# 9 Hz at 3e5 Pa; beyond, its tail hardly swings. Below, what it swings is in proportion to strength by stiffness, which
# is 0.15 as on land. The damping by water alone is insufficient: at 1e5 Pa and h = 1/128, under square waves of full
# strength, the robot tore in the 197th frame.
SWIMMER = Physics(youngs_modulus=3e5, muscle_strength=4.5e4)


@dataclass(frozen=True, kw_only=True)
class Contact:
    """The skin of firm ground: a compliant layer that pushes on the robot, with Coulomb friction.

    * `skin_thickness`: within which the ground is felt [m].
    * `skin_stiffness`: K [Pa]; matter that fills the layer feels the pressure K / 2 at the ground.
    """

    skin_thickness: float = SKIN.thickness
    skin_stiffness: float = SKIN.stiffness

    @property
    def skin(self) -> GroundSkin:
        """The layer; raises SceneError unless both are positive."""
        return GroundSkin(self.skin_thickness, self.skin_stiffness)


SKINNED = Contact()


@dataclass(frozen=True, kw_only=True)
class Elasticity:
    """Elasticity and density of the medium.

    * `medium_youngs_modulus`: E [Pa]. Real ground is stiffer by far; here stiffness only has to keep the elastic strain
      under a robot small (0.5 % per 500 Pa).
    * `medium_poissons_ratio`: nu [-], above -1 and below 0.5.
    * `medium_density`: [kg/m^3].
    """

    medium_youngs_modulus: float = 1e5
    medium_poissons_ratio: float = 0.2
    medium_density: float

    @property
    def constants(self) -> tuple[float, float, float]:
        """The first three constants of a solid's material: E [Pa], nu [-] and density [kg/m^3]."""
        return self.medium_youngs_modulus, self.medium_poissons_ratio, self.medium_density


@dataclass(frozen=True, kw_only=True)
class Water:
    """Constants of the water.

    * `medium_density`: at no pressure [kg/m^3].
    * `viscosity`: eta [Pa s], in addition to that of the grid, which is far larger; real water has 1e-3.
    * `tait_exponent`: gamma of the pressure K / gamma (J^-gamma - 1) [-].
    """

    medium_density: float = 1000.0
    viscosity: float = 0.0
    tait_exponent: float = 7.0

    def material(self, bulk_modulus: float) -> WaterMaterial:
        """The water with this K [Pa]."""
        return WaterMaterial(
            bulk_modulus=bulk_modulus,
            density=self.medium_density,
            exponent=self.tait_exponent,
            viscosity=self.viscosity,
        )

    @property
    def on_grid(self) -> GridWater:
        """The water as an incompressible one."""
        return GridWater(density=self.medium_density, viscosity=self.viscosity / self.medium_density)


FRESH_WATER = Water()
