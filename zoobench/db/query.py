"""Reading a database: runs, their results, curves and logs, and studies. Nothing here writes."""

import json
import time
from collections.abc import Collection
from dataclasses import fields
from pathlib import Path
from typing import Any, Self

from sqlalchemy import ColumnElement, ScalarSelect, and_, func, or_, select
from sqlalchemy.orm import Session, aliased

from zoobench.db.digests import damage, spec_of, unsealed
from zoobench.db.engine import Database, among
from zoobench.db.models import (
    ArchiveRecord,
    AttemptRecord,
    Base,
    FinalRecord,
    LogRecord,
    MetricRecord,
    MilestoneRecord,
    ProvenanceRecord,
    RunRecord,
    SolutionRecord,
    SpecRecord,
)
from zoobench.db.rows import (
    AttemptRow,
    FinalRow,
    LogRow,
    MetricRow,
    MilestoneRow,
    RunRow,
    RunState,
    StudyRun,
    decode_params,
    decode_value,
)
from zoobench.db.schema import prepare
from zoobench.db.studies import load_studies
from zoobench.errors import UsageError
from zoobench.inputs import Start, named_runs
from zoobench.spec import RunSpec


class Reader:
    """The questions that can be asked of a database; `Store` adds the writing.

    Every method raises StorageError if the database cannot be read.
    """

    def __init__(self, location: str | Path, *, create: bool = True) -> None:
        self._database = Database(location, create=create)
        prepare(self._database)

    @property
    def name(self) -> str:
        """The path, or the URL without its password: for messages."""
        return self._database.name

    def close(self) -> None:
        """Close all connections; the store cannot be used afterwards."""
        self._database.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def runs(self, *, ids: Collection[int] | None = None, states: Collection[RunState] | None = None) -> list[RunRow]:
        """The runs in the order of their creation; `ids` and `states` narrow the choice, None does not."""
        conditions = []
        if ids is not None:
            conditions.append(among(RunRecord.id, ids))
        if states is not None:
            conditions.append(RunRecord.state.in_([str(state) for state in states]))
        with self._database.read() as session:
            return _fetch_runs(session, *conditions)

    def run(self, prefix: str) -> RunRow:
        """The run with this id or with a key that starts with this text (at least 4 letters).

        Raises:
            UsageError: no run, or several, match.
        """
        is_id = prefix.isdecimal() and len(prefix) < 10
        if not is_id and len(prefix) < 4:
            raise UsageError(f"{prefix!r} names no run. Give its number, or 4 letters or more of its key.")
        by_key = RunRecord.spec_key.startswith(prefix.lower(), autoescape=True)
        with self._database.read() as session:
            found = _fetch_runs(session, RunRecord.id == int(prefix) if is_id else by_key)
        if len(found) != 1:
            problem = "Several runs match" if found else "No run matches"
            raise UsageError(f"{problem} {prefix!r}. `zoobench status` lists the runs with their numbers.")
        return found[0]

    def counts(self, *, ids: Collection[int] | None = None) -> dict[RunState, int]:
        """Number of runs in each state; states without a run are absent."""
        statement = select(RunRecord.state, func.count()).group_by(RunRecord.state)
        if ids is not None:
            statement = statement.where(among(RunRecord.id, ids))
        with self._database.read() as session:
            return {RunState(state): count for state, count in session.execute(statement)}

    def finals(self, run_id: int) -> list[FinalRow]:
        """The final results of a run by name; empty unless it is DONE."""
        return self.all_finals([run_id]).get(run_id, [])

    def all_finals(self, ids: Collection[int] | None = None) -> dict[int, list[FinalRow]]:
        """The final results of many runs at once, by run id; of all runs for None. Only those that are DONE have any.

        A run that is being done again keeps its former ones in the database, but they are no result of any run.
        """
        statement = (
            select(FinalRecord)
            .join(RunRecord, RunRecord.id == FinalRecord.run_id)
            .where(RunRecord.state == RunState.DONE)
            .order_by(FinalRecord.run_id, self._database.alphabetical(FinalRecord.name))
        )
        if ids is not None:
            statement = statement.where(among(FinalRecord.run_id, ids))
        finals: dict[int, list[FinalRow]] = {}
        with self._database.read() as session:
            for record in session.scalars(statement):
                row = FinalRow(record.name, decode_value(record.value, record.kind), record.unit)
                finals.setdefault(record.run_id, []).append(row)
        return finals

    def solution(self, run_id: int) -> tuple[float, ...] | None:
        """The best parameters that a run has found; None unless it is DONE, or if an earlier zoobench kept none."""
        statement = (
            select(SolutionRecord.params)
            .join(RunRecord, RunRecord.id == SolutionRecord.run_id)
            .where(SolutionRecord.run_id == run_id, RunRecord.state == RunState.DONE)
        )
        with self._database.read() as session:
            stored = session.scalar(statement)
            return None if stored is None else decode_params(stored)

    def stored(self, key: str) -> Start | None:
        """Settings and solution of the run whose key begins so; None unless it is here and done."""
        with self._database.read() as session:
            return _load_stored(session, key)

    def archive(self, run_id: int) -> bytes | None:
        """The archive of a run; None unless it is DONE and its method kept one."""
        statement = (
            select(ArchiveRecord.data)
            .join(RunRecord, RunRecord.id == ArchiveRecord.run_id)
            .where(ArchiveRecord.run_id == run_id, RunRecord.state == RunState.DONE)
        )
        with self._database.read() as session:
            return session.scalar(statement)

    def metrics(self, run_id: int, name: str | None = None) -> list[MetricRow]:
        """The learning curves of a run, or the one of that name, by name and step.

        A run that is being done again keeps the points of its former curves until new ones replace them, but they are
        no part of the new curves.
        """
        statement = (
            select(MetricRecord)
            .join(RunRecord, RunRecord.id == MetricRecord.run_id)
            .where(MetricRecord.run_id == run_id, MetricRecord.attempt > _last_former_attempt())
        )
        if name is not None:
            statement = statement.where(MetricRecord.name == name)
        by_name = self._database.alphabetical(MetricRecord.name)
        with self._database.read() as session:
            return [
                MetricRow(record.name, record.step, decode_value(record.value, record.kind), record.attempt)
                for record in session.scalars(statement.order_by(by_name, MetricRecord.step))
            ]

    def all_metrics(self, ids: Collection[int], names: Collection[str]) -> dict[int, list[MetricRow]]:
        """These learning curves of many runs at once, by run id; otherwise as `metrics`."""
        table = MetricRecord  # its columns and not objects of it, of which there may be a million
        statement = (
            select(table.run_id, table.name, table.step, table.value, table.kind, table.attempt)
            .join(RunRecord, RunRecord.id == table.run_id)
            .where(among(table.run_id, ids), table.name.in_(list(names)), table.attempt > _last_former_attempt())
            .order_by(table.run_id, self._database.alphabetical(table.name), table.step)
        )
        found: dict[int, list[MetricRow]] = {}
        with self._database.read() as session:
            for run_id, name, step, value, kind, attempt in session.execute(statement):
                found.setdefault(run_id, []).append(MetricRow(name, step, decode_value(value, kind), attempt))
        return found

    def milestones(self, run_id: int) -> list[MilestoneRow]:
        """What a run had found after some of its iterations, by iteration; of a run that is done again as `metrics`."""
        with self._database.read() as session:
            return _load_milestones(session, run_id)

    def attempts(self, run_id: int) -> list[AttemptRow]:
        """All attempts at a run, oldest first."""
        statement = (
            select(AttemptRecord, ProvenanceRecord.document)
            .join(ProvenanceRecord, ProvenanceRecord.hash == AttemptRecord.provenance_hash)
            .where(AttemptRecord.run_id == run_id)
            .order_by(AttemptRecord.number)
        )
        with self._database.read() as session:
            return [_attempt_row(record, document) for record, document in session.execute(statement)]

    def logs(self, run_id: int, *, attempt: int | None = None) -> list[LogRow]:
        """The lines that the children of a run printed, oldest first; of all attempts for None."""
        statement = select(LogRecord).where(LogRecord.run_id == run_id).order_by(LogRecord.id)
        if attempt is not None:
            statement = statement.where(LogRecord.attempt == attempt)
        with self._database.read() as session:
            return [LogRow(record.attempt, record.at, record.text) for record in session.scalars(statement)]

    def studies(self, name: str) -> list[StudyRun]:
        """Every time that the study of this name was carried out, oldest first, interrupted ones included."""
        return load_studies(self._database, name)

    def study(self, name: str) -> StudyRun | None:
        """The newest study of this name; None if there is none."""
        return next(reversed(self.studies(name)), None)

    def check(self) -> list[str]:
        """The findings of the database's own integrity check; empty if there are none."""
        return self._database.check()

    def damage(self, ids: Collection[int] | None = None) -> list[str]:
        """What of these runs, or in all of the database, is not as it was stored, as sentences; empty if all is."""
        with self._database.read() as session:
            return list(damage(session, ids))

    def unsealed(self) -> int:
        """Number of runs that an earlier zoobench has ended, whose results nothing can prove intact."""
        with self._database.read() as session:
            return unsealed(session)


