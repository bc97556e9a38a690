"""The gaits of one environment, task and design at every fidelity, and their references."""

from collections.abc import Iterable, Sequence
from functools import cached_property
from itertools import combinations

import numpy as np

from zoobench.arrays import Array
from zoobench.registry import Kind
from zoobench.tasks.scores import score_ratio
from zoobench.verify.accuracy.plan import LADDER, other_transfer
from zoobench.verify.accuracy.records import Numbers, Sample, label

GOING = 0.1
"""Ratios are shown of gaits that reach this share of their design's best reference; others may even have no sign."""


class DesignCell:
    """The gaits of one environment, task and design at every fidelity, and their references."""

    def __init__(self, samples: Sequence[Sample]) -> None:
        self.samples: dict[str, list[Sample]] = {}
        for sample in samples:
            self.samples.setdefault(label(Kind.FIDELITY, sample.fidelity), []).append(sample)
        self.found = {gait: sample.found for sample in samples for gait in sample.scores}
        finest = [name for name in LADDER if name in self.samples][-1:]
        twins = [twin_of(name) for name in finest]
        self._finest = [self.scores(name) for name in (*finest, *twins) if name in self.samples]
        self.is_alone = len(self._finest) < 2

    def scores(self, name: str) -> Numbers:
        """Scores at a fidelity."""
        return {gait: score for sample in self.samples.get(name, ()) for gait, score in sample.scores.items()}

    @cached_property
    def references(self) -> Numbers:
        """References of the gaits that the finest level has."""
        gaits = set(self._finest[0]).intersection(*self._finest[1:]) if self._finest else set()
        return {gait: float(np.mean([scores[gait] for scores in self._finest])) for gait in sorted(gaits)}

    @property
    def unknown(self) -> float | None:
        """The references' uncertainty as a share of their size."""
        if self.is_alone or not self.references:
            return None
        one, two = self._finest
        return self._share({gait: 0.5 * (one[gait] - two[gait]) for gait in self.references})

    def error(self, name: str) -> float | None:
        """Error of the scores; None where nothing is compared, or the level only with itself."""
        scores = self.scores(name)
        apart = {gait: scores[gait] - value for gait, value in self.references.items() if gait in scores}
        return None if not apart or (self.is_alone and scores == self._finest[0]) else self._share(apart)

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

    def pairs(self, name: str) -> list[tuple[float, bool]]:
        """Of all pairs of gaits of different trainings, the ratio of their scores, and whether their order holds.

        The finest level, which has a share in the references, is held against its other transfer.
        """
        scores, judges = self.scores(name), self.references
        if self._finest and scores == self._finest[0]:
            judges = {} if self.is_alone else self._finest[1]
        found = []
        for one, two in combinations([gait for gait in judges if gait in scores], 2):
            worse, better = sorted((one, two), key=scores.__getitem__)
            if training_of(one) != training_of(two) and (scores[better] > 0.0 or self.are_errors):
                found.append((score_ratio(scores[better], scores[worse]), judges[better] > judges[worse]))
        return found

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
    """The training in which a gait was found."""
    return gait.partition("@")[0]


def rms(values: Iterable[float]) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(list(values)))))


def _cosine(one: Array, two: Array) -> float:
    return float(one @ two / (np.linalg.norm(one) * np.linalg.norm(two)))
