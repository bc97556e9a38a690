"""Ocean: deep water with a neutrally buoyant swimmer, away from floor and surface."""

from zoobench.envs.base import Environment, Stance, equilibration_frames
from zoobench.envs.bed import Bed
from zoobench.envs.physics import FRESH_WATER, SWIMMER, Physics, Water
from zoobench.registry import Kind, register


@register(Kind.ENV, "ocean", version=5, tags=("water", "fluid"), added=("water", "physics"))
def ocean(
    *,
    depth: float = 0.15625,
    length: float = 0.3125,
    width: float = 0.1875,
    bulk_modulus: float = 1e5,
    water: Water = FRESH_WATER,
    physics: Physics = SWIMMER,
) -> Environment:
    """Water three times as deep as a robot is tall, which floats in the middle.

    * `depth`: of the water [m].
    * `length`, `width`: of water and arena along x and z [m].
    * `bulk_modulus`: K [Pa]. At 1e5 the water is compressed by 1.5 % at the bottom, and the speed of sound is 10 m/s.
    """
    return Environment(
        robot=physics.robot,
        friction=0.0,
        arena=(length, depth + 0.1, width),
        bed=Bed(water.material(bulk_modulus), depth),
        start=(0.4, 0.5),
        stance=Stance.SWIMMING,
        equilibration_frames=equilibration_frames(physics.gravity),
        gravity=(0.0, -physics.gravity, 0.0),
    )
