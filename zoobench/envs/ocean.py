"""Ocean: deep water with a neutrally buoyant swimmer, away from floor and surface."""

from zoobench.envs.base import Environment, Stance, equilibration_frames
from zoobench.envs.bed import Bed
from zoobench.envs.hills import LEVEL, Hills
from zoobench.envs.physics import FRESH_WATER, SWIMMER, Physics, Water
from zoobench.envs.profile import LEVEL_WAY, Profile
from zoobench.registry import Kind, register

START = 0.4
"""Of the robot, relative to the length."""

_ROUGH = 0.5
"""Friction of a floor that is not level [-]. To the grid it is a staircase, down which water would stream for ever: at
draft 45 mm/s on a slope of 5 degrees, where friction leaves 0.8 mm/s."""

_PROVISIONAL = (
    "held against drag, added mass and coasting its water is far too thick (a fish that coasts keeps 5 % of its speed "
    "after 10 ms, and 80 to 90 % in real water), so that moving in it is not swimming"
)


@register(
    Kind.ENV, "ocean", version=8, tags=("water", "fluid"), added=("water", "hills", "profile", "physics"),
    provisional=_PROVISIONAL,
)  # fmt: skip
def ocean(
    *,
    depth: float = 0.15625,
    length: float = 0.3125,
    width: float = 0.1875,
    bulk_modulus: float = 1e5,
    water: Water = FRESH_WATER,
    hills: Hills = LEVEL,
    profile: Profile = LEVEL_WAY,
    physics: Physics = SWIMMER,
) -> Environment:
    """Water three times as deep as a robot is tall, which floats in the middle.

    A level floor has no friction; hills, slopes, steps and gaps are rough, so that water rests on them.

    * `depth`: of the water above the lowest ground [m].
    * `length`, `width`: of water and arena along x and z [m].
    * `bulk_modulus`: K [Pa]. At 1e5 the water is compressed by 1.5 % at the bottom, and the speed of sound is 10 m/s.
    """
    terrain = profile.terrain((length, width), START * length, hills)
    return Environment(
        robot=physics.robot,
        friction=0.0 if terrain is None else _ROUGH,
        arena=(length, depth + 0.1, width),
        bed=Bed(water.material(bulk_modulus), depth),
        start=(START, 0.5),
        stance=Stance.SWIMMING,
        equilibration_frames=equilibration_frames(physics.gravity),
        gravity=(0.0, -physics.gravity, 0.0),
        terrain=terrain,
    )
