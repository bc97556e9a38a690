"""Error and cost of each fidelity, and whether it ranks controllers as the finest one does.

Every environment and task is judged by itself. The reference of each controller's score is the limit of the ladder of
levels (`reference.extrapolate`). An error is the root mean square difference to it over the controllers, as a share of
the root mean square of the references: a controller that hardly moves cannot inflate it.
"""

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import kendalltau

from zoobench.arrays import Array
from zoobench.registry import Kind
from zoobench.verify.accuracy.plan import LADDER, NUDGE
from zoobench.verify.accuracy.records import FidelityCost, Measurements, Sample, grid_spacing, label, variant_of
from zoobench.verify.accuracy.reference import Reference, extrapolate

BODY_LENGTH = 0.1
"""Length of the caterpillar [m], the unit of errors of the trajectory."""

TRUSTED = 0.01
"""Largest share of an error that chaos may contribute."""


@dataclass(frozen=True)
class LevelRow:
    """One environment and task at one fidelity. Errors are shares; None stands for a value that was not measured.

    Attributes:
        fidelity: its name, with the parameters that are not the default ones.
        error: of the score.
        floor: the noise floor: change of the score when the robot starts a fraction of a cell away.
        at_floor: whether the error is below the noise floor.
        unknown: uncertainty of the reference itself.
        path, shape: errors of the centre of mass's trajectory [body lengths] and of the body's second moments.
        angle: 1 - cosine between the gradient and that of the finest level.
        ratio: of their norms.
        tau: Kendall's rank correlation of the controllers' scores with those of the finest level that has them.
        winner: whether the best controller is the same.
        draws: numbers of controllers behind `error` and behind `tau`.
        change: where a knob is turned, difference of the scores to those of the unchanged level.
        seconds, seconds_least, seconds_most: wall time per simulated second, forward [s].
        gradient_seconds: likewise with gradient [s]; None where the study computes none.
        rate: wall time per particle and substep [ns].
        memory: peak of the process [MiB].
    """

    env: str
    task: str
    fidelity: str
    spacing: float
    error: float | None
    floor: float | None
    at_floor: bool
    unknown: float | None
    path: float | None
    shape: float | None
    angle: float | None
    ratio: float | None
    tau: float | None
    winner: bool | None
    draws: str
    change: float | None
    particles: int | None
    substeps: float
    seconds: float | None
    seconds_least: float | None
    seconds_most: float | None
    gradient_seconds: float | None
    rate: float | None
    memory: float | None


@dataclass(frozen=True)
class ReferenceRow:
    """The references of one environment and task.

    Attributes:
        levels: names of those from which the references follow.
        draws: number of controllers with a reference.
        converged: number of those that converge.
        order: median of their observed orders.
        scale: root mean square of the reference scores.
        unknown: root mean square of their uncertainties, as a share of `scale`; None with fewer than three levels.
        floor: the noise floor, likewise.
        chaos: simulated time for which the effect of a nudge of a millionth of a cell stays below 1 % of the
            trajectory's error at that level [s]; the length of the episode where it always does.
    """

    env: str
    task: str
    levels: str
    draws: int
    converged: int
    order: float | None
    scale: float
    unknown: float | None
    floor: float | None
    chaos: float | None


