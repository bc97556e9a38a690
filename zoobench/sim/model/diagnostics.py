"""Checks of a world after every control frame: a state out of range has diverged, a body in pieces has torn."""

import math
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from zoobench.arrays import Array
from zoobench.errors import BEYOND
from zoobench.sim.model.scene import Scene
from zoobench.sim.model.state import IntArray
from zoobench.sim.model.step_limits import LARGEST_COURANT, Condition

TORN = "distance of neighbours by that at rest"
"""The quantity of a finding that a body is torn."""

LARGEST_ESCAPE = 1.0
"""Cells that a particle may lie beyond a wall plane: the wall is first order, matter sinks in by part of a cell."""


@dataclass(frozen=True)
class Finding:
    """A quantity of a world that is out of its range.

    Attributes:
        quantity: its name; `value` is beyond `limit`.
        column: index of the particle responsible among the survey's culprits.
        advice: a remedy, for the message.
        particle: the one responsible; None if the survey knows it.
    """

    quantity: str
    value: float
    limit: float
    column: int
    advice: str
    particle: int | None = None


_TOO_FAST = "Matter moves too fast for the step: use a smaller Courant fraction."
_STOPS_NOT = "Nothing stops a base that moves: have it move less, by a lower base_speed or fewer frames."
_SHEARS_TOO_FAST = "Matter shears too fast for the step: use a smaller Courant fraction."


def diagnose(condition: Condition, dt: float, grid_spacing: float) -> Finding | None:
    """The gravest finding in a world's condition after a frame of steps `dt` [s]; None for a healthy one."""
    checks = (
        (BEYOND, condition.beyond, LARGEST_ESCAPE, 2, "Widen the arena or shorten the episode."),
        ("Courant number", condition.speed * dt / grid_spacing, LARGEST_COURANT, 0, _TOO_FAST),
        ("velocity gradient times dt", condition.shear * dt, 2 * LARGEST_COURANT, 1, _SHEARS_TOO_FAST),
    )  # fmt: skip
    for _, value, limit, column, _ in checks:
        if not math.isfinite(value):
            advice = "Lower the actuation or the stiffness, or use a smaller Courant fraction."
            return Finding("finite state", value, limit, column, advice)
    if not condition.smallest_j > 0.0:
        advice = "An element is inverted: lower the actuation or the muscle strength, or use a finer fidelity."
        return Finding("det F", condition.smallest_j, 0.0, 3, advice)
    for quantity, value, limit, column, advice in checks:
        if value > limit:
            return Finding(quantity, value, limit, column, advice)
    return None


def torn(growth: float, particle: int, stretch: float, cell: float, body: str = "robot") -> Finding | None:
    """The finding that a body is torn (numerical fracture): neighbours are too far apart, and it soon moves in pieces.

    That is more than a cell, and twice their distance at rest, where some F is stretched as far: the grid resolves the
    gap. And more than two cells whatever F is: then at most the outermost nodes of their stencils are the same, and
    they hardly feel each other.

    Args:
        growth, particle: from `Neighbours`.
        stretch: largest principal stretch of any F.
        cell: edge of a cell by the distance of neighbours at rest [-].
        body: its name; an object has no actuation that could be lowered.
    """
    cell = max(2.0, cell)
    limit = cell if stretch > cell else 2.0 * cell
    if growth <= limit:
        return None
    remedy = "lower the actuation" if body == "robot" else "make it stiffer"
    advice = f"The {body} is torn: {remedy}, or use more particles per cell."
    return Finding(TORN, growth, limit, 0, advice, particle)


class HeldMatter:
    """What a base that moves would go through, since nothing stops it: the ground, and bodies that are held."""

    def __init__(self, scene: Scene) -> None:
        from scipy.spatial import cKDTree

        held = [each.body for each in scene.objects if each.body.anchor]
        self._floor = scene.lower[1] if scene.ground is not None else -math.inf
        self._trees = [(cKDTree(body.positions), 0.5 * float(body.volumes.max()) ** (1 / 3)) for body in held]

    def entered(self, places: Array, particles: IntArray) -> Finding | None:
        """The finding that particles of a base, at these places `[count, 3]` [m], are within any of it."""
        low = int(places[:, 1].argmin())
        if places[low, 1] < self._floor:
            depth = float(self._floor - places[low, 1])
            return Finding("depth of the base in the ground [m]", depth, 0.0, 0, _STOPS_NOT, int(particles[low]))
        for tree, near in self._trees:
            distances, _ = tree.query(places, p=math.inf, distance_upper_bound=near)  # cubes
            inside = int(distances.argmin())
            if distances[inside] < near:
                depth = near - float(distances[inside])
                what = "depth of the base in what is held [m]"
                return Finding(what, depth, 0.0, 0, _STOPS_NOT, int(particles[inside]))
        return None


class Neighbours:
    """Which particles of an elastic body are neighbours, and how far apart they come to be.

    A particle's F is no measure of that. The grid does not resolve differences between the particles of one cell: F may
    be stretched by 2 where the neighbours are 1.3 times as far away as at rest. And particles with a cell between them
    feel little of each other: neighbours have been 20 times as far away where no F was stretched by 2.

    Args:
        rest: places of all particles at rest `[count, 3]` [m].
        edge: of the cube that a particle stands for [m]. Particles that are nearer at rest, as on the surface of a
            body, count as a lattice's neighbours: by their own distance, a ratio of several would be no gap.
    """

    def __init__(self, rest: Array, edge: float) -> None:
        from scipy.spatial import cKDTree

        self._one = self._other = np.zeros(0, np.int64)
        if len(rest) > 1:
            tree = cKDTree(rest)
            spacing = max(edge, float(np.median(tree.query(rest, k=2)[0][:, 1])))
            self._one, self._other = tree.query_pairs(1.01 * spacing, output_type="ndarray").T
        between = np.linalg.norm(rest[self._one] - rest[self._other], axis=1)
        self._squares_at_rest = np.square(np.maximum(between, edge))
        self._there: tuple[Tensor, ...] | None = None  # the same where `growths` has found the places

    def growth(self, now: NDArray[np.floating], present: NDArray[np.bool_]) -> tuple[float, int]:
        """Largest ratio of two neighbours' distance to that at rest [-], and one of the two particles.

        Args:
            now: places `[count, 3]` [m].
            present: `[count]` the others have no neighbours.
        """
        places = np.ascontiguousarray(now.T)  # by rows of one coordinate it takes a fifth of the time
        apart = places.take(self._one, axis=1) - places.take(self._other, axis=1)
        squares = np.square(apart).sum(axis=0) / self._squares_at_rest
        if not present.all():
            squares *= present[self._one] & present[self._other]
        if not len(squares):
            return 1.0, 0
        widest = int(squares.argmax())
        return math.sqrt(squares[widest]), int(self._one[widest])

    def growths(self, now: Tensor, present: NDArray[np.bool_]) -> list[tuple[float, int]]:
        """`growth` in all worlds at once, where the places are: `[worlds, count, 3]` and `[worlds, count]`."""
        if not len(self._one):
            return [(1.0, 0)] * len(now)
        if self._there is None:
            pairs = (torch.as_tensor(each, device=now.device) for each in (self._one, self._other))
            self._there = (*pairs, torch.as_tensor(self._squares_at_rest).to(now))
        one, other, squares_at_rest = self._there
        there = torch.as_tensor(present, device=now.device)
        squares = (now[:, one] - now[:, other]).square().sum(2) / squares_at_rest
        widest, places = (squares * (there[:, one] & there[:, other])).max(1)
        return list(zip(widest.sqrt().tolist(), one[places].tolist(), strict=True))
