"""The runs of a database with their final values, as tables and listings need them."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from zoobench.db.rows import AttemptRow, FinalRow, RunRow, RunState
from zoobench.spec import RunSelection, RunSpec

if TYPE_CHECKING:
    from zoobench.db.query import Reader

SCORE = "score"
SMOKE = "smoke"
PROBE = "probe"


@dataclass(frozen=True)
class RunResult:
    """A run with its final values by name, none unless it is DONE; `lacks` says why one that is DONE has no score."""

    run: RunRow
    finals: dict[str, FinalRow]
    lacks: str = "done without a finite score"

    @property
    def spec(self) -> RunSpec:
        """The settings of the run."""
        return self.run.spec

    @property
    def score(self) -> FinalRow | None:
        """The final score with its unit, None for a run without one."""
        return self.finals.get(SCORE)

    @property
    def is_smoke(self) -> bool:
        """Whether this was a test of the machinery, whose numbers mean nothing."""
        return self.run.spec.fidelity.name == SMOKE

    @property
    def is_probe(self) -> bool:
        """Whether this run measured the simulator, not a method."""
        return self.run.spec.method.name == PROBE


def choose_results(reader: "Reader", selection: RunSelection) -> list[RunResult]:
    """The selected runs with their finals, in the order of their creation.

    Raises:
        UsageError: a selector fits no run of the database, as `RunSelection.among`.
        StorageError: the database cannot be read.
    """
    runs = selection.among(reader.runs(), lambda run: run.spec, "in the database")
    finals = reader.all_finals([run.id for run in runs]) if runs else {}
    return [RunResult(run, {final.name: final for final in finals.get(run.id, [])}) for run in runs]


def origins(reader: "Reader", results: Iterable[RunResult]) -> list[AttemptRow]:
    """The attempts that the finished ones of these results came from: all that carried a run forward.

    What an attempt gave before the run was done again is nobody's result.
    """
    return [
        attempt
        for result in results
        if result.run.state is RunState.DONE
        for attempt in reader.attempts(result.run.id)
        if attempt.number >= result.run.first_attempt and (attempt.progressed or attempt.outcome is RunState.DONE)
    ]
