"""The gaits of one environment, task and design at every fidelity, and their references."""

import math
from collections.abc import Iterable, Sequence
from functools import cached_property

import numpy as np

from zoobench.accuracy.ladder import LADDER
from zoobench.arrays import Array
from zoobench.registry import Kind, short
from zoobench_verify.accuracy.plan import other_transfer
from zoobench_verify.accuracy.records import Numbers, Sample

GOING = 0.1
"""Ratios are shown of gaits that reach this share of their design's best reference; others may even have no sign."""


class DesignCell:
    """The gaits of one environment, task and design at every fidelity, and their references.

    The reference of a gait is its mean score by both transfers at the finest level at which half of the gaits were
    evaluated. Judges of it are these two, and the scores of some gaits at levels that are finer still.

    Attributes:
        design: its name with the parameters that are not the default ones.
        samples: by fidelity.
        found: the level at which each gait was trained, or `RANDOM`.
        finer: levels beyond that of the references, at which some gaits were evaluated.
        judges: the fidelities by which references are judged; but for `finer`, the references are their mean.
    """

    def __init__(self, samples: Sequence[Sample]) -> None:
        self.design = short(Kind.DESIGN, samples[0].design)
        self.samples: dict[str, list[Sample]] = {}
        for sample in samples:
            self.samples.setdefault(short(Kind.FIDELITY, sample.fidelity), []).append(sample)
        self._scores: dict[str, Numbers] = {}
        for name, own in self.samples.items():
            self._scores[name] = {gait: score for sample in own for gait, score in sample.scores.items()}
        self.found = {gait: sample.found for sample in samples for gait in sample.scores}
        levels = [name for name in LADDER if name in self.samples]
        most = [name for name in levels if 2 * len(self.scores(name)) >= len(self.found)]
        means = [name for level in most[-1:] for name in (level, twin_of(level)) if self._is_another(name, level)]
        self.finer = levels[levels.index(most[-1]) + 1 :] if most else []
        self.judges = [*means, *self.finer]

    def _is_another(self, name: str, level: str) -> bool:
        """Whether there are scores at a fidelity, and they are the level's own or differ from them: where the transfer
        has no part in a simulation, as in water, the twin of a level says nothing of its error."""
        return name in self.samples and (name == level or self.scores(name) != self.scores(level))

    def scores(self, name: str) -> Numbers:
        """Scores at a fidelity."""
        return self._scores.get(name, {})

    @cached_property
    def references(self) -> Numbers:
        """References of the gaits that the finest level has."""
        means = [self.scores(name) for name in self.judges if name not in self.finer]
        gaits = set.intersection(*map(set, means)) if means else set()
        return {gait: float(np.mean([scores[gait] for scores in means])) for gait in sorted(gaits)}

    @cached_property
    def unknown(self) -> float | None:
        """The references' uncertainty as a share of their size: their distance to the farthest of their judges."""
        distances = [self._share(apart) for name in self.judges if (apart := self._apart(name))]
        return max(distances) if len(distances) > 1 else None

    @property
    def checked(self) -> int:
        """Number of the gaits that were evaluated on a finer grid than that of the references."""
        return len({gait for name in self.finer for gait in self._apart(name)})

    def error(self, name: str) -> float | None:
        """Error of the scores; None where nothing is compared, or a level only with itself or a coarser one."""
        apart = self._apart(name)
        return None if not apart or name in self.finer or self.judges == [name] else self._share(apart)

    def bound(self, name: str) -> float | None:
        """Error of the scores with the references' uncertainty; None where the error is not known."""
        error = self.error(name)
        return None if error is None else math.hypot(error, self.unknown or 0.0)

    def _apart(self, name: str) -> Numbers:
        """Scores less their references."""
        scores = self.scores(name)
        return {gait: scores[gait] - value for gait, value in self.references.items() if gait in scores}

    def _share(self, differences: Numbers) -> float:
        return rms(differences.values()) / rms(self.references[gait] for gait in differences)

    @cached_property
    def are_errors(self) -> bool:
        """Whether the scores are errors, as of a task where zero is perfect."""
        return max(self.references.values(), default=0.0) < 0.0

    def going(self) -> list[str]:
        """The gaits that get somewhere; where scores are errors, all of them."""
        if self.are_errors:
            return list(self.references)
        least = GOING * max((abs(value) for value in self.references.values()), default=0.0)
        return [gait for gait, value in self.references.items() if value > 0.0 and value >= least]

    def _found_at(self, level: str) -> list[str]:
        """Those that were found at a level, and whose score there has the sign of the reference."""
        scores = self.scores(level)
        return [
            gait
            for gait in self.going()
            if self.found[gait] == level and scores.get(gait, 0.0) / self.references[gait] > 0.0
        ]

    def ratios(self, name: str) -> list[float]:
        """Scores by their references."""
        scores = self.scores(name)
        return [scores[gait] / self.references[gait] for gait in self.going() if gait in scores]

    def carried(self, home: str, name: str) -> list[float]:
        """Scores at a fidelity by those at the level where the gaits were found."""
        own, other = self.scores(home), self.scores(name)
        return [other[gait] / own[gait] for gait in self._found_at(home) if gait in other]

    def kept(self, name: str) -> list[float]:
        """References of the gaits found at a level by their scores there."""
        scores = self.scores(name)
        return [self.references[gait] / scores[gait] for gait in self._found_at(name)]

    def angles(self, name: str) -> list[float]:
        """1 - cosine of the gradients to those at the finest level that has any."""
        best = [level for level in LADDER if self._slopes(level)][-1:]
        if best in ([], [name]):
            return []
        mine, theirs = self._slopes(name), self._slopes(best[0])
        return [1.0 - _cosine(mine[gait], theirs[gait]) for gait in mine if gait in theirs]

    def _slopes(self, name: str) -> dict[str, Array]:
        samples = self.samples.get(name, ())
        return {gait: np.array(slope) for sample in samples for gait, slope in sample.slopes.items()}


def twin_of(level: str) -> str:
    """The level with its other transfer."""
    return f"{level}[transfer={other_transfer(level)}]"


def training_of(gait: str) -> str:
    """The training run in which a gait was found."""
    return gait.partition("@")[0]


def stage_of(gait: str) -> int:
    """The number of a gait in its training run; a stage without a better gait than the one before has none."""
    return int(gait.partition("@")[2])


def rms(values: Iterable[float]) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(list(values)))))


def _cosine(one: Array, two: Array) -> float:
    return float(one @ two / (np.linalg.norm(one) * np.linalg.norm(two)))
