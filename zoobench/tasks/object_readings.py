"""What tasks with an object have in common: what a closed loop sees of it, and readings of its motion."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from zoobench.tasks.base import Motion, ObservedPart, Situation, constant
from zoobench.tasks.readings import Readings, common_readings

if TYPE_CHECKING:
    from torch import Tensor

_SECONDS = 0.05
"""Time by which velocities are measured: that of a period of the fastest controllers by 2 pi."""

OBJECT_PARTS: Mapping[str, ObservedPart] = {
    "object_place": ObservedPart("body lengths", "of its centre from the robot's: ahead, up, right"),
    "object_velocity": ObservedPart("20 body lengths/s", "of its centre: ahead, up, right"),
    "object_axes": ObservedPart("-", "directions of its x and y axis: ahead, up, right each"),
}


def object_seen(situation: Situation) -> dict[str, "Tensor"]:
    """Place, velocity and axes of the first object, see `OBJECT_PARTS`."""
    import torch

    thing, up = situation.object, constant((0.0, 1.0, 0.0), situation.centre.dtype)
    view = torch.stack([situation.ahead, up, situation.right])
    return {
        "object_place": view @ (thing.centre - situation.centre) / situation.length,
        "object_velocity": view @ thing.velocity * (_SECONDS / situation.length),
        "object_axes": (thing.axes[:2] @ view.T).reshape(-1),
    }


def object_way(motion: Motion) -> "Tensor":
    """Displacement of the object's centre since the start, at the end of every frame `[frames, worlds, 3]` [m]."""
    centre = motion.object.centre_of_mass()
    way: Tensor = centre[1:] - centre[0]
    return way


def robot_way(motion: Motion) -> "Tensor":
    """The same of the robot's centre of mass."""
    centre = motion.centre_of_mass()
    way: Tensor = centre[1:] - centre[0]
    return way


def object_tilt(motion: Motion) -> "Tensor":
    """Angle of the object's upright axis from the vertical at every state `[frames + 1, worlds]` [rad]."""
    import torch

    upright = motion.object.axes()[..., 1, :]
    level = torch.sqrt(upright[..., 0] ** 2 + upright[..., 2] ** 2 + 1e-18)  # whose root has a derivative at 0
    return torch.atan2(level, upright[..., 1])


def object_turn(motion: Motion) -> "Tensor":
    """Turn of the object about the vertical since the start, counter-clockwise seen from above, at the end of every
    frame `[frames, worlds]` [rad].

    The sum of the turns of the frames, each below half a turn: that which fits the horizontal parts of all axes best.
    """
    import torch

    axes = motion.object.axes()
    before, after = axes[:-1], axes[1:]
    along = before[..., 0] * after[..., 0] + before[..., 2] * after[..., 2]
    across = before[..., 2] * after[..., 0] - before[..., 0] * after[..., 2]
    return torch.atan2(across.sum(dim=-1), along.sum(dim=-1)).cumsum(dim=0)


def object_readings(motion: Motion) -> Readings:
    """How far the object went, rose, tilted and turned `[worlds]` each, and the common readings of the robot."""
    import torch

    way = object_way(motion)
    return {
        "object_distance": (torch.linalg.vector_norm(way[-1][..., [0, 2]], dim=-1), "m"),
        "object_rise": (way[-1][..., 1], "m"),
        "object_highest": (way[..., 1].amax(dim=0), "m"),
        "object_lowest": (way[..., 1].amin(dim=0), "m"),
        "object_tilt": (object_tilt(motion)[-1], "rad"),
        "object_turn": (object_turn(motion)[-1], "rad"),
        **common_readings(motion),
    }