class StudyCell:
    """The measurements of one environment (with its variants) and task."""

    def __init__(self, env: str, task: str, samples: Iterable[Sample], costs: Iterable[FidelityCost]) -> None:
        self.env, self.task = env, task
        own = [sample for sample in samples if sample.env.name == env]
        scored = [sample for sample in own if not sample.is_close and task in sample.scores]
        # of several lengths the longest episodes count, and of those the sample with the most draws
        scored.sort(key=lambda sample: len(sample.scores[task]))
        frames = max((sample.frames for sample in scored), default=0)
        self.scored = {variant_of(sample): sample for sample in scored if sample.frames == frames}
        self.close = {variant_of(sample): sample for sample in own if sample.is_close}
        self._close_levels = [self.close[name] for name in LADDER if name in self.close]
        self._costs = {(cost.env, cost.fidelity): cost for cost in costs}
        self.ladder = [name for name in LADDER if name in self.scored]
        self.references = self._references()
        self.scale = _rms([reference.value for reference in self.references])

    def scores(self, name: str) -> Array:
        """Scores of a variant's draws, NaN where the simulation diverged."""
        return np.array(self.scored[name].scores[self.task])

    def _references(self) -> list[Reference]:
        """References of the draws that all levels and turned knobs have, so that their errors can be compared."""
        if not self.ladder:
            return []
        found = []
        compared = [name for name in self.scored if _shift(name) is None]
        for draw in range(min(len(self.scores(name)) for name in compared)):
            levels = [(self._spacing(name), self.scores(name)[draw]) for name in self.ladder]
            known = [(h, value) for h, value in levels if math.isfinite(value)]
            found.append(extrapolate(*zip(*known, strict=True)) if known else Reference(math.nan, math.inf, None))
        return found

    def _spacing(self, name: str) -> float:
        return grid_spacing(self.scored[name].fidelity)

    def error(self, name: str) -> tuple[float | None, int]:
        """Error of the score, and the number of draws behind it; None where it is unknown.

        The finest level is judged by the draws that converge, whose reference lies beyond it, if they are the majority.
        """
        scores = self.scores(name)
        is_finest = name == self.ladder[-1]
        pairs = [
            (score, reference.value)
            for score, reference in zip(scores, self.references, strict=False)
            if math.isfinite(score) and math.isfinite(reference.value) and (reference.is_converged or not is_finest)
        ]
        if not pairs or (is_finest and 2 * len(pairs) < len(self.references)):
            return None, 0
        return _rms([score - value for score, value in pairs]) / _rms([value for _, value in pairs]), len(pairs)

    def change(self, name: str) -> float | None:
        """Difference of a turned knob's scores to those of the unchanged level, as a share of the scale."""
        home = _home(name)
        if home == name or home not in self.scored:
            return None
        count = len(self.references)
        apart = (self.scores(name)[:count] - self.scores(home)[: len(self.scores(name))][:count]) / self.scale
        return _rms(apart[np.isfinite(apart)])

    def floor(self) -> float | None:
        """The noise floor: the standard deviation over the shifts, as a share of the scale."""
        shifted = [name for name in self.scored if (shift := _shift(name)) is not None and shift != NUDGE]
        homes = [home for home in map(_home, shifted[:1]) if home in self.scored]
        families = [self.scores(name) for name in (*homes, *shifted)]
        if len(families) < 2:
            return None
        count = min(map(len, families))
        table = np.array([scores[:count] for scores in families])
        return _rms(np.nanstd(table, axis=0, ddof=1)) / self.scale

    def rank(self, name: str) -> tuple[float | None, bool | None, int]:
        """Kendall's tau with the finest level that has as many draws, whether the winner is the same, and the draws."""
        scores = self.scores(name)
        finer = [
            level for level in self.ladder
            if self._spacing(level) < self._spacing(name) and len(self.scores(level)) >= len(scores)
        ]  # fmt: skip
        if not finer:
            return None, None, 0
        best = self.scores(finer[-1])[: len(scores)]
        both = np.isfinite(scores) & np.isfinite(best)
        if both.sum() < 3:
            return None, None, int(both.sum())
        tau = float(kendalltau(scores[both], best[both]).statistic)
        return tau, bool(np.argmax(scores[both]) == np.argmax(best[both])), int(both.sum())

    def closely(self, name: str) -> tuple[float | None, float | None, float | None, float | None]:
        """Errors of trajectory and shape, and angle and norm ratio of the gradient, to the finest level."""
        sample = self.close.get(name)
        if sample is None or not self._close_levels or sample is self._close_levels[-1]:
            return None, None, None, None
        best = self._close_levels[-1]
        count = min(len(sample.paths), len(best.paths))
        path = _rms(np.linalg.norm(sample.paths[:count] - best.paths[:count], axis=2)) / BODY_LENGTH
        shape = _rms(sample.spreads[:count] - best.spreads[:count]) / _rms(best.spreads[:count])
        if sample.task != self.task:
            return path, shape, None, None
        mine, theirs = sample.slopes[:count], best.slopes[:count]
        norms = np.linalg.norm(mine, axis=1), np.linalg.norm(theirs, axis=1)
        cosines = (mine * theirs).sum(1) / (norms[0] * norms[1])
        return path, shape, float(1.0 - cosines.mean()), float((norms[0] / norms[1]).mean())

    def chaos(self) -> float | None:
        """Time for which a nudge's effect stays within `TRUSTED` of the trajectory's error at its level [s]."""
        name = next((name for name in self.close if _shift(name) == NUDGE), "")
        home = self.close.get(_home(name))
        if home is None or len(self._close_levels) < 2:
            return None
        nudged, best = self.close[name], self._close_levels[-1]
        count = min(len(home.paths), len(best.paths), len(nudged.paths))
        apart = np.linalg.norm(nudged.paths[:count] - home.paths[:count], axis=2).max(0)
        wrong = np.linalg.norm(home.paths[:count] - best.paths[:count], axis=2).max(0)
        chaotic = np.flatnonzero(apart[1:] > TRUSTED * wrong[1:])
        points = len(apart) - 1 if not len(chaotic) else int(chaotic[0])
        return points * home.seconds_between

    def row(self, name: str, reference: ReferenceRow) -> LevelRow:
        """The row of one variant."""
        sample = self.scored[name]
        cost = self._costs.get((sample.env, sample.fidelity))
        error, draws = self.error(name)
        path, shape, angle, ratio = self.closely(name)
        tau, winner, ranked = self.rank(name)
        return LevelRow(
            env=label(Kind.ENV, sample.env),
            task=self.task,
            fidelity=label(Kind.FIDELITY, sample.fidelity),
            spacing=self._spacing(name),
            error=error,
            floor=reference.floor,
            at_floor=error is not None and reference.floor is not None and error < reference.floor,
            unknown=reference.unknown,
            path=path,
            shape=shape,
            angle=angle,
            ratio=ratio,
            tau=tau,
            winner=winner,
            draws=f"{draws}, {ranked}",
            change=self.change(name),
            substeps=sample.substeps,
            **_costs(cost, sample.substeps),
            memory=sample.peak_memory / 2**20 if sample.peak_memory else None,
        )

    def reference_row(self) -> ReferenceRow:
        """The summary of the references."""
        orders = [reference.order for reference in self.references if reference.order is not None]
        uncertainties = [reference.uncertainty for reference in self.references]
        return ReferenceRow(
            env=self.env,
            task=self.task,
            levels=", ".join(self.ladder[-3:]),
            draws=len(self.references),
            converged=len(orders),
            order=float(np.median(orders)) if orders else None,
            scale=self.scale,
            unknown=_rms(uncertainties) / self.scale if all(map(math.isfinite, uncertainties)) else None,
            floor=self.floor(),
            chaos=self.chaos(),
        )


