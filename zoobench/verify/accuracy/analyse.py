"""How wrong each simulation is, what it costs, and whether it picks the same winner.

Every environment and task is judged by itself. The reference of each controller's score is the limit of the ladder of
levels (`reference.extrapolate`); an error is the root mean square over the controllers of the difference to it, as a
share of the root mean square of the references, so that a controller that goes nowhere cannot blow it up.
"""

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from zoobench.arrays import Array
from zoobench.registry import Kind
from zoobench.verify.accuracy.plan import LADDER, NUDGE
from zoobench.verify.accuracy.records import Cost, Measurements, Sample, grid_spacing, label, variant_of
from zoobench.verify.accuracy.reference import Reference, extrapolate

BODY_LENGTH = 0.1
"""Of the caterpillar [m], in which errors of the path are given."""

TRUSTED = 0.01
"""Share of an error that chaos may contribute to it."""


@dataclass(frozen=True)
class LevelRow:
    """One environment and task at one fidelity. Errors are shares; None is what was not measured.

    Attributes:
        fidelity: its name, with the parameters that are not the default ones.
        error: of the score.
        floor: what the score changes by when the robot starts elsewhere by a fraction of a cell, likewise a share.
        at_floor: the error cannot be told from that noise.
        unknown: how uncertain the reference itself is.
        path, shape: of the centre of mass in body lengths, and of the second moments of the body.
        angle: 1 - cosine between gradient and that of the finest level.
        ratio: of their norms.
        tau: Kendall's rank correlation of the controllers' scores with those of the finest level that has them.
        winner: whether the best controller is the same.
        draws: controllers behind `error`, behind `tau`.
        change: where a knob is turned, how far the scores are from those at the level as it is.
        seconds, seconds_least, seconds_most: wall time per simulated second, forward [s].
        gradient_seconds: likewise with gradient [s]; None where the study takes none.
        rate: wall time per particle and substep [ns].
        memory: of the process [MiB].
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
    """What the errors of one environment and task are measured against.

    Attributes:
        levels: names of those that the references rest on.
        draws: controllers with a reference.
        converged: how many of them converge.
        order: median of the observed orders of those.
        scale: root mean square of the reference scores.
        unknown: root mean square of their uncertainties, as a share of `scale`; None with fewer than three levels.
        floor: the noise floor, likewise.
        chaos: simulated time until which a nudge of a millionth of a cell stays below 1 % of the path's error at that
            level [s]; the whole time where it always does.
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


