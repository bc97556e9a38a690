"""Ocean: deep water with a neutrally buoyant swimmer, away from floor and surface."""

from zoobench.envs.base import EQUILIBRATION_FRAMES, SWIMMING_ROBOT, Environment, Stance
from zoobench.envs.bed import Bed
from zoobench.registry import Kind, register
from zoobench.sim.model.matter import WaterMaterial

_PROVISIONAL = (
    "held against drag, added mass and coasting its water is far too thick (a fish that coasts keeps 5 % of its speed "
    "after 10 ms, and 80 to 90 % in real water), so that moving in it is not swimming"
)


@register(Kind.ENV, "ocean", version=5, tags=("water", "fluid"), provisional=_PROVISIONAL)
def ocean(
    *,
    depth: float = 0.15625,
    length: float = 0.3125,
    width: float = 0.1875,
    bulk_modulus: float = 1e5,
) -> Environment:
    """Water three times as deep as a robot is tall, which floats in the middle.

    * `depth`: of the water [m].
    * `length`, `width`: of water and arena along x and z [m].
    * `bulk_modulus`: K [Pa]. At 1e5 the water is compressed by 1.5 % at the bottom, and the speed of sound is 10 m/s.
    """
    water = WaterMaterial(bulk_modulus=bulk_modulus, density=1000.0)
    return Environment(
        robot=SWIMMING_ROBOT,
        friction=0.0,
        arena=(length, depth + 0.1, width),
        bed=Bed(water, depth),
        start=(0.4, 0.5),
        stance=Stance.SWIMMING,
        equilibration_frames=EQUILIBRATION_FRAMES,
    )
