"""Removing runs: all rows that belong to them, and rows that would be left without a meaning."""

from collections.abc import Collection

from sqlalchemy import delete, exists, select
from sqlalchemy.orm import Session

from zoobench.db.engine import among, batched
from zoobench.db.models import (
    ArchiveRecord,
    AttemptRecord,
    CheckpointRecord,
    FinalRecord,
    LogRecord,
    MetricRecord,
    MilestoneRecord,
    ProvenanceRecord,
    ReferenceRecord,
    RunRecord,
    SolutionRecord,
    SpecRecord,
    StudyRecord,
    StudyRowRecord,
    SweepRunRecord,
)
from zoobench.db.rows import RunRow, RunState, document_of
from zoobench.errors import UsageError
from zoobench.inputs import named_runs

CONTENTS = (
    AttemptRecord, CheckpointRecord, FinalRecord, SolutionRecord, ArchiveRecord, MilestoneRecord, MetricRecord,
    LogRecord,
)  # fmt: skip
"""The tables with the results of runs, by `run_id`."""


def dependents(runs: Collection[RunRow], ids: Collection[int]) -> list[RunRow]:
    """Those of the runs that name one of these as start, gait or body, or name one that does, and are none of them."""
    chosen = set(ids)
    keys = {run.key for run in runs if run.id in chosen}
    found: list[RunRow] = []
    names = {run.id: named_runs(run.spec.method, run.spec.controller, run.spec.design) for run in runs}
    rest = [run for run in runs if names[run.id] and run.id not in chosen]
    while more := [run for run in rest if any(key.startswith(name) for name in names[run.id] for key in keys)]:
        found += more
        keys = {run.key for run in more}
        rest = [run for run in rest if run not in more]
    return sorted(found, key=lambda run: run.id)


def remove_runs(session: Session, ids: Collection[int]) -> None:
    """Remove runs with all that belongs to them.

    Raises:
        UsageError: one of them is in progress.
    """
    for some in batched(ids):
        chosen = among(RunRecord.id, some)
        if busy := session.scalar(select(RunRecord.id).where(chosen, RunRecord.state == RunState.RUNNING).limit(1)):
            raise UsageError(f"Run {busy} is in progress. End it with: zoobench cancel {busy}")
        remove_contents(session, some)
        for table in (SweepRunRecord, ReferenceRecord):
            session.execute(delete(table).where(among(table.run_id, some)))
        keys = list(session.scalars(select(RunRecord.spec_key).where(chosen)))
        session.execute(delete(RunRecord).where(chosen))
        session.execute(delete(SpecRecord).where(SpecRecord.key.in_(keys)))
    _remove_study_rows(session, set(ids))
    unused = (
        ~exists().where(AttemptRecord.provenance_hash == ProvenanceRecord.hash),
        ~exists().where(StudyRecord.provenance_hash == ProvenanceRecord.hash),
    )
    session.execute(delete(ProvenanceRecord).where(*unused))


def remove_contents(session: Session, ids: Collection[int]) -> None:
    """Remove the results of these runs, but not the runs."""
    for table in CONTENTS:
        session.execute(delete(table).where(among(table.run_id, ids)))


def _remove_study_rows(session: Session, ids: set[int]) -> None:
    """Remove the rows of studies that tell of these runs, whose numbers may be given to others."""
    table = StudyRowRecord
    statement = select(table.study_id, table.number, table.document).where(table.document.contains('"run"'))
    for study, number, document in session.execute(statement).all():
        if document_of(document).get("run") in ids:
            session.execute(delete(table).where(table.study_id == study, table.number == number))
