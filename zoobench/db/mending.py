"""Mending of damaged settings: those that follow from other data are written anew, and the others are given up."""

from collections.abc import Iterator

from sqlalchemy import delete, select, update
from sqlalchemy.orm import Session

from zoobench.db.engine import Database
from zoobench.db.models import RunRecord, SpecRecord
from zoobench.db.removal import remove_runs
from zoobench.db.rows import RunState
from zoobench.db.specs import digest_of, spec_columns, spec_of
from zoobench.errors import StorageError


def mend_settings(database: Database) -> list[str]:
    """Put right the settings of runs, and say so in sentences; empty if nothing had to be.

    They follow from either of a run's document and its columns. A run whose settings nothing tells is removed.
    """
    with database.write(alone=True) as session:
        return list(_mend_settings(session))


def _mend_settings(session: Session) -> Iterator[str]:
    table = SpecRecord.__table__
    runs = dict(session.execute(select(RunRecord.spec_key, RunRecord.id)).all())
    for row in [dict(row) for row in session.execute(select(table)).mappings()]:
        key = row["key"]
        try:
            whole = spec_columns(key, spec_of(row))
        except StorageError:
            yield f"run {runs.get(key, key[:12])} was removed: its settings cannot be restored"
            _remove(session, key, runs.get(key))
            continue
        if digest_of(str(row["document"])) == key:
            whole["document"] = row["document"]
        if whole != row:
            session.execute(update(SpecRecord).where(SpecRecord.key == key).values(whole))
            yield f"the settings of run {runs.get(key, key[:12])} were restored"


def _remove(session: Session, key: str, run_id: int | None) -> None:
    if run_id is not None:
        session.execute(update(RunRecord).where(RunRecord.id == run_id).values(state=RunState.FAILED))
        remove_runs(session, [run_id])
    session.execute(delete(SpecRecord).where(SpecRecord.key == key))
