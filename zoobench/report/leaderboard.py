"""A leaderboard: the runs of a suite with their results, and its export, which holds all of them.

The export is JSON in one canonical form: a line for each provenance, component and run, keys sorted; seeds of a cell
that no run exists for share a line. Equal content is equal text, so that what is committed can be compared byte for
byte.
"""

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from zoobench.db.rows import AttemptRow, FinalRow, RunRow, RunState
from zoobench.errors import StorageError, UsageError
from zoobench.report.run_results import SMOKE, RunResult
from zoobench.spec import AXES, RunSpec, canonical_json

if TYPE_CHECKING:
    from zoobench.db.query import Reader

FORMAT = 1
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
class BoardRow:
    """A run that the suite asks for.

    Attributes:
        state: None if no such run exists.
        reason: why it has no score, or cannot be done.
        seconds: wall time of its attempts [s]; 0 while it has not ended.
        attempts: those that its result came from.
    """

    spec: RunSpec
    state: RunState | None = None
    reason: str | None = None
    seconds: float = 0.0
    finals: Mapping[str, FinalRow] = field(default_factory=dict)
    attempts: tuple[Attempt, ...] = ()


@dataclass(frozen=True)
class Leaderboard:
    """A suite with its results; `source` is what `--suite` takes."""

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
            RunResult(run, dict(row.finals))
            for number, row in enumerate(self.rows, start=1)
            if (run := _run_row(number, row)) is not None
        ]

    def missing(self) -> list[RunSpec]:
        """The runs that do not exist."""
        return [row.spec for row in self.rows if row.state is None]

    def completed(self, earlier: "Leaderboard") -> "Leaderboard":
        """With the rows of an earlier export for the runs that have not ended here, or were done there only."""
        known = earlier.ended()
        rows = (_better(row, known.get(row.spec.key(), row)) for row in self.rows)
        return replace(self, rows=tuple(rows))

    def unasked(self, earlier: "Leaderboard") -> list[BoardRow]:
        """The ended runs of an earlier export that this one does not ask for."""
        asked = {row.spec.key() for row in self.rows}
        return [row for key, row in earlier.ended().items() if key not in asked]

    def ended(self) -> dict[str, BoardRow]:
        """The runs that have come to an end, by key."""
        return {row.spec.key(): row for row in self.rows if row.state in _ENDED}


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
    ids = [run.id for run in known.values() if run.state is RunState.DONE]
    finals, attempts = reader.all_finals(ids), reader.all_attempts(ids)
    rows = (
        BoardRow(spec, None if why is None else RunState.SKIPPED, why)
        if (run := known.get(spec.key())) is None
        else _board_row(run, finals.get(run.id, []), attempts.get(run.id, []))
        for spec, why in counted
    )
    return Leaderboard(name, source, summary, tuple(rows))


def to_text(board: Leaderboard) -> str:
    """The export."""
    documents: list[Mapping[str, Any]] = []
    components: list[Mapping[str, Any]] = []
    runs: list[dict[str, Any]] = []
    for row in board.rows:
        cell = _cell(row.spec, components)
        if row.state is not None:
            runs.append(_record(row, cell, documents))
        elif runs and runs[-1]["state"] == MISSING and runs[-1]["spec"] == cell:
            runs[-1]["seeds"].append(row.spec.seed)
        else:
            runs.append({"spec": cell, "state": MISSING, "seeds": [row.spec.seed]})
    suite = {"name": board.name, "source": board.source, "summary": board.summary}
    lines = [
        f'"format":{FORMAT}',
        f'"suite":{canonical_json(suite)}',
        f'"provenance":{_lines(documents)}',
        f'"components":{_lines(components)}',
        f'"runs":{_lines(runs)}',
    ]
    return "{" + ",\n".join(lines) + "}\n"


def from_text(text: str, where: str) -> Leaderboard:
    """The inverse of `to_text`; `where` names the file in messages.

    Raises:
        UsageError: this is no export, or one of another format, or a run's key is not that of its settings.
    """
    try:
        document = json.loads(text, parse_constant=_refuse_constant)
        if document["format"] != FORMAT:
            raise UsageError(f"its format is {document['format']!r}, and this zoobench reads {FORMAT}")
        suite, documents, components = document["suite"], document["provenance"], document["components"]
        rows = tuple(row for record in document["runs"] for row in _rows_of(record, documents, components))
        _check_rows(rows)
        return Leaderboard(str(suite["name"]), str(suite["source"]), str(suite["summary"]), rows)
    except (UsageError, ValueError, TypeError, LookupError, AttributeError, RecursionError) as error:
        what = f"no {error}" if isinstance(error, KeyError) else str(error)
        raise UsageError(
            f"{where} is no export of a leaderboard: {what}. `zoobench leaderboard publish SUITE DIR` writes one."
        ) from None


