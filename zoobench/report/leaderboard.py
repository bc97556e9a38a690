"""A leaderboard: the runs of a suite with their results."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from zoobench.db.rows import TRANSFER, AttemptRow, FinalRow, RunRow, RunState
from zoobench.errors import StorageError, UsageError
from zoobench.report.curve import Curve, read_curves
from zoobench.report.lasting import Lasting, read_lasting
from zoobench.report.run_results import SMOKE, RunResult
from zoobench.spec import AXES, WALL_GAP, BudgetKind, Ref, RunSpec, currency, standing

if TYPE_CHECKING:
    from zoobench.db.query import Reader

MISSING = "missing"
_OF_PROVENANCE = ("code", "cpu", "gpus", "memory", "packages", "python")
"""The parts of a provenance that an export holds; not the name of the machine."""
_ENDED = (RunState.DONE, RunState.FAILED, RunState.DIVERGED, RunState.TIMEOUT)


@dataclass(frozen=True)
class Attempt:
    """An attempt that a result came from; times in seconds since the epoch."""

    started_at: float
    ended_at: float | None
    resumed: bool
    provenance: Mapping[str, Any]


@dataclass(frozen=True)
class FinerScore:
    """The score of a solution on a finer grid; None where that simulation diverged."""

    fidelity: Ref
    score: float | None


@dataclass(frozen=True)
class BoardRow:
    """A run that the suite asks for.

    Attributes:
        state: None if no such run exists.
        reason: why it has no score, or cannot be done.
        seconds: wall time of its attempts [s]; 0 while it has not ended.
        attempts: those that its result came from.
        solution: its parameters, if it is the best run of its row over methods and seeds.
        finer: the score of its solution on the finest grid on which it was evaluated, with the most particles.
        lasting: the result of its solution over more frames; None if it was not evaluated.
        curve: its best score by the substeps, or with a budget in episodes those, that it had spent; None if unknown.
    """

    spec: RunSpec
    state: RunState | None = None
    reason: str | None = None
    seconds: float = 0.0
    finals: Mapping[str, FinalRow] = field(default_factory=dict)
    attempts: tuple[Attempt, ...] = ()
    solution: tuple[float, ...] | None = None
    finer: FinerScore | None = None
    curve: Curve | None = None
    lasting: Lasting | None = None

    @property
    def score(self) -> float:
        """Its score, or minus infinity without one."""
        return self.finals["score"].value if "score" in self.finals else -math.inf

    @property
    def wall_gap(self) -> float | None:
        """How near its solution came to a side of the arena [cells]; None if it is not known.

        Runs of an earlier zoobench did not read it; then it may be known from a longer episode.
        """
        if WALL_GAP in self.finals:
            return self.finals[WALL_GAP].value
        return None if self.lasting is None else self.lasting.home_gap

    @property
    def standing(self) -> tuple[bool, float]:
        """The key by which the best of several is chosen, as `zoobench.spec.standing`."""
        return standing(self.score, self.wall_gap)


@dataclass(frozen=True)
class Leaderboard:
    """A suite with its results; `source` is its name for `--suite`."""

    name: str
    source: str
    summary: str
    rows: tuple[BoardRow, ...]

    def attempts(self, runs: Iterable[int]) -> list[Attempt]:
        """Those that the results of these runs came from; a run's number is its place, from 1."""
        return [attempt for number in runs for attempt in self.rows[number - 1].attempts]

    def results(self) -> list[RunResult]:
        """The runs that exist, as tables take them; their ids are their places, from 1."""
        return [
            RunResult(run, _with_gap(row))
            for number, row in enumerate(self.rows, start=1)
            if (run := _run_row(number, row)) is not None
        ]

    def curves(self, runs: Iterable[int]) -> dict[int, Curve]:
        """Those of these runs that are known; a run's number is its place, from 1."""
        found = ((number, self.rows[number - 1].curve) for number in runs)
        return {number: curve for number, curve in found if curve is not None}

    def with_row(self, changed: BoardRow) -> "Leaderboard":
        """With another row in place of that of the same run."""
        return replace(self, rows=tuple(changed if row.spec == changed.spec else row for row in self.rows))

    def missing(self) -> list[RunSpec]:
        """The runs that do not exist."""
        return [row.spec for row in self.rows if row.state is None]

    def completed(self, earlier: "Leaderboard") -> "Leaderboard":
        """With the rows of an earlier export for the runs that have not ended here, or were done there only."""
        known = earlier.ended()
        rows = [_better(row, known.get(row.spec.key(), row)) for row in self.rows]
        best = {row.spec for row in best_of_rows(row for row in rows if row.solution is not None)}
        return replace(self, rows=tuple(row if row.spec in best else replace(row, solution=None) for row in rows))

    def unasked(self, earlier: "Leaderboard") -> list[BoardRow]:
        """The ended runs of an earlier export that this one does not ask for."""
        asked = {row.spec.key() for row in self.rows}
        return [row for key, row in earlier.ended().items() if key not in asked]

    def ended(self) -> dict[str, BoardRow]:
        """The runs that have come to an end, by key."""
        return {row.spec.key(): row for row in self.rows if row.state in _ENDED}


