"""Ice: the ground without a grip."""

from zoobench.envs.base import LAND_ROBOT, OPEN_ARENA, SETTLING_FRAMES, Environment
from zoobench.envs.terrain import hills
from zoobench.registry import Kind, register


@register(Kind.ENV, "ice", tags=("land",))
def ice(
    *,
    friction: float = 0.05,
    relief: float = 0.0,
    wavelength: float = 0.1,
    terrain_seed: int = 0,
) -> Environment:
    """Firm, slippery ground.

    * `friction`: Coulomb coefficient [-]; 0.05 is the "low" of the specification's table 6.
    * `relief`: height of the highest hill of the ground [m]; 0 is level.
    * `wavelength`: of the widest hills [m].
    * `terrain_seed`: which hills.
    """
    return Environment(
        robot=LAND_ROBOT,
        friction=friction,
        arena=OPEN_ARENA,
        settling_frames=SETTLING_FRAMES,
        terrain=hills((OPEN_ARENA[0], OPEN_ARENA[2]), relief=relief, wavelength=wavelength, seed=terrain_seed),
    )
