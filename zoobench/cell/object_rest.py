"""Whether the objects of a scene are where they were put when the episode begins, or fell while it came to rest."""

import math

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.elastic_bodies import SceneObject
from zoobench.sim.model.scene import Scene
from zoobench.tasks.base import axes_of

_FARTHEST, _DEEPEST = 0.25, 0.5
"""Way of its centre along the ground, and up or down, by its longest side, up to which an object is where it was put:
with the back that it lies on it sinks by a twentieth, on a grid with two cells across it by a quarter."""

_STEEPEST = 30.0
"""Turn up to which it is [degrees]: on a slope it lies down on the ground."""


def object_fault(scene: Scene, positions: Array) -> str:
    """Why the scene's objects do not count as being where they were put; empty if they do.

    Args:
        positions: of all particles when the episode begins, the robot's first `[particle_count, 3]` [m].
    """
    faults = (_fault(each, positions[scene.slice_of(each.name)]) for each in scene.objects)
    return next((fault for fault in faults if fault), "")


def _fault(thing: SceneObject, positions: Array) -> str:
    import torch

    put, share = thing.body.positions, thing.body.masses / thing.body.masses.sum()
    x, y, z = share @ (positions - put)
    side = float(np.ptp(put, axis=0).max())
    now, rest, weights = (torch.as_tensor(np.asarray(each, np.float64)) for each in (positions, put, share))
    trace = float(axes_of(now, rest, weights).trace())
    turned = math.degrees(math.acos(min(max((trace - 1.0) / 2.0, -1.0), 1.0)))
    if math.hypot(x, z) <= _FARTHEST * side and abs(y) <= _DEEPEST * side and turned <= _STEEPEST:
        return ""
    return (
        f"The {thing.name} does not stay where it was put: before the episode, while everything comes to rest, it goes "
        f"{1e3 * math.hypot(x, y, z):.1f} mm and turns by {turned:.0f} degrees. Give level ground, a flatter back, "
        "another object_shift, a flatter object such as a sheet, fewer, or an object_height with something below it."
    )
