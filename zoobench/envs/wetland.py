"""Wetland: mud with a small yield stress."""

from zoobench.envs.base import Environment, solid_bed_environment
from zoobench.envs.bed import SOLID_BED, SolidBed
from zoobench.envs.hills import LEVEL, Hills
from zoobench.envs.objects import NO_OBJECTS, Objects
from zoobench.envs.physics import LAND, Elasticity, Physics
from zoobench.envs.profile import LEVEL_WAY, Profile
from zoobench.registry import Kind, register
from zoobench.sim.model.laws.mud import MudMaterial

# E and nu of SoftZoo's reference implementation, whose media all have the density of water
MUD = Elasticity(medium_density=1400.0)


_PROVISIONAL = (
    "in mud of 800 Pa trained gaits of four animals move at draft, standard and paper within 32, 30 and 16 % of their "
    "speed at fine (caterpillar and baby seal within 15, 8 and 3 %), and turn at standard within 29 % (without the "
    "fish within 11 %); the fish, and some gaits of the panda, are slower on each finer grid; paths were not measured, "
    "and softer mud is not resolved"
)


@register(
    Kind.ENV, "wetland", version=11, tags=("land", "plastic", "fluid"),
    added=("elasticity", "physics", "profile", "objects"), provisional=_PROVISIONAL,
)  # fmt: skip
def wetland(
    *,
    yield_stress: float = 800.0,
    viscosity: float = 1.0,
    bed: SolidBed = SOLID_BED,
    elasticity: Elasticity = MUD,
    hills: Hills = LEVEL,
    profile: Profile = LEVEL_WAY,
    physics: Physics = LAND,
    objects: Objects = NO_OBJECTS,
) -> Environment:
    """A bed of wet mud on rough ground: a fluid in volume, a weak plastic solid in shear.

    The bed has no end, as in `desert`.

    * `yield_stress`: norm of the deviatoric stress at which it flows [Pa], by default that of a mud flat. Wetter
      muds have 50 to 500; below 400 they hardly bear a robot, and on a coarse grid too much of it.
    * `viscosity`: [Pa s].
    """
    material = MudMaterial(*elasticity.constants, yield_stress=yield_stress, viscosity=viscosity)
    return solid_bed_environment(material, bed, physics=physics, hills=hills, profile=profile, objects=objects)
