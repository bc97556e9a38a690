"""Snow: a light bed that hardens under compression."""

from zoobench.envs.base import Environment, solid_bed_environment
from zoobench.envs.bed import SOLID_BED, SolidBed
from zoobench.envs.hills import LEVEL, Hills
from zoobench.envs.objects import NO_OBJECTS, Objects
from zoobench.envs.physics import LAND, Elasticity, Physics
from zoobench.envs.profile import LEVEL_WAY, Profile
from zoobench.registry import Kind, register
from zoobench.sim.model.laws.snow import SnowMaterial

# nu, theta_c, theta_s and rho of Stomakhin et al. 2013, table 2; E 1e5 Pa as in SoftZoo's reference implementation
SNOW = Elasticity(medium_density=400.0)


@register(
    Kind.ENV,
    "snow",
    version=8,
    tags=("land", "plastic"),
    added=("elasticity", "physics", "profile", "critical_compression", "critical_stretch", "objects"),
)
def snow(
    *,
    hardening: float = 10.0,
    critical_compression: float = 2.5e-2,
    critical_stretch: float = 7.5e-3,
    bed: SolidBed = SOLID_BED,
    elasticity: Elasticity = SNOW,
    hills: Hills = LEVEL,
    profile: Profile = LEVEL_WAY,
    physics: Physics = LAND,
    objects: Objects = NO_OBJECTS,
) -> Environment:
    """A bed of snow on rough ground.

    The bed has no end, as in `desert`.

    * `hardening`: xi of Stomakhin et al. 2013 [-]; 1 in SoftZoo's reference.
    * `critical_compression`: theta_c, the elastic compression at which it yields [-].
    * `critical_stretch`: theta_s, the elastic extension at which it yields [-]; 4.5e-3 in SoftZoo's reference.
    """
    material = SnowMaterial(
        *elasticity.constants,
        critical_compression=critical_compression,
        critical_stretch=critical_stretch,
        hardening=hardening,
    )
    return solid_bed_environment(material, bed, physics=physics, hills=hills, profile=profile, objects=objects)
