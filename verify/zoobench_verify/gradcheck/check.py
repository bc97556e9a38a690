"""`zoobench verify gradcheck`: adjoint gradients against central differences, in double precision.

Beyond some horizon contact and chaos make the objective so rough that a difference quotient is no derivative: the error
grows there though the gradient is exact. `summarise` says where, from the rows and two episodes with almost equal
starts.
"""

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from zoobench.arrays import Array
from zoobench.errors import UsageError
from zoobench.sim.model.rollout import Rollout
from zoobench.sim.model.state import IntArray
from zoobench_verify.gradcheck.gradient_case import GROUPS, NUDGE, Arrays, GradientCase

HORIZONS = (10, 50, 200, 800)
TOLERANCE = 1e-4
JUDGED_HORIZON = 100
"""Substeps up to which the error must stay within the tolerance; longer horizons are shown, not judged."""

_WIDTHS = (1e-5, 1e-4, 1e-6, 1e-3, 1e-7)  # the most likely to be best first
_ENOUGH = 1e-2  # share of the tolerance: with a smaller error no other width is tried
_FLOOR = 1e-3  # share of |gradient| |direction| below which a derivative is too small for a relative error
_KINK = 0.5  # share of the gap between one-sided quotients left at a tenth of the width: 0.1 if smooth, 1 at a kink


MEANINGFUL = 1e-2
"""Relative error of the worst group up to which difference quotients and gradients agree."""

APART = 1e-2
"""Distance [grid spacings] from which on two episodes count as different ones."""