def _better(now: BoardRow, before: BoardRow) -> BoardRow:
    """The row to keep of a run that two databases have: the one that is done, else the newer if it has ended."""
    is_lost = before.state is RunState.DONE and now.state is not RunState.DONE
    return before if is_lost or now.state not in _ENDED else now


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


def _cell(spec: RunSpec, components: list[Mapping[str, Any]]) -> dict[str, Any]:
    """A spec without its seed; each component is its place in the list, which grows."""
    plain = spec.to_dict()
    del plain["seed"]
    return plain | {axis: _place(plain[axis], components) for axis in AXES}


def _record(row: BoardRow, cell: Mapping[str, Any], documents: list[Mapping[str, Any]]) -> dict[str, Any]:
    """A run that exists as JSON data; its provenance is the place of a document in the list, which grows."""
    return {
        "key": row.spec.key(),
        "spec": cell,
        "seed": row.spec.seed,
        "state": str(row.state),
        "reason": row.reason,
        "seconds": round(row.seconds, 3),
        "finals": {
            # JSON holds no NaN and no infinity: such a value is null.
            name: {"value": final.value if math.isfinite(final.value) else None, "unit": final.unit}
            for name, final in row.finals.items()
        },
        "attempts": [
            {
                "started_at": round(attempt.started_at, 3),
                "ended_at": None if attempt.ended_at is None else round(attempt.ended_at, 3),
                "resumed": attempt.resumed,
                "provenance": _place(attempt.provenance, documents),
            }
            for attempt in row.attempts
        ],
    }


def _rows_of(
    record: Mapping[str, Any], documents: Sequence[Mapping[str, Any]], components: Sequence[Mapping[str, Any]]
) -> Iterator[BoardRow]:
    """The runs of a line: one that exists, or those that do not."""
    cell = record["spec"] | {axis: components[record["spec"][axis]] for axis in AXES}
    if record["state"] == MISSING:
        yield from (BoardRow(RunSpec.from_dict({**cell, "seed": seed})) for seed in record["seeds"])
    else:
        yield _row_of(record, RunSpec.from_dict({**cell, "seed": record["seed"]}), documents)


def _row_of(record: Mapping[str, Any], spec: RunSpec, documents: Sequence[Mapping[str, Any]]) -> BoardRow:
    if spec.key() != record["key"]:
        raise UsageError(f"the key {str(record['key'])[:12]} is not that of {spec}")
    state = RunState(record["state"])
    finals = {
        name: FinalRow(name, math.nan if item["value"] is None else float(item["value"]), str(item["unit"]))
        for name, item in record["finals"].items()
    }
    attempts = tuple(
        Attempt(
            float(item["started_at"]),
            None if item["ended_at"] is None else float(item["ended_at"]),
            item["resumed"],
            _checked_origin(documents[item["provenance"]]),
        )
        for item in record["attempts"]
    )
    return BoardRow(spec, state, record["reason"], float(record["seconds"]), finals, attempts)


def _checked_origin(document: Mapping[str, Any]) -> Mapping[str, Any]:
    kinds = {"code": dict, "cpu": dict, "packages": dict, "gpus": list}
    for name, kind in kinds.items():
        if not isinstance(document.get(name, kind()), kind):
            raise UsageError(f"the origin has {name} {document[name]!r}")
    return document


def _check_rows(rows: Iterable[BoardRow]) -> None:
    seen: set[str] = set()
    for row in rows:
        key, _ = row.spec.key(), hash(row.spec)  # TypeError: a parameter is no plain value
        if key in seen:
            raise UsageError(f"{row.spec} comes twice")
        if row.spec.fidelity.name == SMOKE:
            raise UsageError(f"{row.spec} is a smoke run, whose numbers mean nothing")
        if row.finals and row.state is not RunState.DONE:
            raise UsageError(f"{row.spec} is {row.state or MISSING} and has results")
        if row.state is RunState.DONE and not row.attempts:
            raise UsageError(f"{row.spec} is done, and no attempt says where")
        seen.add(key)


def _place(document: Mapping[str, Any], documents: list[Mapping[str, Any]]) -> int:
    """Where a document is in the list, which grows if it is new."""
    if document not in documents:
        documents.append(document)
    return documents.index(document)


def _lines(items: Sequence[Any]) -> str:
    """A JSON list with an item on each line."""
    return "[\n" + ",\n".join(map(canonical_json, items)) + "\n]" if items else "[]"


def _refuse_constant(name: str) -> None:
    raise ValueError(f"{name} is no JSON")


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
