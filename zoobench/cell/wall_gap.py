"""How near a robot comes to the sides of its arena: nearer than three cells, they have a part in its score."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from zoobench.arrays import Array
from zoobench.designs.feasibility import SOLID
from zoobench.errors import BEYOND, Divergence
from zoobench.sim.model.scene import Scene
from zoobench.spec import LEAST_WALL_GAP, WALL_GAP
from zoobench.tasks.base import Metric, Motion

_ADVICE = "The robot met a side of its arena: give a larger arena where it has a length, or fewer frames."
"""Where a robot failed that had come near a side of its arena, whatever the finding."""

_PRESSED = (
    "A base that moves has pressed what is below it through the ground: have it go down less, by a lower base_speed or "
    "fewer frames."
)

_RAISED = "A base that moves has gone through the ceiling: have it rise less, by a lower base_speed or fewer frames."

_IN_WATER = (
    "The body is too soft for its muscles and the water: give {}weaker muscles (muscle_strength) or a stiffer body "
    "(youngs_modulus)."
)
"""Where a robot failed in water by forces on its surface, which has no sides; shorter steps do not help there."""

_SIDES = (0, 2)
"""The axes along which the arena has sides; the ground and the ceiling do not count."""


def gaps_of(motion: Motion, scene: Scene, offsets: Array, grid_spacing: float) -> Array:
    """Gaps of robot and objects of a motion's only world from the sides of the arena `[frames + 1]` [cells].

    Args:
        offsets: how far the arena had moved after the robot `[frames + 1, 3]` [m].
        grid_spacing: length of a cell [m].
    """
    places, present = motion.positions[:, 0].detach().numpy(), motion.existing[0].detach().numpy() > SOLID
    held = {thing.name for thing in scene.objects if thing.body.anchor}
    for each in (each for name, each in motion.objects.items() if name not in held):
        places = np.concatenate([places, each.positions[:, 0].detach().numpy()], axis=1)
        present = np.concatenate([present, np.ones(len(each.masses), bool)])
    return wall_gaps(places, present, scene.lower + offsets, scene.upper + offsets, grid_spacing)


def reading(gaps: Array) -> dict[str, Metric]:
    """The smallest of some gaps [cells] as a metric of the episode."""
    return {WALL_GAP: Metric(float(gaps.min()), "cells")}


def told(failure: Divergence, gap: float, scene: Scene) -> Divergence:
    """The failure of a robot that had come so near to a side [cells]: near one it has met that, and has not torn.

    A base that moves, which nothing stops, takes its robot through the ground and the ceiling. Water by forces on the
    surface has no sides.
    """
    if scene.surface_water is not None:
        return replace(
            failure, advice=_IN_WATER.format("a weaker current, " if any(scene.surface_water.current) else "")
        )
    if gap < LEAST_WALL_GAP:
        return replace(failure, advice=_ADVICE)
    if scene.robot.drive is not None and failure.quantity == BEYOND:
        return replace(failure, advice=_PRESSED if failure.place[1] < scene.lower[1] else _RAISED)
    return failure


def wall_gaps(
    positions: Array, present: NDArray[np.bool_], lower: ArrayLike, upper: ArrayLike, grid_spacing: float
) -> Array:
    """Distance of a robot's nearest particle from a side of the arena, after every frame `[frames + 1]` [cells].

    Args:
        positions: `[frames + 1, particle_count, 3]` [m].
        present: `[particle_count]` which particles the robot has; without any it is infinitely far away.
        lower, upper: corners of the arena, `[3]` or, of one that moves, `[frames + 1, 3]` [m].
        grid_spacing: length of a cell [m].
    """
    low, high = np.asarray(lower), np.asarray(upper)
    gaps = np.full(len(positions), np.inf)
    for axis in _SIDES:
        places = positions[:, :, axis]
        least = places.min(axis=1, where=present, initial=np.inf) - low[..., axis]
        most = high[..., axis] - places.max(axis=1, where=present, initial=-np.inf)
        gaps = np.minimum(gaps, np.minimum(least, most))
    return np.asarray(gaps / grid_spacing, dtype=np.float64)
