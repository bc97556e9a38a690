"""Checks of a world after every control frame: a state out of range has diverged, a robot in pieces has torn."""

import math
from dataclasses import dataclass

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.step_limits import LARGEST_COURANT, Condition

LARGEST_ESCAPE = 1.0
"""Cells that a particle may lie beyond a wall plane: the wall is first order, matter sinks in by part of a cell."""


@dataclass(frozen=True)
class Finding:
    """A quantity of a world that is out of its range.

    Attributes:
        quantity: its name; `value` is beyond `limit`.
        column: index of the particle responsible among the survey's culprits.
        advice: a remedy, for the message.
    """

    quantity: str
    value: float
    limit: float
    column: int
    advice: str


_TOO_FAST = "Matter moves too fast for the step: use a smaller Courant fraction."
_SHEARS_TOO_FAST = "Matter shears too fast for the step: use a smaller Courant fraction."


def diagnose(condition: Condition, dt: float, grid_spacing: float) -> Finding | None:
    """The gravest finding in a world's condition after a frame of steps `dt` [s]; None for a healthy one."""
    checks = (
        ("distance beyond the arena in cells", condition.beyond, LARGEST_ESCAPE, 2,
         "Widen the arena or shorten the episode."),
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


def torn(growth: float, fidelity: Fidelity) -> Finding | None:
    """The finding that a robot is torn: neighbours are more than a cell, and twice their distance at rest, apart.

    `growth` is from `separation`. Beyond this limit the grid resolves gaps between the particles (numerical fracture),
    and the robot soon moves in pieces.
    """
    limit = largest_separation(fidelity)
    if growth <= limit:
        return None
    advice = "The robot is torn: lower the actuation, or use more particles per cell."
    return Finding("distance of neighbours by that at rest", growth, limit, 4, advice)


def largest_separation(fidelity: Fidelity) -> float:
    """Largest admissible distance of neighbours by that at rest [-]: the larger of 2 and one cell."""
    return float(max(2.0, fidelity.particles_per_cell ** (1 / 3)))


def separation(rest: Array, now: Array, edge: float) -> float:
    """Largest ratio of two neighbours' distance now to that at rest [-], of places `[count, 3]`.

    Particles that are nearer at rest than those of a lattice, as on the surface of a body, count as its neighbours: by
    their own distance, a ratio of several would be no gap.

    A single particle's F is no measure of it: the grid does not resolve differences between the particles of one cell,
    and F there may be stretched by 2 where its neighbours are 1.3 times as far away as at rest.
    """
    from scipy.spatial import cKDTree

    if len(rest) < 2:
        return 1.0
    tree = cKDTree(rest)
    spacing = max(edge, float(np.median(tree.query(rest, k=2)[0][:, 1])))
    one, other = tree.query_pairs(1.01 * spacing, output_type="ndarray").T
    before, after = (np.linalg.norm(place[one] - place[other], axis=1) for place in (rest, now))
    return float((after / np.maximum(before, edge)).max(initial=0.0))
