"""Snow: a light bed that hardens under compression."""

from zoobench.envs.base import Environment, bed_environment
from zoobench.envs.hills import hills
from zoobench.registry import Kind, register
from zoobench.sim.model.matter import SnowMaterial


@register(Kind.ENV, "snow", tags=("land", "plastic"))
def snow(
    *,
    friction: float = 0.5,
    thickness: float = 0.02,
    length: float = 0.3125,
    width: float = 0.1875,
    hardening: float = 10.0,
    relief: float = 0.0,
    wavelength: float = 0.1,
    terrain_seed: int = 0,
) -> Environment:
    """A bed of snow on rough ground.

    The bed fills the arena from wall to wall, as in `desert`.

    * `friction`: Coulomb coefficient of the ground under the snow [-].
    * `thickness`: of the bed [m].
    * `length`, `width`: of bed and arena along x and z [m].
    * `hardening`: xi of Stomakhin et al. 2013 [-]; 1 in SoftZoo's reference.
    * `relief`: height of the highest hill of the ground [m]; 0 is level.
    * `wavelength`: of the widest hills [m].
    * `terrain_seed`: which hills.
    """
    # nu, theta_c, theta_s and rho of Stomakhin et al. 2013, table 2; E 1e5 Pa as in SoftZoo's reference implementation
    bed = SnowMaterial(
        youngs_modulus=1e5,
        poissons_ratio=0.2,
        density=400.0,
        critical_compression=2.5e-2,
        critical_stretch=7.5e-3,
        hardening=hardening,
    )
    terrain = hills((length, width), relief=relief, wavelength=wavelength, seed=terrain_seed)
    return bed_environment(bed, friction=friction, thickness=thickness, length=length, width=width, terrain=terrain)
