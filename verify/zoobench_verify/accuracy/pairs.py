"""Pairs of gaits at a fidelity: the ratio of their scores, and above which ratio their order is known to hold."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np

from zoobench.accuracy.levels import KeptOrders
from zoobench.tasks.scores import score_ratio
from zoobench_verify.accuracy.design_cell import DesignCell, stage_of, training_of
from zoobench_verify.accuracy.records import Numbers

HELD = 0.95
"""Share of the pairs whose order must hold."""

NEIGHBOURS = 20
"""Pairs of like ratio among which that is judged; with fewer, a single one would exceed the share that may fail."""

Pair = tuple[float, bool]
"""The better of two scores by the worse, and whether their order is known to hold."""


@dataclass(frozen=True)
class _Gait:
    """A gait with its scores by fidelity, those by judges of its reference once more, and the reference's uncertainty.

    `training` is where it was found, `trained` how: at which level, and which of its gaits it is, from the last on.
    """

    design: str
    training: str
    trained: tuple[str, int]
    scores: Numbers
    judged: Numbers
    reference: float
    unknown: float
    is_error: bool


def orders_of_one_body(cells: Iterable[DesignCell], name: str) -> KeptOrders:
    """Orders of gaits of the same body, without pairs from one training run, whose order nobody asks for.

    An error that all references of a body share, such as that of the finest grid, does not change its orders: each
    judge of the references must agree.
    """
    pairs = [pair for cell in cells for pair in combinations(_gaits(cell), 2)]
    return _orders([pair for pair in pairs if pair[0].training != pair[1].training], name, known=lambda one, two: True)


def orders_of_two_bodies(cells: Iterable[DesignCell], name: str) -> KeptOrders:
    """Orders of gaits of different bodies that were trained in the same way.

    Each judge must agree, and the references differ by more than their uncertainty.
    """

    def known(one: _Gait, two: _Gait) -> bool:
        return abs(one.reference - two.reference) > math.hypot(one.unknown, two.unknown)

    pairs = [pair for bodies in combinations(map(_gaits, cells), 2) for pair in product(*bodies)]
    return _orders([pair for pair in pairs if pair[0].trained == pair[1].trained], name, known)


def deciding(pairs: Iterable[Pair]) -> float | None:
    """The least ratio above which the order holds; 1 if it does at all ratios, None if no ratio is known.

    It holds where it does in `HELD` of any `NEIGHBOURS` pairs that are next to each other by their ratios. Pairs of
    very unlike scores, whose order hardly any level mistakes, thus do not make up for those of like ones.
    """
    ordered = sorted(pairs, reverse=True)
    if len(ordered) < NEIGHBOURS:
        return None
    right = np.convolve([float(holds) for _, holds in ordered], np.ones(NEIGHBOURS), "valid")
    bad = np.flatnonzero(right < HELD * NEIGHBOURS)
    if not len(bad):
        return 1.0
    ratio = ordered[bad[0] + NEIGHBOURS - 2][0] if bad[0] else math.inf
    return ratio if math.isfinite(ratio) else None


def _gaits(cell: DesignCell) -> list[_Gait]:
    found = []
    stages: dict[str, list[str]] = {}
    for gait in sorted(cell.found, key=stage_of, reverse=True):
        stages.setdefault(training_of(gait), []).append(gait)
    for gait, reference in cell.references.items():
        training = training_of(gait)
        scores = {name: own[gait] for name in cell.samples if gait in (own := cell.scores(name))}
        judged = {name: scores[name] for name in cell.judges if name in scores}
        unknown = abs(reference) * (cell.unknown or 0.0)
        trained = cell.found[gait], stages[training].index(gait)
        found.append(_Gait(cell.design, training, trained, scores, judged, reference, unknown, cell.are_errors))
    return found


def _orders(pairs: Iterable[tuple[_Gait, _Gait]], name: str, known: Callable[[_Gait, _Gait], bool]) -> KeptOrders:
    """Orders of those pairs that can be compared at a fidelity, where `known` tells whether their references can."""
    compared = [pair for pair in pairs if _can_compare(*pair, name)]
    judged = [(ratio, holds and known(*pair)) for pair in compared for ratio, holds in [_judged(*pair, name)]]
    return KeptOrders(deciding(judged), len(judged), tuple(sorted({gait.design for pair in compared for gait in pair})))


def _can_compare(one: _Gait, two: _Gait, name: str) -> bool:
    """Whether another judge knows both gaits, and the better has gone somewhere."""
    if name not in one.scores or name not in two.scores or not (one.judged.keys() & two.judged.keys()) - {name}:
        return False
    return max(one.scores[name], two.scores[name]) > 0.0 or (one.is_error and two.is_error)


def _judged(one: _Gait, two: _Gait, name: str) -> Pair:
    """Ratio at a fidelity, and whether the judges but itself agree."""
    worse, better = sorted((one, two), key=lambda gait: gait.scores[name])
    judges = (better.judged.keys() & worse.judged.keys()) - {name}
    holds = all(better.judged[judge] > worse.judged[judge] for judge in judges)
    return score_ratio(better.scores[name], worse.scores[name]), holds
