"""Whether a run's scene can be made and stepped, before anything is simulated, where its settings put that in doubt."""

from functools import lru_cache

from zoobench import registry
from zoobench.cell.robot import sampled
from zoobench.designs.space import DesignSpace
from zoobench.envs.base import Environment
from zoobench.errors import SceneError, UsageError
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.step_limits import choose_step
from zoobench.spec import FRAME_SECONDS, Ref, RunSpec


def scene_fault(spec: RunSpec) -> str:
    """Why a run's scene cannot be made or stepped; empty if it can, or if no setting puts that in doubt.

    Settings that do are those of environment and design other than their defaults, a fixed step, and a grid or
    particles coarser than those of the fidelity's name. A body that cannot be made for other reasons is refused
    elsewhere.
    """
    return _fault(spec.env, spec.design, spec.fidelity, spec.frames)


def thrown_fault(env: Environment, *, is_fixed: bool) -> str:
    """Why an object cannot begin with a velocity beside a body, which may be fixed; empty if it can or does not."""
    if is_fixed or not env.objects.moves:
        return ""
    return (
        "An object cannot begin with a velocity beside the bodies of a design space, each of which comes to rest in "
        "its own episode. Choose a fixed design, or leave out object_speed and object_speed_up."
    )


@lru_cache
def _fault(env_ref: Ref, design: Ref, fidelity: Ref, frames: int) -> str:
    env = registry.create(Kind.ENV, env_ref)
    if not isinstance(env, Environment):
        return ""
    grid: Fidelity = registry.create(Kind.FIDELITY, fidelity)
    is_coarse = _is_coarse(fidelity, grid)
    is_plain = registry.short(Kind.ENV, env_ref) == env_ref.name and registry.short(Kind.DESIGN, design) == design.name
    if is_plain and not (grid.step or is_coarse):
        return ""
    try:
        made, body = sampled(design, grid)
    except SceneError as error:
        return str(error) if is_coarse else ""
    except UsageError:
        return ""
    if fault := thrown_fault(env, is_fixed=not isinstance(made, DesignSpace)):
        return fault
    try:
        scene = env.scene(body, grid, frames * FRAME_SECONDS)
        choose_step(scene, env.simulated(grid), FRAME_SECONDS)
    except UsageError as error:
        return str(error)
    return ""


def _is_coarse(fidelity: Ref, grid: Fidelity) -> bool:
    """Whether a fidelity has larger cells, or fewer particles in each, than its name stands for."""
    named: Fidelity = registry.create(Kind.FIDELITY, Ref(fidelity.name, fidelity.version))
    return grid.grid_spacing > named.grid_spacing or grid.particles_per_cell < named.particles_per_cell