def load_all_stored(session: Session, spec: RunSpec) -> tuple[Start, ...]:
    """The runs that a spec names, and those that their gaits and bodies name in turn, as far as they are done."""
    found: dict[str, Start] = {}
    waiting = named_runs(spec.method, spec.controller, spec.design)
    while waiting:
        key = waiting.pop()
        if key not in found and (start := _load_stored(session, key)):
            found[key] = start
            waiting += named_runs(start.spec.controller, start.spec.design)
    return tuple(found.values())


def _load_stored(session: Session, key: str) -> Start | None:
    """As `Reader.stored`, within a transaction."""
    statement = (
        select(SpecRecord.document, SolutionRecord.params, RunRecord.id, SpecRecord.key)
        .join(RunRecord, RunRecord.spec_key == SpecRecord.key)
        .join(SolutionRecord, SolutionRecord.run_id == RunRecord.id)
        .where(SpecRecord.key.startswith(key), RunRecord.state == RunState.DONE)
    )
    found = session.execute(statement).first()
    if found is None:
        return None
    milestones = tuple(row.params for row in _load_milestones(session, found[2]))
    return Start(spec_of(found[3], found[0]), decode_params(found[1]), milestones)


def _load_milestones(session: Session, run_id: int) -> list[MilestoneRow]:
    """As `Reader.milestones`, within a transaction."""
    statement = (
        select(MilestoneRecord)
        .join(RunRecord, RunRecord.id == MilestoneRecord.run_id)
        .where(MilestoneRecord.run_id == run_id, MilestoneRecord.attempt > _last_former_attempt())
        .order_by(MilestoneRecord.step)
    )
    return [MilestoneRow(found.step, found.score, decode_params(found.params)) for found in session.scalars(statement)]


