"""Ice: firm ground with little friction."""

from zoobench.envs.base import Environment, firm_environment
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
    return firm_environment(friction=friction, relief=relief, wavelength=wavelength, terrain_seed=terrain_seed)