@dataclass(frozen=True)
class Analysis:
    """Results of the study: `levels` are those of the ladder, `knobs` the variants of one of its levels."""

    references: tuple[ReferenceRow, ...]
    levels: tuple[LevelRow, ...]
    knobs: tuple[LevelRow, ...]


def analyse(measurements: Measurements, envs: Sequence[str] = (), tasks: Sequence[str] = ()) -> Analysis:
    """Judge measurements, of some environments and tasks only if `envs` and `tasks` name them."""
    names = sorted({sample.env.name for sample in measurements.samples})
    known = sorted({task for sample in measurements.samples for task in sample.scores})
    references, levels, knobs = [], [], []
    for env in (name for name in names if not envs or name in envs):
        for task in (name for name in known if not tasks or name in tasks):
            cell = StudyCell(env, task, measurements.samples, measurements.costs)
            if not cell.ladder:
                continue
            reference = cell.reference_row()
            references.append(reference)
            turned = [name for name in cell.scored if name not in cell.ladder and _shift(name) is None]
            levels += [cell.row(name, reference) for name in cell.ladder]
            knobs += [cell.row(name, reference) for name in turned]
    return Analysis(tuple(references), tuple(levels), tuple(knobs))


def _home(name: str) -> str:
    """The level of a variant."""
    return re.split(r"[ \[]", name)[0]


def _shift(name: str) -> float | None:
    """The shift in a variant's label [cells], None if there is none."""
    _, found, rest = name.partition("[shift=")
    return float(rest.rstrip("]")) if found else None


def _costs(cost: FidelityCost | None, substeps: float) -> dict[str, Any]:
    """The fields of a `LevelRow` that follow from a cost, at a number of substeps per simulated second."""
    if cost is None:
        return dict.fromkeys(("particles", "seconds", "seconds_least", "seconds_most", "gradient_seconds", "rate"))
    per_second = 1e-9 * cost.particles * substeps
    with_gradient = per_second * cost.gradient
    return {
        "particles": cost.particles,
        "seconds": per_second * cost.forward,
        "seconds_least": per_second * cost.forward_least,
        "seconds_most": per_second * cost.forward_most,
        "gradient_seconds": with_gradient if math.isfinite(with_gradient) else None,
        "rate": cost.forward,
    }


def _rms(values: Iterable[float] | Array) -> float:
    array = np.asarray(list(values) if not isinstance(values, np.ndarray) else values, float)
    return float(np.sqrt(np.mean(np.square(array)))) if array.size else math.nan