def best_of_rows(rows: Iterable[BoardRow], *, by_method: bool = False) -> list[BoardRow]:
    """The best run of each row of the tables over methods and seeds by `BoardRow.standing`; the first of equal ones.

    With `by_method`, one of each method.
    """
    best: dict[tuple[str, ...], BoardRow] = {}
    method_axis = AXES.index("method")
    for row in rows:
        cell = row.spec.cell()
        if not by_method:
            cell = cell[:method_axis] + cell[method_axis + 1 :]
        if row.score > -math.inf and (cell not in best or row.standing > best[cell].standing):
            best[cell] = row
    return list(best.values())


def gather(
    reader: "Reader", name: str, source: str, summary: str, asked: Sequence[tuple[RunSpec, str | None]]
) -> Leaderboard:
    """The results that a database has of the runs of a suite, each with the reason why it cannot be done, if any.

    Smoke runs are left out: their numbers mean nothing.

    Raises:
        UsageError: the suite has no other runs.
        StorageError: the database cannot be read, or a result is not as it was stored.
    """
    counted = [(spec, why) for spec, why in asked if spec.fidelity.name != SMOKE]
    if not counted:
        raise UsageError(f"All runs of the suite {name!r} have the fidelity smoke, and no table shows those.")
    known = {run.key: run for run in reader.runs(keys=[spec.key() for spec, _ in counted])}
    if damaged := reader.damage([run.id for run in known.values()]):
        raise StorageError(
            f"{reader.name} is damaged: {damaged[0]}, and {len(damaged) - 1} more of its runs. Restore it from a copy, "
            "or do these runs again with `zoobench run --rerun`; `zoobench doctor --full` lists them."
        )
    done = [run for run in known.values() if run.state is RunState.DONE]
    ids = [run.id for run in done]
    finals, attempts = reader.all_finals(ids), reader.all_attempts(ids)
    specs = {run.id: run.spec for run in known.values()}
    finer, lasting = _finer_scores(reader, specs), read_lasting(reader, specs)
    curves = _curves(reader, done)
    rows = [
        BoardRow(spec, None if why is None else RunState.SKIPPED, why)
        if (run := known.get(spec.key())) is None
        else replace(
            _board_row(run, finals.get(run.id, []), attempts.get(run.id, [])),
            finer=finer.get(run.id),
            curve=curves.get(run.id),
            lasting=lasting.get(run.id),
        )
        for spec, why in counted
    ]
    solutions = {row.spec: reader.solution(known[row.spec.key()].id) for row in best_of_rows(rows)}
    return Leaderboard(name, source, summary, tuple(replace(row, solution=solutions.get(row.spec)) for row in rows))


