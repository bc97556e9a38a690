"""What a database holds, chosen by component names, as the tables and listings need it. Reads only."""

from collections.abc import Iterable
from dataclasses import dataclass, fields
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING

from zoobench.db.rows import AttemptRow, FinalRow, RunRow, RunState
from zoobench.errors import UnknownNameError, UsageError
from zoobench.spec import Ref, RunSpec

if TYPE_CHECKING:
    from zoobench.db.query import Reader

SCORE = "score"
SMOKE = "smoke"
PROBE = "probe"


@dataclass(frozen=True)
class RunSelection:
    """Which runs are meant: names or globs separated by commas on each axis, empty for all of it."""

    env: str = ""
    task: str = ""
    design: str = ""
    controller: str = ""
    method: str = ""
    fidelity: str = ""

    def options(self) -> list[str]:
        """The command line options that make this choice."""
        chosen = [(field.name, getattr(self, field.name)) for field in fields(self)]
        return [part for name, value in chosen if value for part in (f"--{name}", value)]


@dataclass(frozen=True)
class RunResult:
    """A run with its final values by name; there are none unless it is DONE.

    `lacks` says why one that is DONE has no score.
    """

    run: RunRow
    finals: dict[str, FinalRow]
    lacks: str = "done without a finite score"

    @property
    def spec(self) -> RunSpec:
        """What the run is."""
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


def choose_runs(reader: "Reader", choice: RunSelection, *, states: Iterable[RunState] | None = None) -> list[RunRow]:
    """The runs of a choice in the order of their creation.

    Raises:
        UnknownNameError: a name (not a glob) that no run in the database has.
        UsageError: a component with parameters instead of a name.
        StorageError: the database cannot be read.
    """
    chosen = reader.runs(states=None if states is None else list(states))
    for field in fields(choice):
        patterns = [part.strip() for part in getattr(choice, field.name).split(",") if part.strip()]
        known = {_ref(run, field.name).name for run in chosen}
        for pattern in patterns:
            if "=" in pattern:
                raise UsageError(
                    f"Cannot choose by {pattern!r}: runs are chosen by names and globs, not by parameters."
                )
            if known and not any(character in pattern for character in "*?[") and pattern not in known:
                raise UnknownNameError(f"{field.name} among the runs:", pattern, known)
        chosen = [run for run in chosen if _matches(_ref(run, field.name), patterns)]
    return chosen


def choose_results(reader: "Reader", choice: RunSelection) -> list[RunResult]:
    """The runs of a choice with their finals; raises as `choose_runs`."""
    runs = choose_runs(reader, choice)
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


def _ref(run: RunRow, axis: str) -> Ref:
    ref: Ref = getattr(run.spec, axis)
    return ref


def _matches(ref: Ref, patterns: list[str]) -> bool:
    return not patterns or any(fnmatchcase(ref.name, pattern) for pattern in patterns)