class Cell:
    """The measurements of one environment (with its variants) and task."""

    def __init__(self, env: str, task: str, samples: Iterable[Sample], costs: Iterable[Cost]) -> None:
        self.env, self.task = env, task
        own = [sample for sample in samples if sample.env.name == env]
        scored = [sample for sample in own if not sample.is_close and task in sample.scores]
        # where several lengths were measured, the longest episodes count, and of those the one of most draws
        scored.sort(key=lambda sample: len(sample.scores[task]))
        frames = max((sample.frames for sample in scored), default=0)
        self.scored = {variant_of(sample): sample for sample in scored if sample.frames == frames}
        self.close = {variant_of(sample): sample for sample in own if sample.is_close}
        self._costs = {(cost.env, cost.fidelity): cost for cost in costs}
        self.ladder = [name for name in LADDER if name in self.scored]
        self.references = self._references()

    def scores(self, name: str) -> Array:
        """Of a variant's draws, NaN where one diverged."""
        return np.array(self.scored[name].scores[self.task])

    def cost(self, name: str) -> Cost | None:
        """What a variant costs, if it was measured."""
        sample = self.scored[name]
        return self._costs.get((sample.env, sample.fidelity))

    @property
    def scale(self) -> float:
        """Root mean square of the reference scores."""
        return _rms([reference.value for reference in self.references])

    def _references(self) -> list[Reference]:
        """Of every draw that all levels and turned knobs have, so that their errors can be compared."""
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
        """Of the score, and over how many draws; None where it cannot be told.

        The finest level can only be judged by draws whose reference lies beyond it, and is if they are the most.
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
        """Of a turned knob: how far the scores are from those of the level as it is, as a share of the scale."""
        home = _home(name)
        if home == name or home not in self.scored:
            return None
        count = len(self.references)
        apart = (self.scores(name)[:count] - self.scores(home)[: len(self.scores(name))][:count]) / self.scale
        return _rms(apart[np.isfinite(apart)])

    def floor(self) -> float | None:
        """The noise floor: the deviation over the shifts, as a share of the scores."""
        families = self._shifted()
        if len(families) < 2:
            return None
        count = min(len(scores) for scores in families)
        table = np.array([scores[:count] for scores in families])
        return _rms(np.nanstd(table, axis=0, ddof=1)) / self.scale

    def _shifted(self) -> list[Array]:
        names = [name for name in self.scored if (shift := _shift(name)) is not None and shift != NUDGE]
        if not names:
            return []
        home = _home(names[0])
        return [self.scores(name) for name in [*([home] if home in self.scored else []), *names]]

    def rank(self, name: str) -> tuple[float | None, bool | None, int]:
        """Kendall's tau with the finest level that has as many draws, and whether both name the same winner."""
        from scipy.stats import kendalltau

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
        """Errors of path [body lengths] and shape, angle and norm ratio of the gradient, against the finest level."""
        levels = [level for level in LADDER if level in self.close]
        sample = self.close.get(name)
        if sample is None or not levels or name == levels[-1]:
            return None, None, None, None
        best = self.close[levels[-1]]
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
        """Until when a nudge stays within `TRUSTED` of the path's error at its level [s]."""
        nudged = next((name for name in self.close if _shift(name) == NUDGE), None)
        levels = [level for level in LADDER if level in self.close]
        if nudged is None or _home(nudged) not in self.close or len(levels) < 2:
            return None
        home, best = self.close[_home(nudged)], self.close[levels[-1]]
        count = min(len(home.paths), len(best.paths), len(self.close[nudged].paths))
        apart = np.linalg.norm(self.close[nudged].paths[:count] - home.paths[:count], axis=2).max(0)
        wrong = np.linalg.norm(home.paths[:count] - best.paths[:count], axis=2).max(0)
        chaotic = np.flatnonzero(apart[1:] > TRUSTED * wrong[1:])
        points = len(apart) - 1 if not len(chaotic) else int(chaotic[0])
        return points * home.seconds_between

    def row(self, name: str, floor: float | None, unknown: float | None) -> LevelRow:
        """All about one variant."""
        sample, cost = self.scored[name], self.cost(name)
        error, draws = self.error(name)
        path, shape, angle, ratio = self.closely(name)
        tau, winner, ranked = self.rank(name)
        per_second = None if cost is None else 1e-9 * cost.particles * sample.substeps
        return LevelRow(
            env=label(Kind.ENV, sample.env),
            task=self.task,
            fidelity=label(Kind.FIDELITY, sample.fidelity),
            spacing=self._spacing(name),
            error=error,
            floor=floor,
            at_floor=error is not None and floor is not None and error < floor,
            unknown=unknown,
            path=path,
            shape=shape,
            angle=angle,
            ratio=ratio,
            tau=tau,
            winner=winner,
            draws=f"{draws}, {ranked}",
            change=self.change(name),
            particles=None if cost is None else cost.particles,
            substeps=sample.substeps,
            seconds=None if cost is None or per_second is None else per_second * cost.forward,
            seconds_least=None if cost is None or per_second is None else per_second * cost.forward_least,
            seconds_most=None if cost is None or per_second is None else per_second * cost.forward_most,
            gradient_seconds=_finite(per_second * cost.gradient) if cost is not None and per_second else None,
            rate=None if cost is None else cost.forward,
            memory=sample.peak_memory / 2**20 if sample.peak_memory else None,
        )

    def reference_row(self) -> ReferenceRow:
        """What the errors are measured against."""
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
    """The study's result: `levels` holds the ladder, `knobs` the sweeps around one of its levels."""

    references: tuple[ReferenceRow, ...]
    levels: tuple[LevelRow, ...]
    knobs: tuple[LevelRow, ...]


def analyse(measurements: Measurements, envs: Sequence[str] = (), tasks: Sequence[str] = ()) -> Analysis:
    """Judge what was measured; `envs` and `tasks` narrow the choice."""
    names = sorted({sample.env.name for sample in measurements.samples})
    known = sorted({task for sample in measurements.samples for task in sample.scores})
    references, levels, knobs = [], [], []
    for env in (name for name in names if not envs or name in envs):
        for task in (name for name in known if not tasks or name in tasks):
            cell = Cell(env, task, measurements.samples, measurements.costs)
            if not cell.ladder:
                continue
            reference = cell.reference_row()
            references.append(reference)
            levels += [cell.row(name, reference.floor, reference.unknown) for name in cell.ladder]
            turned = [name for name in cell.scored if name not in cell.ladder and _shift(name) is None]
            knobs += [cell.row(name, reference.floor, reference.unknown) for name in turned]
    return Analysis(tuple(references), tuple(levels), tuple(knobs))


def _home(name: str) -> str:
    """The level that a variant is one of."""
    return re.split(r"[ \[]", name)[0]


def _shift(name: str) -> float | None:
    """The shift that a variant's label states [cells]."""
    _, found, rest = name.partition("[shift=")
    return float(rest.rstrip("]")) if found else None


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _rms(values: Iterable[float] | Array) -> float:
    array = np.asarray(list(values) if not isinstance(values, np.ndarray) else values, float)
    return float(np.sqrt(np.mean(np.square(array)))) if array.size else math.nan
