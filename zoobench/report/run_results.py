"""The runs of a database with their final values, as tables and listings need them."""

import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from zoobench.db.many_rows import OriginRow
from zoobench.db.rows import FinalRow, RunRow, RunState
from zoobench.spec import WALL_GAP, RunSelection, RunSpec
from zoobench.tasks.quantities import Quantity, quantity_of

if TYPE_CHECKING:
    from zoobench.db.query import Reader

SCORE = "score"
SMOKE = "smoke"
PROBE = "probe"
NO_SCORE = "done without a finite score"


@dataclass(frozen=True)
class RunResult:
    """A run with its final values by name, none unless it is DONE; `lacks` says why one that is DONE has no score."""

    run: RunRow
    finals: dict[str, FinalRow]
    lacks: str = NO_SCORE

    @property
    def spec(self) -> RunSpec:
        """The settings of the run."""
        return self.run.spec

    @property
    def score(self) -> FinalRow | None:
        """The final score with its unit, None for a run without one."""
        return self.finals.get(SCORE)

    @property
    def quantity(self) -> Quantity:
        """The quantity of the score, by which it is shown."""
        return quantity_of(self.run.spec.task, "" if self.score is None else self.score.unit)

    @property
    def is_smoke(self) -> bool:
        """Whether this was a test of the machinery, whose numbers mean nothing."""
        return self.run.spec.fidelity.name == SMOKE

    @property
    def is_probe(self) -> bool:
        """Whether this run measured the simulator, not a method."""
        return self.run.spec.method.name == PROBE


def finals_record(finals: Mapping[str, FinalRow]) -> dict[str, dict[str, Any]]:
    """Finals by name as JSON takes them, which holds no NaN and no infinity: such a value is null."""
    return {
        name: {"value": final.value if math.isfinite(final.value) else None, "unit": final.unit}
        for name, final in sorted(finals.items())
    }


OVERVIEW = (SCORE, WALL_GAP)
"""The finals that a listing for people tells of."""


def choose_results(reader: "Reader", selection: RunSelection) -> list[RunResult]:
    """The selected runs with their finals, in the order of their creation.

    Raises:
        UsageError: a selector fits no run of the database, as `RunSelection.among`.
        StorageError: the database cannot be read.
    """
    return list(iterate_results(reader, selection))


def iterate_results(
    reader: "Reader", selection: RunSelection, names: Collection[str] | None = None
) -> Iterator[RunResult]:
    """The same one by one, with the finals of these names alone if any are given; raises with the first."""
    for run, finals in reader.selected(selection, names):
        yield RunResult(run, {final.name: final for final in finals})


def results_of(reader: "Reader", ids: Collection[int]) -> list[RunResult]:
    """These runs with their finals, in the order of their creation.

    Raises:
        StorageError: the database cannot be read.
    """
    finals = reader.all_finals(ids)
    return [RunResult(run, {final.name: final for final in finals.get(run.id, ())}) for run in reader.runs(ids=ids)]


def origins(reader: "Reader", results: Iterable[RunResult]) -> list[OriginRow]:
    """Where the finished ones of these results come from, as `Reader.origins`."""
    return reader.origins([result.run.id for result in results if result.run.state is RunState.DONE])
