"""The best score of a run so far by the amount spent, as a database keeps it."""

from bisect import bisect_right
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from zoobench.report.run_results import SCORE
from zoobench.spec import BudgetKind

if TYPE_CHECKING:
    from zoobench.db.query import Reader


@dataclass(frozen=True)
class Curve:
    """The score of a run's incumbent by the amount spent; a point for each iteration, at least one.

    Attributes:
        spent: never falling.
        scores: the best so far, None before the first [the task's unit].
    """

    spent: tuple[float, ...]
    scores: tuple[float | None, ...]

    def at(self, amount: float) -> float | None:
        """The best score when no more than this was spent; None before the first."""
        passed = bisect_right(self.spent, amount)
        return self.scores[passed - 1] if passed else None

    def rises(self) -> "Curve":
        """The points alone at which the score rose, which say the same; at least the first that has a score."""
        kept = [
            (spent, score)
            for spent, score, before in zip(self.spent, self.scores, (None, *self.scores), strict=False)
            if score != before
        ]
        return Curve(tuple(spent for spent, _ in kept), tuple(score for _, score in kept))


def read_curves(reader: "Reader", runs: Collection[int], kind: BudgetKind) -> dict[int, Curve]:
    """The curves of these runs by id, against the amount spent in this currency; of some there may be none.

    Raises:
        StorageError: the database cannot be read.
    """
    found = {}
    for run, own in points(reader, runs, (kind, SCORE)).items():
        if pairs := [(point[kind], point.get(SCORE)) for _, point in sorted(own.items()) if kind in point]:
            spent, scores = zip(*pairs, strict=True)
            found[run] = Curve(spent, scores)
    return found


def points(reader: "Reader", runs: Collection[int], names: Sequence[str]) -> dict[int, dict[int, dict[str, float]]]:
    """The values of these metrics by run id and iteration.

    Raises:
        StorageError: the database cannot be read.
    """
    found: dict[int, dict[int, dict[str, float]]] = {}
    for run, rows in reader.all_metrics(runs, names).items() if runs else ():
        own = found.setdefault(run, {})
        for row in rows:
            own.setdefault(row.step, {})[row.name] = row.value
    return found
