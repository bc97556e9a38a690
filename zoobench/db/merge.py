"""Joining two databases: the runs of one are added to the other, by their keys.

A run that both have done must have the same results, bit for bit: all but wall times follow from its settings.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from sqlalchemy import func, insert, select, update
from sqlalchemy.orm import Session

from zoobench.db.digests import DIGESTED, digests
from zoobench.db.engine import Database, among, batched
from zoobench.db.models import (
    AttemptRecord,
    MetricRecord,
    ProvenanceRecord,
    ReferenceRecord,
    RunRecord,
    SpecRecord,
    StudyRecord,
    StudyRowRecord,
    SweepRecord,
)
from zoobench.db.removal import CONTENTS, remove_contents
from zoobench.db.rows import RunState
from zoobench.db.specs import spec_columns, spec_of
from zoobench.errors import StorageError

_AT_ONCE = 50  # runs that are read, and then written, at a time

_RESULTS = {name: DIGESTED[name] for name in ("finals", "solution", "archive", "milestones")}
_RESULTS["curves"] = DIGESTED["metrics"]
"""The results in which two runs of one spec must agree; the columns after the id of the run."""
_TIME = "seconds"  # ends the names of the curves that tell of wall time

Row = dict[str, Any]


@dataclass(frozen=True)
class Difference:
    """A run that both databases have done, with other results: its ids here and there, and where they differ."""

    here: int
    there: int
    parts: tuple[str, ...]


@dataclass(frozen=True)
class MergeReport:
    """The outcome of a merge for the runs of the other database.

    Attributes:
        added: new here, by their ids here.
        completed: that were not done here, by their ids here.
        agreeing: done in both, with the same results, by their ids here.
        kept: that were left as they are here: the other has no result of them, or they are in progress; ids here.
        differing: done in both, with other results; those here stay.
        left_out: that were not taken, by their ids there, with the reason.
        sweeps: how many sweeps the other database has, none of which is taken.
        studies: of each study there, by its name, how many rows stay there.
        unproved: of those added and completed the ones that ended without a digest, by their ids here: nothing proves
            that their results are those that were stored.
    """

    added: tuple[int, ...] = ()
    completed: tuple[int, ...] = ()
    agreeing: tuple[int, ...] = ()
    kept: tuple[int, ...] = ()
    differing: tuple[Difference, ...] = ()
    left_out: tuple[tuple[int, str], ...] = ()
    sweeps: int = 0
    studies: Mapping[str, int] = field(default_factory=dict)
    unproved: tuple[int, ...] = ()


def merge(target: Database, source: Database) -> MergeReport:
    """Add the runs of the source to the target; each group of runs is one transaction.

    Sweeps and studies stay where they are: they name runs by the numbers that they have there.
    """
    merger = _Merger(target, source)
    with source.read() as session:
        ids = session.scalars(select(RunRecord.id).order_by(RunRecord.id)).all()
    for some in batched(ids, _AT_ONCE):
        merger.take(some)
    merger.take_references()
    return merger.report()


class _Copied(NamedTuple):
    """All rows of some runs of the source: run and spec by key, the rest by id, and the provenance behind them."""

    runs: dict[str, Row]
    specs: dict[str, Row]
    contents: dict[Any, dict[int, list[Row]]]
    provenance: list[Row]
    results: dict[int, dict[str, Any]]


@dataclass
class _Merger:
    target: Database
    source: Database
    groups: dict[str, list[Any]] = field(default_factory=dict)
    ids: dict[int, int] = field(default_factory=dict)
    """Ids of the runs in the target by those in the source."""

    def report(self) -> MergeReport:
        """The report of the merge, with the data left in the source."""
        rows = (
            select(StudyRecord.name, func.count())
            .join(StudyRowRecord, StudyRowRecord.study_id == StudyRecord.id)
            .group_by(StudyRecord.name)
        )
        with self.source.read() as session:
            sweeps = session.scalar(select(func.count()).select_from(SweepRecord)) or 0
            studies = dict(session.execute(rows.order_by(StudyRecord.name)).all())
        return MergeReport(
            **{name: tuple(found) for name, found in self.groups.items()}, sweeps=sweeps, studies=studies
        )

    def take(self, ids: Collection[int]) -> None:
        """Add these runs of the source, or compare them with those that are here."""
        copied = self._read(ids)
        table = RunRecord
        with self.target.write(alone=True) as session:
            statement = select(table.spec_key, table.id, table.state).where(table.spec_key.in_(copied.runs))
            known = {key: (run_id, state) for key, run_id, state in session.execute(statement)}
            agreeing = _results(session, [run_id for run_id, state in known.values() if state == RunState.DONE])
            if copied.provenance:
                session.execute(self.target.insert(ProvenanceRecord).on_conflict_do_nothing(), copied.provenance)
            for key, row in copied.runs.items():
                if key in known:
                    run_id, state = known[key]
                    self._meet(session, copied, row, run_id, state, agreeing.get(run_id))
                else:
                    session.execute(insert(SpecRecord), [copied.specs[key]])
                    values = {name: value for name, value in row.items() if name != "id"}
                    run_id = session.scalars(insert(table).values(values).returning(table.id)).one()
                    _write_contents(session, copied, row["id"], run_id)
                    self._note_taken("added", row, run_id)
                self.ids[row["id"]] = run_id

    def take_references(self) -> None:
        """Add the reference scores that are not here, of runs that are."""
        with self.source.read() as session:
            rows = _rows(session, ReferenceRecord, ReferenceRecord.kind.is_not(None))
        mapped = [{**row, "run_id": self.ids[row["run_id"]]} for row in rows if row["run_id"] in self.ids]
        if mapped:
            with self.target.write(alone=True) as session:
                session.execute(self.target.insert(ReferenceRecord).on_conflict_do_nothing(), mapped)

    def _read(self, ids: Collection[int]) -> _Copied:
        """The rows of those of these runs that can be taken."""
        with self.source.read() as session:
            rows = {row["id"]: row for row in _rows(session, RunRecord, among(RunRecord.id, ids))}
            sealed = {run_id: row["digest"] for run_id, row in rows.items() if row["digest"]}
            now = digests(session, sealed) if sealed else {}
            keys = {row["spec_key"] for row in rows.values()}
            specs = {row["key"]: row for row in _rows(session, SpecRecord, SpecRecord.key.in_(keys))}
            for run_id, row in list(rows.items()):
                if fault := _fault(row, specs):
                    self._leave_out(rows, run_id, fault)
                elif row["state"] == RunState.RUNNING:
                    self._leave_out(rows, run_id, "is in progress")
                elif run_id in sealed and now[run_id] != sealed[run_id]:
                    self._leave_out(rows, run_id, "is damaged: its results are not those that were stored")
            contents = {table: _by_run(_rows(session, table, among(table.run_id, rows))) for table in CONTENTS}
            hashes = {row["provenance_hash"] for found in contents[AttemptRecord].values() for row in found}
            return _Copied(
                {row["spec_key"]: row for row in rows.values()},
                specs,
                contents,
                _rows(session, ProvenanceRecord, ProvenanceRecord.hash.in_(hashes)),
                _results(session, list(rows)),
            )

    def _meet(
        self, session: Session, copied: _Copied, row: Row, run_id: int, state: str, here: dict[str, Any] | None
    ) -> None:
        """Bring together a run of the source and the same run here, which is in this state and has these results."""
        is_done_there = row["state"] == RunState.DONE
        if is_done_there and here is not None:
            there = copied.results[row["id"]]
            parts = tuple(name for name in _RESULTS if here[name] != there[name])
            if parts:
                self._note("differing", Difference(run_id, row["id"], parts))
            else:
                self._note("agreeing", run_id)
        elif is_done_there and state != RunState.RUNNING:
            remove_contents(session, [run_id])
            values = {name: value for name, value in row.items() if name not in ("id", "rank", "created_at")}
            session.execute(update(RunRecord).where(RunRecord.id == run_id).values(values))
            _write_contents(session, copied, row["id"], run_id)
            self._note_taken("completed", row, run_id)
        else:
            self._note("kept", run_id)

    def _leave_out(self, rows: dict[int, Row], run_id: int, reason: str) -> None:
        del rows[run_id]
        self._note("left_out", (run_id, reason))

    def _note_taken(self, group: str, row: Row, run_id: int) -> None:
        self._note(group, run_id)
        if row["finished_at"] is not None and row["digest"] is None:
            self._note("unproved", run_id)

    def _note(self, group: str, found: Any) -> None:
        self.groups.setdefault(group, []).append(found)


def _rows(session: Session, table: Any, *conditions: Any) -> list[Row]:
    """The rows of a table as dictionaries, in the order in which they were stored."""
    columns = table.__table__.columns
    statement = select(*columns).where(*conditions).order_by(*table.__table__.primary_key)
    return [dict(row) for row in session.execute(statement).mappings()]


def _fault(run: Row, specs: dict[str, Row]) -> str:
    """Why a run cannot be taken, empty if it can; its settings are put right where they can be."""
    key = run["spec_key"]
    try:
        specs[key] = spec_columns(key, spec_of(specs[key]))
    except (StorageError, LookupError):
        return "is damaged: its settings are not those of its key"
    return "" if run["state"] in list(RunState) else f"is damaged: its state is {str(run['state'])[:20]!r}"


def _by_run(rows: Sequence[Row]) -> dict[int, list[Row]]:
    found: dict[int, list[Row]] = {}
    for row in rows:
        found.setdefault(row["run_id"], []).append(row)
    return found


def _write_contents(session: Session, copied: _Copied, there: int, here: int) -> None:
    for table, rows in copied.contents.items():
        if found := rows.get(there):
            own = [{name: value for name, value in row.items() if name != "id"} | {"run_id": here} for row in found]
            session.execute(insert(table), own)


def _results(session: Session, ids: Collection[int]) -> dict[int, dict[str, Any]]:
    """The results of runs by id, as they are compared: of each part all rows in one order, without wall times."""
    found: dict[int, dict[str, Any]] = {run_id: {name: [] for name in _RESULTS} for run_id in ids}
    for part, columns in _RESULTS.items():
        statement = select(*columns).where(among(columns[0], ids))
        if part == "curves":
            statement = statement.where(~MetricRecord.name.endswith(_TIME))
        for run_id, *row in session.execute(statement):
            found[run_id][part].append(tuple(row))
    for parts in found.values():
        for rows in parts.values():
            rows.sort(key=repr)  # each database has an order of its own
    return found
