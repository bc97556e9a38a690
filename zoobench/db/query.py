"""Reading a database: runs, their results, curves and logs, and studies. Nothing here writes."""

from collections import Counter
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, Self

from sqlalchemy import func, select
from sqlalchemy.orm import InstrumentedAttribute, Session

from zoobench.db import published
from zoobench.db.digests import damage, unsealed
from zoobench.db.engine import Database
from zoobench.db.many import ManyReader
from zoobench.db.models import (
    ArchiveRecord,
    LogRecord,
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
    document_of,
)
from zoobench.db.runs import fetch_runs, last_former_attempt
from zoobench.db.schema import prepare
from zoobench.db.specs import spec_from
from zoobench.db.studies import load_studies
from zoobench.errors import UnknownRunError, UsageError
from zoobench.inputs import Start, named_runs
from zoobench.spec import RunSpec


def is_number(text: str) -> bool:
    """Whether a text is a run's number, not the start of its key."""
    return text.isdecimal() and len(text) < 10


class Reader(ManyReader):
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

    def run(self, prefix: str) -> RunRow:
        """The run with this id or with a key that starts with this text (at least 4 letters).

        Raises:
            UnknownRunError: no run matches.
            UsageError: several do, or the text is too short.
            StorageError: its settings are damaged.
        """
        is_id = is_number(prefix)
        if not is_id and len(prefix) < 4:
            raise UsageError(f"{prefix!r} names no run. Give its number, or 4 letters or more of its key.")
        by_key = RunRecord.spec_key.startswith(prefix.lower(), autoescape=True)
        chosen = RunRecord.id == int(prefix) if is_id else by_key
        with self._database.read() as session:
            found = list(fetch_runs(session, None, chosen))
            if not found and (key := session.scalar(select(RunRecord.spec_key).where(chosen).limit(1))):
                spec_from(key, session.get_one(SpecRecord, key).document)
        listing = "`zoobench status` lists the runs with their numbers."
        if not found:
            raise UnknownRunError(f"No run matches {prefix!r}. {listing}")
        if len(found) > 1:
            raise UsageError(f"Several runs match {prefix!r}. {listing}")
        return found[0]

    def newest(self, count: int) -> list[RunRow]:
        """The runs with the highest numbers, the newest first."""
        with self._database.read() as session:
            last = session.scalar(select(func.max(RunRecord.id))) or 0
            return list(fetch_runs(session, None, RunRecord.id > last - count))[::-1]

    def counts(self) -> dict[RunState, int]:
        """Number of runs in each state; states without a run are absent."""
        statement = select(RunRecord.state, func.count()).group_by(RunRecord.state)
        with self._database.read() as session:
            found: Counter[RunState] = Counter()
            for state, count in session.execute(statement):
                found[RunState.stored(state)] += count
            return dict(found)

    def finals(self, run_id: int) -> list[FinalRow]:
        """The final results of a run by name; empty unless it is DONE."""
        return self.all_finals([run_id]).get(run_id, [])

    def solution(self, run_id: int) -> tuple[float, ...] | None:
        """The best parameters that a run has found; None unless it is DONE, or if an earlier zoobench kept none."""
        stored = self._of_done(run_id, SolutionRecord.params)
        return None if stored is None else decode_params(stored)

    def stored(self, key: str) -> Start | None:
        """Settings and solution of the run whose key begins so; None unless it is here and done, or published."""
        with self._database.read() as session:
            return _load_stored(session, key)

    def archive(self, run_id: int) -> bytes | None:
        """The archive of a run; None unless it is DONE and its method kept one."""
        return self._of_done(run_id, ArchiveRecord.data)

    def _of_done(self, run_id: int, column: InstrumentedAttribute[bytes]) -> bytes | None:
        """A column of the one row of its table that belongs to a run; None unless the run is DONE."""
        statement = select(column).join(RunRecord, RunRecord.id == column.class_.run_id)
        with self._database.read() as session:
            return session.scalar(statement.where(RunRecord.id == run_id, RunRecord.state == RunState.DONE))

    def metrics(self, run_id: int, name: str | None = None) -> list[MetricRow]:
        """The learning curves of a run, or the one of that name, by name and step.

        A run that is being done again keeps the points of its former curves until new ones replace them, but they are
        no part of the new curves.
        """
        return self.all_metrics([run_id], None if name is None else [name]).get(run_id, [])

    def milestones(self, run_id: int) -> list[MilestoneRow]:
        """The best solutions of a run after some of its iterations, by iteration; repeated runs as in `metrics`."""
        with self._database.read() as session:
            return _load_milestones(session, run_id)

    def plugins(self) -> list[Mapping[str, Any]]:
        """The records of the plug-ins that took part in attempts, as `plugins_of` gave them, each once."""
        with self._database.read() as session:
            documents = session.scalars(
                select(ProvenanceRecord.document).where(ProvenanceRecord.document.contains('"plugins"'))
            )
            return [document_of(document).get("plugins", {}) for document in documents]

    def attempts(self, run_id: int) -> list[AttemptRow]:
        """All attempts at a run, oldest first."""
        return self.all_attempts([run_id]).get(run_id, [])

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

    @property
    def size(self) -> int:
        """How much `check` has to read [bytes]; 0 if it reads nothing."""
        return self._database.size

    def check(self) -> list[str]:
        """The findings of the database's own integrity check; empty if there are none."""
        return self._database.check()

    def damage(self, ids: Collection[int] | None = None) -> list[str]:
        """The damage in these runs, or in all of the database, as sentences; empty if all data is as it was stored."""
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
        return published.start(key)
    milestones = tuple(row.params for row in _load_milestones(session, found[2]))
    return Start(spec_from(found[3], found[0]), decode_params(found[1]), milestones)


def _load_milestones(session: Session, run_id: int) -> list[MilestoneRow]:
    """As `Reader.milestones`, within a transaction."""
    statement = (
        select(MilestoneRecord)
        .join(RunRecord, RunRecord.id == MilestoneRecord.run_id)
        .where(MilestoneRecord.run_id == run_id, MilestoneRecord.attempt > last_former_attempt())
        .order_by(MilestoneRecord.step)
    )
    return [MilestoneRow(found.step, found.score, decode_params(found.params)) for found in session.scalars(statement)]