def _last_former_attempt() -> ScalarSelect[int]:
    """Number of the attempt that gave the outer statement's run a result before it was queued to be done again, or 0.

    Nothing up to that attempt has a share in what the run gives now.
    """
    former = aliased(AttemptRecord)
    return (
        select(func.coalesce(func.max(former.number), 0))
        .where(
            former.run_id == RunRecord.id,
            former.outcome == RunState.DONE,
            or_(former.number < RunRecord.attempt, RunRecord.state != RunState.DONE),
        )
        .correlate(RunRecord)
        .scalar_subquery()
    )


def _fetch_runs(session: Session, *conditions: ColumnElement[bool]) -> list[RunRow]:
    former = _last_former_attempt()
    finished = func.sum(AttemptRecord.wall_seconds)
    running_since = func.max(AttemptRecord.started_at).filter(AttemptRecord.ended_at.is_(None))
    statement = (
        select(RunRecord, SpecRecord.document, former, finished, running_since)
        .join(SpecRecord, SpecRecord.key == RunRecord.spec_key)
        .outerjoin(AttemptRecord, and_(AttemptRecord.run_id == RunRecord.id, AttemptRecord.number > former))
        .where(*conditions)
        .group_by(RunRecord.id, SpecRecord.document)
        .order_by(RunRecord.id)
    )
    return [_run_row(*row) for row in session.execute(statement)]


def _run_row(
    record: RunRecord, document: str, former: int, finished: float | None, running_since: float | None
) -> RunRow:
    running = 0.0 if running_since is None else max(time.time() - running_since, 0.0)
    computed: dict[str, Any] = {
        "key": record.spec_key,
        "spec": spec_of(record.spec_key, document),
        "state": RunState(record.state),
        "first_attempt": former + 1,
        "seconds": (finished or 0.0) + running,
    }
    return RunRow(**_columns(record, RunRow, computed), **computed)


def _attempt_row(record: AttemptRecord, document: str) -> AttemptRow:
    computed: dict[str, Any] = {"outcome": RunState(record.outcome), "provenance": json.loads(document)}
    return AttemptRow(**_columns(record, AttemptRow, computed), **computed)


def _columns(record: Base, row: type[Any], others: Collection[str]) -> dict[str, Any]:
    """The columns of a record that a row has under the same names, but for others."""
    return {field.name: getattr(record, field.name) for field in fields(row) if field.name not in others}