def _better(now: BoardRow, before: BoardRow) -> BoardRow:
    """The row to keep of a run that two databases have: the one that is done, else the newer if it has ended.

    A score on a finer grid, one over more frames and a curve that are known there count here, too.
    """
    is_lost = before.state is RunState.DONE and now.state is not RunState.DONE
    if is_lost or now.state not in _ENDED:
        return before
    return replace(
        now,
        finer=now.finer or before.finer,
        curve=now.curve or before.curve,
        lasting=now.lasting or before.lasting,
    )


def _curves(reader: "Reader", runs: Iterable[RunRow]) -> dict[int, Curve]:
    """The curves of these runs by id, in the currency of their table, by the points at which they rise."""
    ids: dict[BudgetKind, list[int]] = {}
    for run in runs:
        ids.setdefault(currency(run.spec.budget.kind), []).append(run.id)
    found = (read_curves(reader, members, kind) for kind, members in ids.items())
    return {run: curve.rises() for some in found for run, curve in some.items()}


def _finer_scores(reader: "Reader", specs: Mapping[int, RunSpec]) -> dict[int, FinerScore]:
    """The scores of these runs' solutions, by id, on the finest grid that is finer than their own, with most particles.

    Evaluations of another environment, task or episode length do not count.
    """
    found: dict[int, FinerScore] = {}
    for row in (row.document for study in reader.studies(TRANSFER) for row in study.rows):
        home = specs.get(row["run"])
        if home is None or (row["env"], row["task"], row["frames"]) != (str(home.env), str(home.task), home.frames):
            continue
        fidelity = Ref.parse(row["fidelity"])
        if _coarseness(fidelity)[0] >= _coarseness(home.fidelity)[0]:
            continue
        before = found.get(row["run"])
        if before is None or _coarseness(fidelity) < _coarseness(before.fidelity):
            found[row["run"]] = FinerScore(fidelity, row["score"])
    return found


def particles_per_cell(fidelity: Ref) -> float:
    """Particles per cell of a resolved fidelity; 0 if it has no such parameter."""
    return float(fidelity.kwargs.get("particles_per_cell", 0))


def _coarseness(fidelity: Ref) -> tuple[float, float]:
    """The key by which fidelities are ordered: the grid's spacing [m], and of one grid the fewer particles."""
    return float(fidelity.kwargs.get("grid_spacing", math.inf)), -particles_per_cell(fidelity)


def _board_row(run: RunRow, finals: Iterable[FinalRow], attempts: Iterable[AttemptRow]) -> BoardRow:
    made = tuple(
        Attempt(
            attempt.started_at,
            attempt.ended_at,
            attempt.resumed,
            {name: attempt.provenance[name] for name in _OF_PROVENANCE if name in attempt.provenance},
        )
        for attempt in attempts
        if attempt.number >= run.first_attempt and (attempt.progressed or attempt.outcome is RunState.DONE)
    )
    seconds = run.seconds if run.state in _ENDED else 0.0
    return BoardRow(run.spec, run.state, run.reason, seconds, {final.name: final for final in finals}, made)


def _with_gap(row: BoardRow) -> dict[str, FinalRow]:
    """The finals of a run, with the gap from the arena's sides if that is known."""
    gap = row.wall_gap
    return {**row.finals, **({} if gap is None else {WALL_GAP: FinalRow(WALL_GAP, gap, "cells")})}


def _run_row(number: int, row: BoardRow) -> RunRow | None:
    """The run as a database would give it, as far as tables ask; None if it does not exist."""
    if row.state is None:
        return None
    return RunRow(
        id=number,
        key=row.spec.key(),
        spec=row.spec,
        state=row.state,
        attempt=len(row.attempts),
        first_attempt=1,
        seconds=row.seconds,
        reason=row.reason,
        fraction=1.0,
    )
