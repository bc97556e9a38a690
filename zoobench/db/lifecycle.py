"""The ends of attempts and the next states of their runs: who is taken for dead, and the rules of retrying."""

import time
from dataclasses import replace

from sqlalchemy import Update, func, update
from sqlalchemy.orm import Session

from zoobench.db.models import AttemptRecord, RunRecord
from zoobench.db.owner import Owner
from zoobench.db.rows import Ending, RunRow, RunState, storable
from zoobench.db.silence import seconds_silent

LEASE_SECONDS = 60.0
SILENT_SECONDS = 10.0  # that the lease of a worker elsewhere is seen unchanged, in addition to being over by the clock
MAX_STRIKES = 30  # in a row without a new checkpoint, before a run is given up
CHILD_STRIKES = 10
"""For a child that died alone, which is likely to do so again. A worker is ended with its machine or by its user, and
takes the child along: one strike."""


def attempt_update(run_id: int, number: int) -> Update:
    """An UPDATE of one attempt, to be completed with `.values`."""
    return update(AttemptRecord).where(AttemptRecord.run_id == run_id, AttemptRecord.number == number)


def why_lost(run: RunRecord | RunRow) -> str | None:
    """The reason to take the worker of a RUNNING run for dead; None while it may live.

    A worker of this machine is seen. Of others the lease tells; as the clock of either machine may be set, its end
    counts only if the lease is not renewed under the eyes of this process either.
    """
    if run.owner is None or Owner.parse(run.owner).is_known_dead:
        return "Its worker died."
    if is_overdue(run) and seconds_silent(run.owner, run.lease_until) >= SILENT_SECONDS:
        return "Its worker has not been heard of for longer than its lease."
    return None


def is_overdue(run: RunRecord | RunRow) -> bool:
    """Whether the lease of a RUNNING run is over by the clock, and its worker not seen alive."""
    has_ended = run.lease_until is None or run.lease_until < time.time()
    return has_ended and not (run.owner and Owner.parse(run.owner).is_known_alive)


def last_heard_of(run: RunRecord) -> float:
    """When the worker of a RUNNING run last renewed its lease; its time of death, when it is found dead later."""
    now = time.time()
    return now if run.lease_until is None else min(run.lease_until - LEASE_SECONDS, now)


def close_attempt(
    session: Session,
    run_id: int,
    number: int,
    ending: Ending,
    *,
    ended_at: float | None = None,
    seconds: float | None = None,
) -> None:
    """Record the ending of an attempt and move its run on; the caller holds the write lock and the claim.

    `ended_at` is given for an attempt that ended before now. Its wall time in `seconds` [s] is known to its worker
    alone; else it is what that has stored last.
    """
    ending = replace(ending, reason=storable(ending.reason), traceback=storable(ending.traceback))
    now = time.time()
    end = now if ended_at is None else ended_at
    columns = {
        "outcome": ending.outcome,
        "ended_at": end,
        "wall_seconds": func.coalesce(AttemptRecord.wall_seconds, 0.0) if seconds is None else seconds,
        "exit_code": ending.exit_code,
        "signal": ending.signal,
        "reason": ending.reason,
        "traceback": ending.traceback,
        "peak_memory": ending.peak_memory,
    }
    statement = attempt_update(run_id, number).values(columns).returning(AttemptRecord.progressed)
    progressed = session.scalars(statement).one()
    run = session.get_one(RunRecord, run_id, populate_existing=True)
    run.owner = run.lease_until = None
    if ending.outcome is RunState.LOST and not progressed:
        run.strikes += CHILD_STRIKES if ending.died_alone else 1
    run.state, run.reason = _next_state(ending, run.strikes)
    run.finished_at = None if run.state == RunState.QUEUED else now
    if run.state == RunState.DONE:
        run.fraction = 1.0


def cancel_run(session: Session, run: RunRecord) -> None:
    """End a run that is queued or in progress, and its attempt; the caller holds the write lock."""
    reason = "Cancelled by `zoobench cancel`."
    if run.state == RunState.RUNNING:
        close_attempt(session, run.id, run.attempt, Ending(RunState.CANCELLED, reason))
    run.state, run.reason, run.finished_at = RunState.CANCELLED, reason, time.time()


def _next_state(ending: Ending, strikes: int) -> tuple[RunState, str | None]:
    if ending.outcome is RunState.CANCELLED:
        return RunState.QUEUED, ending.reason
    if ending.outcome is not RunState.LOST:
        return ending.outcome, ending.reason
    if strikes < MAX_STRIKES:
        return RunState.QUEUED, ending.reason
    return RunState.FAILED, f"Given up, as attempts were lost again and again without progress. {ending.reason}"
