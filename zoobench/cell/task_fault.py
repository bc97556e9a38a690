"""Tasks against environments and bodies: whether a task makes sense there, as there is an object where one is needed, a
muscle by which to turn, and room to follow a target."""

from functools import cache, lru_cache

import numpy as np

from zoobench import registry
from zoobench.cell.firm_ground import HELD
from zoobench.cell.robot import sampled
from zoobench.designs.base import Body
from zoobench.envs.base import Environment, Stance
from zoobench.errors import SceneError, UsageError
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.spec import FRAME_SECONDS, Ref, RunSpec
from zoobench.tasks.mix import Mix
from zoobench.tasks.task_place import TaskPlace

_ROUNDING = 1e-9  # [m]
_COARSE = Ref("draft")


def task_fault(spec: RunSpec) -> str:
    """Why a run's task is not possible in its environment, or to its body; empty if it is.

    A task with an object needs an environment with one, and what hangs from a base that stays goes nowhere; a task may
    refuse more, see `Task.fault`. What is the same left and right turns nowhere. The target of another task must be
    followed to the end: a path from a file must last as long as the episode, and where the arena does not follow the
    robot, the target must keep half of the robot's length away from its walls. A body that cannot be made is refused
    elsewhere.
    """
    return _fault(spec.env, spec.task, spec.design, spec.fidelity, spec.frames)


def sense_fault(env: Ref, task: Ref, design: Ref | None = None) -> str:
    """Why a task makes no sense in an environment, or for a design, by their settings alone; empty if it does.

    Args:
        design: None for a body that stands free.
    """
    made, place = registry.create(Kind.TASK, task), registry.create(Kind.ENV, env)
    if not isinstance(place, Environment):
        return ""
    # a task of a plug-in may lack new parts of the protocol
    if getattr(made, "needs_object", False) and not place.objects:
        usual = ",".join(f"{name}={value}" for name, value in getattr(made, "usual_settings", {}).items())
        return (
            f"The task {task.name!r} needs an object, and {env.name!r} has none here. Choose an environment with one, "
            f"such as 'ground[{usual or 'object=box'}]'."
        )
    where = _place_of(place, design)
    parts = [part for _, part in made.terms.values()] if isinstance(made, Mix) else [made]
    if design is not None and where.is_held and any(getattr(part, "needs_way", False) for part in parts):
        return (
            f"The design {design.name!r} is held at its base, and {task.name!r} needs a body that is free. Choose "
            "another task, such as 'reach', or another design."
        )
    return str(made.fault(where)) if hasattr(made, "fault") else ""


def _place_of(env: Environment, design: Ref | None) -> TaskPlace:
    hangs = design is not None and HELD in registry.get(Kind.DESIGN, design.name, design.version).tags
    is_moved = hangs and bool(design and design.kwargs.get("base_speed"))
    objects = env.objects
    is_level = env.profile.is_level and not env.hills.relief and not (objects or env.obstacles)
    return TaskPlace(
        object_place=objects.object_place if objects else "",
        is_thrown=objects.moves,
        is_raised=bool(objects.object_height and env.obstacles),
        is_flat=is_level and env.stance is Stance.STANDING,
        is_deep=env.is_deep,
        is_held=hangs and not is_moved,
        is_moved=is_moved,
    )


@lru_cache
def _fault(env_ref: Ref, task_ref: Ref, design: Ref, fidelity: Ref, frames: int) -> str:
    if fault := sense_fault(env_ref, task_ref, design):
        return fault
    env: Environment = registry.create(Kind.ENV, env_ref)
    task = registry.create(Kind.TASK, task_ref)
    grid: Fidelity = registry.create(Kind.FIDELITY, fidelity)
    if getattr(task, "needs_sides", False) and _has_no_sides(design, fidelity):
        return (
            f"Each muscle of {design.name!r} is the same left and right, so that nothing turns it. Choose another "
            f"task than {task_ref.name!r}, or a body with muscles left and right, as 'orca[paired=true]'."
        )
    routes = getattr(task, "routes", ())
    if not routes:
        return ""
    times = np.arange(frames + 1) * FRAME_SECONDS
    sizes, start = (each[[0, 2]] for each in env.standing_size(frames * FRAME_SECONDS, grid.grid_spacing))
    try:
        paths = [start + route.positions(times)[:, [0, 2]] for route in routes]
        if env.follows:  # there is room, whatever the body, which takes up to a second to sample
            return ""
        _, body = sampled(design, grid)
    except SceneError:
        return ""
    except UsageError as error:
        return str(error)
    room = 0.5 * float(np.ptp(body.positions[:, 0]))
    for places in paths:
        outside = ((places < room - _ROUNDING) | (places > sizes - room + _ROUNDING)).any(axis=1)
        if outside.any():
            first = int(outside.argmax())
            return (
                f"The target leaves the arena of {env_ref.name!r}: after {times[first]:.3g} s it is at "
                f"x = {places[first, 0]:.3g} m, z = {places[first, 1]:.3g} m, nearer than half the robot's length, "
                f"{room:.3g} m, to a wall of the {sizes[0]:.4g} m by {sizes[1]:.4g} m. Give a lower speed, another "
                "path, fewer frames, or a larger bed where the environment has a length and a width."
            )
    return ""


def _has_no_sides(design: Ref, fidelity: Ref) -> bool:
    """Whether nothing turns a body: nearly every one has sides at `draft` already, and need not be sampled again."""
    return _has_sides(design, _COARSE) is not True and _has_sides(design, fidelity) is False


@cache
def _has_sides(design: Ref, fidelity: Ref) -> bool | None:
    """Whether some muscle differs left and right; None of a body that cannot be sampled at this fidelity."""
    try:
        _, body = sampled(design, registry.create(Kind.FIDELITY, fidelity))
    except (SceneError, UsageError):
        return None
    return not _is_mirrored(body)


def _is_mirrored(body: Body) -> bool:
    """Whether the body and each of its muscles are the same left and right, and stay so: no space forms it, no base
    moves it."""
    from scipy.spatial import cKDTree

    if body.malleable or body.base_channels:
        return False
    places = body.positions - (0.0, 0.0, float(body.positions[:, 2].max() + body.positions[:, 2].min()) / 2)
    apart, twins = cKDTree(places).query(places * (1.0, 1.0, -1.0))
    differing = np.abs(body.muscle_membership[twins] - body.muscle_membership)
    return bool(apart.max() < _ROUNDING and differing.max(initial=0.0) < _ROUNDING)
