"""Desert: a bed of dry sand."""

from zoobench.envs.base import BED_THICKNESS, Environment, bed_environment
from zoobench.envs.bed import Bed
from zoobench.envs.hills import LEVEL, Hills
from zoobench.envs.physics import LAND, Elasticity, Physics
from zoobench.envs.profile import LEVEL_WAY, Profile
from zoobench.registry import Kind, register
from zoobench.sim.model.matter import SandMaterial

# E and nu of SoftZoo's reference implementation, whose media all have the density of water
SAND = Elasticity(medium_density=1600.0)


@register(Kind.ENV, "desert", version=6, tags=("land", "granular"), added=("elasticity", "physics", "profile"))
def desert(
    *,
    friction: float = 0.5,
    slip: bool = True,
    robot_friction: float = 0.5,
    thickness: float = BED_THICKNESS,
    length: float = 0.3125,
    width: float = 0.1875,
    friction_angle: float = 45.0,
    elasticity: Elasticity = SAND,
    hills: Hills = LEVEL,
    profile: Profile = LEVEL_WAY,
    physics: Physics = LAND,
) -> Environment:
    """A bed of dry sand on rough ground.

    The bed fills the arena from wall to wall, so its size determines the cost of the environment. The default suffices
    for a robot of 0.1 m over 1.6 s: it starts at 0.35 of the length with 0.15 m free before it, and can turn on the
    spot. It is a whole number of cells at the fidelities draft and paper.

    * `friction`: Coulomb coefficient of the ground under the sand [-].
    * `slip`: whether robot and sand have velocity fields of their own; else the sand sticks to the robot.
    * `robot_friction`: Coulomb coefficient between them where they slip [-].
    * `thickness`: of the bed [m].
    * `length`, `width`: of bed and arena along x and z [m].
    * `friction_angle`: of the sand, in triaxial compression [degrees]; 45 in SoftZoo's reference.
    """
    material = SandMaterial(*elasticity.constants, friction_angle=friction_angle)
    return bed_environment(
        Bed(material, thickness, robot_friction if slip else None),
        friction=friction,
        size=(length, width),
        physics=physics,
        hills=hills,
        profile=profile,
    )
