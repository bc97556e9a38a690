"""Shallow water: a robot wading on rough ground."""

from zoobench.envs.base import Environment, Stance, bed_environment
from zoobench.envs.bed import Bed
from zoobench.envs.hills import LEVEL, Hills
from zoobench.envs.physics import FRESH_WATER, LAND, Physics, Water
from zoobench.envs.profile import LEVEL_WAY, Profile
from zoobench.registry import Kind, register

_PROVISIONAL = (
    "bodies float in it within 0.25 cells of their draught, but its accuracy is not studied, and at draft it is less "
    "than three cells deep; up to version 7 it sticks to the robot and is as thick as syrup"
)


@register(
    Kind.ENV, "shallow-water", version=10, tags=("land", "fluid"), added=("water", "hills", "profile", "physics"),
    provisional=_PROVISIONAL,
)  # fmt: skip
def shallow_water(
    *,
    friction: float = 0.5,
    slip: bool = True,
    depth: float = 0.042,
    length: float = 0.625,
    width: float = 0.375,
    bulk_modulus: float = 2e4,
    water: Water = FRESH_WATER,
    hills: Hills = LEVEL,
    profile: Profile = LEVEL_WAY,
    physics: Physics = LAND,
) -> Environment:
    """Water on rough ground, nearly as deep as a robot is tall, in which it stands or floats by its density.

    The depth is four cells at `standard`, in which waves are resolved: at draft it is under three.

    The water fills the arena from wall to wall. It is twice as long and wide as the solid beds because waves are
    reflected by the walls: in a tank half as large they change a robot's speed by more than the noise floor.

    * `friction`: Coulomb coefficient of the ground [-].
    * `slip`: whether robot and water have velocity fields of their own, without friction between them, and the water
      keeps the motion that the grid does not resolve; or the water sticks to the robot, and is as thick as syrup.
    * `depth`: of the water above the lowest ground [m].
    * `length`, `width`: of water and arena along x and z [m].
    * `bulk_modulus`: K [Pa]. At 2e4 the water is compressed by 2 % at the bottom, and the speed of sound, 4.5 m/s, is
      ten times that of any robot.
    """
    return bed_environment(
        Bed(water.material(bulk_modulus), depth, 0.0 if slip else None, "aflip" if slip else None),
        friction=friction,
        size=(length, width),
        physics=physics,
        hills=hills,
        profile=profile,
        stance=Stance.WADING,
    )
