"""Desert: a bed of dry sand."""

from zoobench.envs.base import Environment, bed_environment
from zoobench.envs.hills import hills
from zoobench.registry import Kind, register
from zoobench.sim.model.matter import SandMaterial


@register(Kind.ENV, "desert", tags=("land", "granular"))
def desert(
    *,
    friction: float = 0.5,
    thickness: float = 0.02,
    length: float = 0.3125,
    width: float = 0.1875,
    friction_angle: float = 45.0,
    relief: float = 0.0,
    wavelength: float = 0.1,
    terrain_seed: int = 0,
) -> Environment:
    """A bed of dry sand on rough ground.

    The bed fills the arena from wall to wall, so its size determines the cost of the environment. The default suffices
    for a robot of 0.1 m over 1.6 s: it starts at 0.35 of the length with 0.15 m free before it, and can turn on the
    spot. It is a whole number of cells at the fidelities draft and paper.

    * `friction`: Coulomb coefficient of the ground under the sand [-].
    * `thickness`: of the bed [m].
    * `length`, `width`: of bed and arena along x and z [m].
    * `friction_angle`: of the sand, in triaxial compression [degrees]; 45 in SoftZoo's reference.
    * `relief`: height of the highest hill of the ground [m]; 0 is level.
    * `wavelength`: of the widest hills [m].
    * `terrain_seed`: which hills.
    """
    # E 1e5 Pa, nu 0.2, rho 1600 kg/m^3: the medium of SoftZoo's reference implementation. Real sand is stiffer by far;
    # here stiffness only has to keep the elastic strain under a robot small (0.5 % per 500 Pa).
    sand = SandMaterial(youngs_modulus=1e5, poissons_ratio=0.2, density=1600.0, friction_angle=friction_angle)
    terrain = hills((length, width), relief=relief, wavelength=wavelength, seed=terrain_seed)
    return bed_environment(sand, friction=friction, thickness=thickness, length=length, width=width, terrain=terrain)
