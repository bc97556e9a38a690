"""Sweeps: the runs that one launcher was asked to have done, and their states since it last looked."""

import math
import time
from collections.abc import Collection

from sqlalchemy import ColumnElement, exists, insert, or_, select

from zoobench.db.engine import Database, among, batched
from zoobench.db.models import RunRecord, SweepRecord, SweepRunRecord
from zoobench.db.rows import OPEN_STATES, RunRow, RunState
from zoobench.db.runs import fetch_runs
from zoobench.spec import check_storable

_FULL_SECONDS = 10.0  # between two looks at the states of all runs
_OVERLAP_SECONDS = 3 * _FULL_SECONDS  # how far the clocks of two machines may be apart before only a full look helps


def begin_sweep(database: Database, ids: Collection[int]) -> int:
    """Store these runs as a sweep and return its id."""
    with database.write() as session:
        record = SweepRecord(created_at=time.time())
        session.add(record)
        session.flush()
        sweep = record.id
    for some in batched(sorted(set(ids))):
        with database.write() as session:
            session.execute(insert(SweepRunRecord), [{"sweep_id": sweep, "run_id": run_id} for run_id in some])
    return sweep


def narrowed(ids: Collection[int] | None, sweep: int | None) -> list[ColumnElement[bool]]:
    """Conditions on the outer statement's run: that it is one of these, and of this sweep; None does not narrow.

    Raises:
        UsageError: no database can hold the number of the sweep.
    """
    conditions = [] if ids is None else [among(RunRecord.id, ids)]
    return conditions if sweep is None else [*conditions, _in_sweep(sweep)]


def _in_sweep(sweep: int) -> ColumnElement[bool]:
    check_storable("sweep", sweep)
    return exists().where(SweepRunRecord.sweep_id == sweep, SweepRunRecord.run_id == RunRecord.id).correlate(RunRecord)


class Watch:
    """The runs of a sweep, asked for again and again: all of them at first, then those that have changed.

    `open` is the number of those that had not ended at the last look.
    """

    def __init__(self, database: Database, sweep: int) -> None:
        self._database = database
        self._sweep = sweep
        self._states: dict[int, str] = {}
        self._running: set[int] = set()
        self._looked_at = -math.inf
        self.open = 0

    def look(self) -> list[RunRow]:
        """The runs that are in progress, and those whose state is another than at the last look; by id.

        It takes as long as there is something to tell, however long the queue is: it asks for the runs in progress and
        for those that have ended lately. As the clock of the machine where one ended may be wrong, it asks for the
        states of all now and then.
        """
        now = time.time()
        is_full = abs(now - self._looked_at) > _FULL_SECONDS
        statement = select(RunRecord.id, RunRecord.state).where(_in_sweep(self._sweep))
        if is_full:
            self._looked_at = now
        else:
            since = self._looked_at - _OVERLAP_SECONDS
            statement = statement.where(or_(RunRecord.state == RunState.RUNNING, RunRecord.finished_at >= since))
        with self._database.read() as session:
            found = {run_id: state for run_id, state in session.execute(statement)}  # noqa: C416
            news = {run_id for run_id, state in found.items() if self._states.get(run_id) != state}
            asked = sorted(
                news | self._running | {run_id for run_id, state in found.items() if state == RunState.RUNNING}
            )
            rows = [run for some in batched(asked) for run in fetch_runs(session, None, among(RunRecord.id, some))]
        for run in rows:
            self._note(run)
        return rows

    def _note(self, run: RunRow) -> None:
        was_open = self._states.get(run.id) in OPEN_STATES
        self.open += (not run.has_ended) - was_open
        self._states[run.id] = run.state
        (self._running.add if run.state is RunState.RUNNING else self._running.discard)(run.id)
