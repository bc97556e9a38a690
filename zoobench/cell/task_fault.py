"""Tasks against environments and bodies: whether there is an object where one is needed, a muscle by which to turn, and
room to follow a target."""

from functools import lru_cache

import numpy as np

from zoobench import registry
from zoobench.cell.robot import sampled
from zoobench.designs.base import Body
from zoobench.envs.base import Environment
from zoobench.errors import SceneError, UsageError
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.spec import FRAME_SECONDS, Ref, RunSpec

_ROUNDING = 1e-9  # [m]


def task_fault(spec: RunSpec) -> str:
    """Why a run's task is not possible in its environment, or to its body; empty if it is.

    A task with an object needs an environment with one. What is the same left and right turns nowhere. The target of
    another task must be followed to the end: a path from a file must last as long as the episode, and where the arena
    does not follow the robot, the target must keep half of the robot's length away from its walls. A body that cannot
    be made is refused elsewhere.
    """
    return _fault(spec.env, spec.task, spec.design, spec.fidelity, spec.frames)


def object_fault(env: Ref, task: Ref) -> str:
    """Why a task that needs an object is not possible in an environment; empty if it is, or needs none."""
    # a task of a plug-in may lack new parts of the protocol
    if not getattr(registry.create(Kind.TASK, task), "needs_object", False) or registry.create(Kind.ENV, env).objects:
        return ""
    return (
        f"The task {task.name!r} needs an object, and {env.name!r} has none here. Give one, for example "
        "--env 'ground[object=box]'."
    )


@lru_cache
def _fault(env_ref: Ref, task_ref: Ref, design: Ref, fidelity: Ref, frames: int) -> str:
    if fault := object_fault(env_ref, task_ref):
        return fault
    env: Environment = registry.create(Kind.ENV, env_ref)
    task = registry.create(Kind.TASK, task_ref)
    grid: Fidelity = registry.create(Kind.FIDELITY, fidelity)
    if getattr(task, "needs_sides", False):
        try:
            _, body = sampled(design, grid)
        except (SceneError, UsageError):
            return ""
        if _is_mirrored(body):
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
