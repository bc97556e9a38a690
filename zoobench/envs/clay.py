"""Clay: a soft plastic solid."""

from zoobench.envs.base import Environment, bed_environment
from zoobench.envs.hills import hills
from zoobench.registry import Kind, register
from zoobench.sim.model.matter import ClayMaterial


@register(Kind.ENV, "clay", tags=("land", "plastic"))
def clay(
    *,
    friction: float = 0.5,
    thickness: float = 0.02,
    length: float = 0.3125,
    width: float = 0.1875,
    yield_stress: float = 200.0,
    relief: float = 0.0,
    wavelength: float = 0.1,
    terrain_seed: int = 0,
) -> Environment:
    """A bed of soft clay on rough ground.

    The bed fills the arena from wall to wall, as in `desert`.

    * `friction`: Coulomb coefficient of the ground under the clay [-].
    * `thickness`: of the bed [m].
    * `length`, `width`: of bed and arena along x and z [m].
    * `yield_stress`: norm of the deviatoric stress at which it flows [Pa]; 200 in SoftZoo's reference.
    * `relief`: height of the highest hill of the ground [m]; 0 is level.
    * `wavelength`: of the widest hills [m].
    * `terrain_seed`: which hills.
    """
    # E 1e5 Pa, nu 0.2, rho 1800 kg/m^3: the medium of SoftZoo's reference implementation
    bed = ClayMaterial(youngs_modulus=1e5, poissons_ratio=0.2, density=1800.0, yield_stress=yield_stress)
    terrain = hills((length, width), relief=relief, wavelength=wavelength, seed=terrain_seed)
    return bed_environment(bed, friction=friction, thickness=thickness, length=length, width=width, terrain=terrain)