@dataclass(frozen=True)
class GradRow:
    """Directional derivatives by one group of parameters over one horizon; the values are those of the worst direction.

    Attributes:
        group: of parameters; the directions are random within it.
        frames, substeps: the horizon, in whole control frames.
        gradient_norm: of the objective by the whole group.
        derivative, difference: along the direction, by the adjoint and by the best central difference.
        relative_error: between them.
        kinks: share of the directions whose error is above the tolerance and whose one-sided quotients differ at
            every width: the objective has kinks (contact, yield) within the smallest.
        fault: where the first adjoint that is not finite occurred, or empty.
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
        """Whether the error is within the tolerance, or the horizon is beyond the one that is judged."""
        return not self.fault and (self.relative_error <= TOLERANCE or self.substeps > JUDGED_HORIZON)


def gradcheck(
    case: GradientCase, horizons: Iterable[int] = HORIZONS, *, directions: int = 1, seed: int = 0
) -> Iterator[GradRow]:
    """Check a case: one row per parameter group and horizon [substeps], rounded up to whole control frames.

    Raises:
        UsageError: a horizon or number of directions below 1.
        DivergenceError: the simulation diverged.
    """
    horizons = sorted(set(horizons))
    if not horizons or horizons[0] < 1:
        raise UsageError(f"Horizons of {horizons} substeps cannot be checked. Give positive numbers.")
    if directions < 1:
        raise UsageError(f"{directions} directions check nothing. Give at least 1.")
    for frames in case.frames(horizons):
        yield from _rows(case, frames, np.random.default_rng(seed), directions)


def _rows(case: GradientCase, frames: int, rng: np.random.Generator, directions: int) -> Iterator[GradRow]:
    """All groups at one horizon."""
    base = case.base(frames)
    run = case.run(base)
    gradients, fault = case.gradient(run, base)
    middle = case.objective(run)
    for group in (name for name in GROUPS if name in gradients and gradients[name].size):
        gradient = gradients[group]
        found = [
            _along(case, base, run, group, gradient, _direction(rng, gradient.shape), middle) for _ in range(directions)
        ]
        exact, difference, error, _ = max(found, key=lambda one: one[2])
        yield GradRow(
            env=case.env,
            task=case.task,
            group=group,
            frames=frames,
            substeps=run.substeps,
            gradient_norm=float(np.linalg.norm(gradient)),
            derivative=exact,
            difference=difference,
            relative_error=error,
            kinks=sum(one[3] for one in found) / directions,
            fault=fault,
        )


def _direction(rng: np.random.Generator, shape: tuple[int, ...]) -> Array:
    """Normal random numbers, scaled so that the largest is 1: a width is the largest shift of any parameter."""
    direction: Array = rng.normal(size=shape)
    direction /= np.abs(direction).max()
    return direction


def _along(
    case: GradientCase, base: Arrays, run: Rollout, group: str, gradient: Array, direction: Array, middle: float
) -> tuple[float, float, float, bool]:
    """(derivative, best central difference, relative error, whether a kink causes it) along a direction."""
    exact = float((gradient * direction).sum())
    floor = _FLOOR * float(np.linalg.norm(gradient) * np.linalg.norm(direction))
    best, error = np.nan, np.inf
    gaps: dict[float, float] = {}
    for width in _WIDTHS:
        above, below = (case.objective_near(base, run, group, sign * width * direction) for sign in (1.0, -1.0))
        quotient = (above - below) / (2 * width)
        gaps[width] = abs(above - 2 * middle + below) / width
        off = abs(quotient - exact) / max(abs(quotient), floor, np.finfo(float).tiny)
        if off < error:
            best, error = quotient, off
        if error <= _ENOUGH * TOLERANCE:
            break
    # without the narrowest, where rounding errors make a gap
    wide_to_narrow = [gaps[width] for width in sorted(gaps, reverse=True)][:-1]
    kinked = error > TOLERANCE and all(b > _KINK * a for a, b in itertools.pairwise(wide_to_narrow))
    return exact, best, error, kinked


@dataclass(frozen=True)
class Summary:
    """The largest error of one environment and task, and where chaos takes over.

    Attributes:
        error: largest relative error within the judged horizon.
        right_until: the largest horizon checked [substeps] up to which the worst group's error is within `MEANINGFUL`;
            0 if there is none.
        chaos_from: the next horizon checked [substeps], at which the objective is too rough for any difference
            quotient; None if there is none.
        norm_growth: the largest growth of a group's gradient norm from the shortest to the longest horizon [-].
        norm_e_fold: substeps in which that norm grows by e, from the two longest horizons; None where none grows.
        separation_growth: distance of two episodes after the longest horizon by that at their start, 1e-6 h [-].
        separation_e_fold: substeps in which it grows by e, a fit to the second half; None where it does not grow.
        chaos_expected: substeps after which, growing on like that, it would be `APART`; None where it does not grow.
    """

    env: str
    task: str
    error: float
    right_until: int
    chaos_from: int | None
    norm_growth: float
    norm_e_fold: float | None
    separation_growth: float
    separation_e_fold: float | None
    chaos_expected: float | None


def summarise(case: GradientCase, rows: Sequence[GradRow]) -> Summary:
    """The summary of a case from its rows; simulates the longest horizon again from a displaced state."""
    horizons = sorted({row.substeps for row in rows})
    worst = {n: max(np.inf if row.fault else row.relative_error for row in rows if row.substeps == n) for n in horizons}
    wrong = next((n for n in horizons if worst[n] > MEANINGFUL), None)
    right = [n for n in horizons if wrong is None or n < wrong]
    norms = {n: {row.group: row.gradient_norm for row in rows if row.substeps == n} for n in horizons}
    first, last, before = horizons[0], horizons[-1], horizons[max(len(horizons) - 2, 0)]
    substeps, apart = case.separation(max(row.frames for row in rows), np.random.default_rng(0))
    folds = [e_fold(np.array([before, last]), np.array([norms[before][g], norms[last][g]])) for g in norms[last]]
    growth, half = float(apart[-1] / apart[0]), len(substeps) // 2
    slowness = e_fold(substeps[half:], apart[half:])
    return Summary(
        env=case.env,
        task=case.task,
        error=max((worst[n] for n in horizons if n <= JUDGED_HORIZON), default=np.nan),
        right_until=max(right, default=0),
        chaos_from=wrong,
        norm_growth=max((norms[last][g] / norms[first][g] for g in norms[last] if norms[first][g]), default=0.0),
        norm_e_fold=min(filter(None, folds), default=None),
        separation_growth=growth,
        separation_e_fold=slowness,
        chaos_expected=float(substeps[-1]) + slowness * math.log(APART / (NUDGE * growth)) if slowness else None,
    )


def e_fold(steps: IntArray, values: Array) -> float | None:
    """Steps in which positive values grow by e, by least squares on their logarithm; None if they do not grow."""
    if len(set(steps.tolist())) < 2 or not (values > 0.0).all():
        return None
    rate = float(np.polyfit(steps.astype(float), np.log(values), 1)[0])
    return 1.0 / rate if rate > 0.0 else None
