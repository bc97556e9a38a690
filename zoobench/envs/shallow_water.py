"""Shallow water: a robot wading on rough ground."""

from zoobench.envs.base import Environment, Stance, bed_environment
from zoobench.registry import Kind, register
from zoobench.sim.model.matter import WaterMaterial

_PROVISIONAL = (
    "its water is a layer of one to three cells in which no wave is resolved, and as thick as the ocean's (nothing is "
    "left of a current of 20 mm/s after 0.2 s), so that moving in it is not wading"
)


@register(Kind.ENV, "shallow-water", version=4, tags=("land", "fluid"), provisional=_PROVISIONAL)
def shallow_water(
    *,
    friction: float = 0.5,
    depth: float = 0.02,
    length: float = 0.625,
    width: float = 0.375,
    bulk_modulus: float = 2e4,
) -> Environment:
    """Knee-deep water on rough ground, in which the robot stands.

    The water fills the arena from wall to wall. It is twice as long and wide as the solid beds because waves are
    reflected by the walls: in a tank half as large they change a robot's speed by more than the noise floor.

    * `friction`: Coulomb coefficient of the ground [-].
    * `depth`: of the water [m].
    * `length`, `width`: of water and arena along x and z [m].
    * `bulk_modulus`: K [Pa]. At 2e4 the water is compressed by 1 % at the bottom, and the speed of sound, 4.5 m/s, is
      ten times that of any robot.
    """
    water = WaterMaterial(bulk_modulus=bulk_modulus, density=1000.0)
    return bed_environment(water, friction=friction, thickness=depth, length=length, width=width, stance=Stance.WADING)
