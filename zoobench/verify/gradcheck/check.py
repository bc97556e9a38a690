"""`zoobench gradcheck`: is the gradient the slope? Adjoints against central differences, in double precision.

Users of differentiable simulators complain of gradients that are silently wrong; this checks any cell, group of
parameters and horizon. Beyond some horizon contact and chaos make the path so crooked that a difference quotient means
nothing: the error grows there though the gradient is exact. `gradcheck_summary` says where.
"""

import itertools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from zoobench.arrays import Array
from zoobench.errors import UsageError
from zoobench.verify.gradcheck.cell import GROUPS, Arrays, Cell, Counts

HORIZONS = (10, 50, 200, 800)
TOLERANCE = 1e-4
JUDGED_HORIZON = 100
"""Substeps up to which the error must stay within the tolerance; what lies beyond is shown, not judged."""

_WIDTHS = (1e-5, 1e-4, 1e-6, 1e-3, 1e-7)  # the likeliest first
_ENOUGH = 1e-2  # of the tolerance: no other width is tried
_FLOOR = 1e-3  # of |gradient| |direction|: a direction almost along the level set has no relative error worth the name
_KINK = (
    0.5  # of the gap between one-sided quotients that stays when the width shrinks tenfold; smooth ones keep a tenth
)


@dataclass(frozen=True)
class GradRow:
    """Directional derivatives by one group of parameters over one horizon; the values are those of the worst direction.

    Attributes:
        group: of parameters; the directions are random within it.
        frames, substeps: the horizon, in whole control frames.
        gradient_norm: of the objective by the whole group.
        derivative, difference: along the direction, by the adjoint and by the best central difference.
        relative_error: between them.
        kinks: share of the directions whose error is above the tolerance and whose quotients to the two sides differ
            at every width: the path has kinks (contact, yield) within the smallest.
        fault: where the first adjoint that is not finite was met, or empty.
    """

    env: str
    task: str
    group: str
    frames: int
    substeps: int
    gradient_norm: float
    derivative: float
    difference: float
    relative_error: float
    kinks: float
    fault: str

    @property
    def is_right(self) -> bool:
        """Within the tolerance, or beyond the horizon that is judged."""
        return not self.fault and (self.relative_error <= TOLERANCE or self.substeps > JUDGED_HORIZON)


def gradcheck(
    cell: Cell, horizons: Iterable[int] = HORIZONS, *, directions: int = 1, seed: int = 0
) -> Iterator[GradRow]:
    """Check a cell: one row per parameter group and horizon [substeps], as they are done.

    A horizon is reached in whole control frames. `directions` are drawn in every group.

    Raises:
        UsageError: a number that cannot be used.
        DivergenceError: the simulation blew up.
    """
    horizons = sorted(set(horizons))
    if not horizons or horizons[0] < 1:
        raise UsageError(f"Horizons of {horizons} substeps cannot be checked. Give positive numbers.")
    if directions < 1:
        raise UsageError(f"{directions} directions check nothing. Give at least 1.")
    for frames in cell.frames(horizons):
        yield from _rows(cell, frames, np.random.default_rng(seed), directions)


def _rows(cell: Cell, frames: int, rng: np.random.Generator, directions: int) -> Iterator[GradRow]:
    """All groups at one horizon."""
    base = cell.base(frames)
    run = cell.run(base)
    slopes, fault = cell.gradient(run, base)
    middle = cell.objective(run)
    for group in (name for name in GROUPS if name in slopes and slopes[name].size):
        slope = slopes[group]
        found = [
            _along(cell, base, run.counts, group, slope, _direction(rng, slope.shape), middle)
            for _ in range(directions)
        ]
        exact, difference, error, _ = max(found, key=lambda one: one[2])
        yield GradRow(
            env=cell.env,
            task=cell.task,
            group=group,
            frames=frames,
            substeps=run.substeps,
            gradient_norm=float(np.linalg.norm(slope)),
            derivative=exact,
            difference=difference,
            relative_error=error,
            kinks=sum(one[3] for one in found) / directions,
            fault=fault,
        )


def _direction(rng: np.random.Generator, shape: tuple[int, ...]) -> Array:
    """Normal numbers, the largest of size 1, so that a width is how far any parameter moves."""
    direction: Array = rng.normal(size=shape)
    direction /= np.abs(direction).max()
    return direction


def _along(
    cell: Cell, base: Arrays, counts: Counts, group: str, slope: Array, direction: Array, middle: float
) -> tuple[float, float, float, bool]:
    """(derivative, best central difference, relative error, whether kinks are to blame) along a direction."""
    exact = float((slope * direction).sum())
    floor = _FLOOR * float(np.linalg.norm(slope) * np.linalg.norm(direction))
    best, error = np.nan, np.inf
    gaps: dict[float, float] = {}
    for width in _WIDTHS:
        above, below = (cell.objective_near(base, counts, group, sign * width * direction) for sign in (1.0, -1.0))
        quotient = (above - below) / (2 * width)
        gaps[width] = abs(above - 2 * middle + below) / width
        off = abs(quotient - exact) / max(abs(quotient), floor, np.finfo(float).tiny)
        if off < error:
            best, error = quotient, off
        if error <= _ENOUGH * TOLERANCE:
            break
    # the narrowest is left out: there rounding makes a gap
    wide_to_narrow = [gaps[width] for width in sorted(gaps, reverse=True)][:-1]
    kinked = error > TOLERANCE and all(b > _KINK * a for a, b in itertools.pairwise(wide_to_narrow))
    return exact, best, error, kinked
