"""The horizon at which chaos takes over, from the rows of `gradcheck` and two episodes that begin almost alike."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from zoobench.arrays import Array
from zoobench.verify.gradcheck.check import JUDGED_HORIZON, GradRow
from zoobench.verify.gradcheck.gradient_case import NUDGE, Counts, GradientCase

MEANINGFUL = 1e-2
"""Relative error of the worst group up to which difference quotients and gradients agree."""

APART = 1e-2
"""Distance [grid spacings] from which on two episodes count as different ones."""


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
    worst = {n: max(_error(row) for row in rows if row.substeps == n) for n in horizons}
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


def _error(row: GradRow) -> float:
    return np.inf if row.fault else row.relative_error


def e_fold(steps: Counts, values: Array) -> float | None:
    """Steps in which positive values grow by e, by least squares on their logarithm; None if they do not grow."""
    if len(set(steps.tolist())) < 2 or not (values > 0.0).all():
        return None
    rate = float(np.polyfit(steps.astype(float), np.log(values), 1)[0])
    return 1.0 / rate if rate > 0.0 else None
