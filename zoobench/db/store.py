"""The only module that writes: the queue of runs, their attempts, and their results.

A worker owns a run by its claim: owner and attempt number are checked in every write (the fencing token), so
that a worker that was given up for dead cannot touch runs that another has taken over.
"""

import time
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from typing import Any

from sqlalchemy import Update, case, delete, insert, select, update
from sqlalchemy.orm import Session

from zoobench.db.digests import changed_results, seal
from zoobench.db.engine import among, batched
from zoobench.db.lifecycle import (
    LEASE_SECONDS,
    attempt_update,
    cancel_run,
    close_attempt,
    is_overdue,
    last_heard_of,
    why_lost,
)
from zoobench.db.mending import mend_settings
from zoobench.db.merge import MergeReport, merge
from zoobench.db.models import (
    ArchiveRecord,
    AttemptRecord,
    Base,
    CheckpointRecord,
    FinalRecord,
    LogRecord,
    MetricRecord,
    MilestoneRecord,
    RunRecord,
    SolutionRecord,
    SpecRecord,
)
from zoobench.db.owner import Owner
from zoobench.db.query import Reader, load_all_stored
from zoobench.db.removal import remove_runs
from zoobench.db.rows import (
    OPEN_STATES,
    UNSUCCESSFUL_STATES,
    Batch,
    Claim,
    Ending,
    EnqueueReport,
    RunState,
    SharedScore,
    StudyRow,
    encode_params,
    encode_value,
    storable,
)
from zoobench.db.shared_scores import ask_for, keep
from zoobench.db.specs import spec_columns, spec_from
from zoobench.db.studies import carry_out, keep_provenance
from zoobench.db.sweeps import Watch, begin_sweep, narrowed
from zoobench.errors import StorageError
from zoobench.spec import RunSpec


class ClaimLostError(StorageError):
    """Another worker holds the run now, or it has ended: the caller must drop its work."""


class Store(Reader):
    """A database of runs; `location` is a path to an SQLite file (made if missing) or a URL.

    Safe to open from any number of processes. Every method raises StorageError, or StorageFullError when the
    disk is full: then nothing of that call is stored, and everything of the earlier ones is.
    """

    def enqueue(self, specs: Iterable[RunSpec], *, skips: Iterable[tuple[RunSpec, str]] = ()) -> EnqueueReport:
        """Queue the specs that the database does not have; `skips` are recorded with their reason.

        A run that was skipped and can be run now is queued. Runs in any other state are left as they are. They are
        stored some at a time, so that others may write in between; after an interruption the same call adds the rest.
        """
        asked: dict[str, tuple[RunSpec, str | None]] = {spec.key(): (spec, None) for spec in specs}
        for spec, reason in skips:
            asked.setdefault(spec.key(), (spec, reason))
        groups: dict[str, list[int]] = {name: [] for name in EnqueueReport.__dataclass_fields__}
        for keys in batched(asked):
            prepared = {key: (spec_columns(key, spec), why) for key in keys for spec, why in [asked[key]]}
            with self._database.write(alone=True) as session:
                for group, run_id in _enqueue(session, prepared):
                    groups[group].append(run_id)
        return EnqueueReport(**{name: tuple(ids) for name, ids in groups.items()})

    def begin_sweep(self, ids: Collection[int]) -> int:
        """Store that a launcher was asked to have these runs done; the id of the sweep that they are."""
        return begin_sweep(self._database, ids)

    def watch(self, sweep: int) -> Watch:
        """The runs of a sweep, to be looked at again and again."""
        return Watch(self._database, sweep)

    def retry(self, ids: Collection[int], *, states: Collection[RunState] = UNSUCCESSFUL_STATES) -> list[int]:
        """Queue runs again that ended in one of these states, and return their ids.

        They go on from their newest checkpoint; records of their earlier attempts stay. A run that was done has
        none and starts anew.
        """
        anew = RunRecord.state == RunState.DONE
        statement = (
            update(RunRecord)
            .where(RunRecord.state.in_([str(state) for state in states]))
            .values(
                state=RunState.QUEUED,
                reason=None,
                finished_at=None,
                digest=None,
                strikes=0,
                fraction=case((anew, 0.0), else_=RunRecord.fraction),
                score=case((anew, None), else_=RunRecord.score),
            )
            .returning(RunRecord.id)
        )
        again: list[int] = []
        for some in batched(ids):
            with self._database.write(alone=True) as session:
                again += session.scalars(statement.where(among(RunRecord.id, some)))
        return sorted(again)

    def prioritise(self, ids: Collection[int], priority: int) -> None:
        """Give those of these runs that are queued a priority, by which they are taken; 0 is the usual one."""
        queued = RunRecord.state == RunState.QUEUED
        for some in batched(ids):
            with self._database.write(alone=True) as session:
                session.execute(update(RunRecord).where(among(RunRecord.id, some), queued).values(rank=-priority))

    def cancel(self, ids: Collection[int]) -> list[int]:
        """End those of these runs that have not ended, as CANCELLED; their ids.

        Whoever works on one loses its claim. Its results are kept, and `retry` lets it go on from there.
        """
        cancelled = []
        is_open = RunRecord.state.in_(OPEN_STATES)
        for some in batched(ids):
            with self._database.write(alone=True) as session:
                runs = select(RunRecord).where(among(RunRecord.id, some), is_open).order_by(RunRecord.id)
                for run in session.scalars(runs.with_for_update()).all():
                    cancel_run(session, run)
                    seal(session, run.id)
                    cancelled.append(run.id)
        return cancelled

    def remove(self, ids: Collection[int]) -> None:
        """Remove these runs with all that is stored of them, and measurements with their solutions.

        Raises:
            UsageError: one of them is in progress.
        """
        with self._database.write(alone=True) as session:
            remove_runs(session, ids)

    def merge(self, other: Reader) -> MergeReport:
        """Add the runs of another database, by their keys; see `zoobench.db.merge`."""
        return merge(self._database, other._database)

    def mend(self) -> list[str]:
        """Repair the damage that can be repaired, and describe it in sentences; empty if there was none.

        A run whose results have changed is queued again, as its settings decide them.
        """
        said = mend_settings(self._database)
        with self._database.read() as session:
            changed = changed_results(session)
        again = self.retry(changed, states=[state for state in RunState if state not in OPEN_STATES])
        return said + [f"run {run_id} is queued again: its results had changed" for run_id in again]

    def claim(
        self,
        owner: Owner,
        *,
        provenance: Mapping[str, Any],
        plugins: Callable[[RunSpec], Mapping[str, Any]] | None = None,
        ids: Collection[int] | None = None,
        sweep: int | None = None,
    ) -> Claim | None:
        """Take the next queued run, among `ids` or of a sweep if given, and open an attempt; None without any.

        It is the oldest of those of the highest priority. What `plugins` tells of its settings, if anything, is stored
        with the provenance.
        """
        following = (
            select(RunRecord.id)
            .where(RunRecord.state == RunState.QUEUED, *narrowed(ids, sweep))
            .order_by(RunRecord.rank, RunRecord.id)
            .limit(1)
        )
        statement = (
            update(RunRecord)
            .where(RunRecord.id == following.with_for_update(skip_locked=True).scalar_subquery())
            .values(state=RunState.RUNNING, owner=str(owner), attempt=RunRecord.attempt + 1, reason=None)
            .returning(RunRecord)
        )
        with self._database.write() as session:
            while (run := session.scalars(statement).one_or_none()) is not None:
                now = time.time()  # the lock may have been waited for
                run.lease_until, run.started_at = now + LEASE_SECONDS, run.started_at or now
                checkpoint = session.get(CheckpointRecord, run.id)
                origin = dict(provenance)
                refusal = ""
                try:
                    spec = spec_from(run.spec_key, session.get_one(SpecRecord, run.spec_key).document)
                    stored = load_all_stored(session, spec)
                    origin |= {"plugins": found} if plugins and (found := plugins(spec)) else {}
                except StorageError as error:  # nobody can do it, and the queue goes on
                    refusal = str(error)
                session.add(
                    AttemptRecord(
                        run_id=run.id,
                        number=run.attempt,
                        outcome=RunState.RUNNING,
                        owner=str(owner),
                        host=owner.host,
                        provenance_hash=keep_provenance(self._database, session, origin),
                        started_at=now,
                        resumed=checkpoint is not None,
                    )
                )
                if refusal:
                    close_attempt(session, run.id, run.attempt, Ending(RunState.FAILED, refusal))
                    seal(session, run.id)
                    continue
                data = checkpoint.data if checkpoint else None
                return Claim(run.id, spec, str(owner), run.attempt, data, stored, time.monotonic())
        return None

    def commit(self, claim: Claim, batch: Batch) -> None:
        """Store the messages of the child and renew the lease, in one transaction.

        Raises:
            ClaimLostError: the claim is not valid any more; nothing is stored.
        """
        with self._database.write() as session:
            self._hold(session, claim, lease_until=time.time() + LEASE_SECONDS)
            seconds = time.monotonic() - claim.since
            session.execute(attempt_update(claim.run_id, claim.attempt).values(wall_seconds=seconds))
            self._write_batch(session, claim, batch)

    def finish(self, claim: Claim, ending: Ending, batch: Batch) -> None:
        """Close the attempt: end the run, or queue it again if it was lost or interrupted.

        The batch, the finals, solution and archive of a DONE run, and the new state are one transaction.

        Raises:
            ClaimLostError: the claim is not valid any more; nothing is stored.
        """
        with self._database.write() as session:
            self._hold(session, claim)
            self._write_batch(session, claim, batch)
            seconds = time.monotonic() - claim.since
            close_attempt(session, claim.run_id, claim.attempt, ending, seconds=seconds)
            if ending.outcome is RunState.DONE:  # a run that is done again replaces its earlier result
                for table in (FinalRecord, SolutionRecord, ArchiveRecord, CheckpointRecord):
                    session.execute(delete(table).where(table.run_id == claim.run_id))
            for final in ending.finals:
                value, kind = encode_value(final.value)
                session.add(FinalRecord(run_id=claim.run_id, name=final.name, value=value, kind=kind, unit=final.unit))
            if ending.params is not None:
                session.add(SolutionRecord(run_id=claim.run_id, params=encode_params(ending.params)))
            if ending.archive is not None:
                session.add(ArchiveRecord(run_id=claim.run_id, data=ending.archive))
            if ending.outcome not in (RunState.LOST, RunState.CANCELLED):
                seal(session, claim.run_id)

    def recover(self, *, ids: Collection[int] | None = None, sweep: int | None = None) -> list[int]:
        """Take back the runs of workers that died: at once on this host, elsewhere by leases that are not renewed.

        Their attempts are recorded as LOST and the runs queued again, or FAILED after too many losses without
        progress. Returns the ids of these runs.
        """
        statement = select(RunRecord).where(RunRecord.state == RunState.RUNNING, *narrowed(ids, sweep))
        with self._database.read() as session:
            suspects = [run.id for run in session.scalars(statement) if why_lost(run)]
        if not suspects:
            return []
        with self._database.write(alone=True) as session:
            runs = list(session.scalars(statement.where(among(RunRecord.id, suspects)).with_for_update()))
            lost = [(run, reason) for run in runs if (reason := why_lost(run))]
            for run, reason in lost:
                ending = Ending(RunState.LOST, reason)
                close_attempt(session, run.id, run.attempt, ending, ended_at=last_heard_of(run))
                if run.state == RunState.FAILED:
                    seal(session, run.id)
            return [run.id for run, _ in lost]

    def has_overdue(self, sweep: int | None = None) -> bool:
        """Whether a run, of a sweep if given, may soon be found lost: its lease is over, and its worker not seen."""
        statement = select(RunRecord).where(RunRecord.state == RunState.RUNNING, *narrowed(None, sweep))
        with self._database.read() as session:
            return any(map(is_overdue, session.scalars(statement)))

    def reference(self, claim: Claim, key: str) -> SharedScore:
        """A reference score that runs share; where it is still to be computed, whether it is this run's turn."""
        return ask_for(self._database, claim, key)

    def keep_reference(self, claim: Claim, key: str, value: float, unit: str) -> None:
        """Store a reference score for all runs that share it."""
        keep(self._database, claim, key, value, unit)

    def save_study(self, name: str, rows: Iterable[StudyRow], *, provenance: Mapping[str, Any]) -> Iterator[StudyRow]:
        """Carry out a study: every row is stored as soon as it comes, and then handed on.

        The study is finished with the last row. If it is interrupted before, the rows done so far are kept.
        """
        return carry_out(self._database, name, rows, provenance)

    def _hold(self, session: Session, claim: Claim, **values: Any) -> None:
        """Check the fencing token and write these columns of the run, in one statement."""
        statement: Update = update(RunRecord).where(
            RunRecord.id == claim.run_id,
            RunRecord.state == RunState.RUNNING,
            RunRecord.owner == claim.owner,
            RunRecord.attempt == claim.attempt,
        )
        values = values or {"owner": claim.owner}
        if session.execute(statement.values(values).returning(RunRecord.id)).first() is None:
            raise ClaimLostError(f"Run {claim.run_id} is not held by attempt {claim.attempt} any more.")

    def _write_batch(self, session: Session, claim: Claim, batch: Batch) -> None:
        if batch.is_empty:
            return
        now = time.time()
        progress: dict[str, Any] = {"progress_at": now}
        if batch.fraction is not None:
            progress.update(fraction=batch.fraction, score=batch.score)
        run, attempt = {"run_id": claim.run_id}, {"attempt": claim.attempt}
        metrics = []
        for (name, step), number in batch.metrics.items():
            value, kind = encode_value(number)
            metrics.append({**run, "name": name, "step": step, **attempt, "value": value, "kind": kind})
        self._upsert(session, MetricRecord, ("run_id", "name", "step"), metrics)
        milestones = [
            {**run, "step": row.step, **attempt, "score": row.score, "params": encode_params(row.params)}
            for row in batch.milestones.values()
        ]
        self._upsert(session, MilestoneRecord, ("run_id", "step"), milestones)
        for at, text in batch.logs:
            session.add(LogRecord(run_id=claim.run_id, attempt=claim.attempt, at=at, text=storable(text)))
        if batch.checkpoint is not None:
            saved = {**run, **attempt, "saved_at": now, "data": batch.checkpoint}
            self._upsert(session, CheckpointRecord, ("run_id",), [saved])
            session.execute(attempt_update(claim.run_id, claim.attempt).values(progressed=True))
            progress["strikes"] = 0
        session.execute(update(RunRecord).where(RunRecord.id == claim.run_id).values(progress))

    def _upsert(self, session: Session, table: type[Base], key: tuple[str, ...], rows: list[dict[str, Any]]) -> None:
        """Write rows of the same columns, in one statement; a row with the same key is replaced."""
        if not rows:
            return
        insert = self._database.insert(table)
        changed = {name: insert.excluded[name] for name in rows[0].keys() - set(key)}
        session.execute(insert.on_conflict_do_update(index_elements=key, set_=changed), rows)


def _enqueue(session: Session, prepared: Mapping[str, tuple[dict[str, Any], str | None]]) -> Iterator[tuple[str, int]]:
    """Store the new ones of these specs, given as columns and a reason to skip them; group and id of every run."""
    table = RunRecord
    statement = select(table.spec_key, table.id, table.state).where(table.spec_key.in_(prepared))
    known = {key: (run_id, RunState.stored(state)) for key, run_id, state in session.execute(statement)}
    new = [key for key in prepared if key not in known]
    if new:
        session.execute(insert(SpecRecord), [prepared[key][0] for key in new])
        session.execute(insert(table), [_new_run(key, prepared[key][1]) for key in new])
        added = {key: (run_id, RunState.stored(state)) for key, run_id, state in session.execute(statement)}
    for key, (_, why) in prepared.items():
        run_id, state = known.get(key) or added[key]
        is_revived = state is RunState.SKIPPED and why is None
        if is_revived:
            session.execute(update(table).where(table.id == run_id).values(state=RunState.QUEUED, reason=None))
            state = RunState.QUEUED
        yield _group(state, key not in known or is_revived), run_id


def _new_run(key: str, reason: str | None) -> dict[str, Any]:
    """A run to queue, or one that is skipped for a reason."""
    state = RunState.QUEUED if reason is None else RunState.SKIPPED
    return {"spec_key": key, "state": state, "reason": storable(reason), "created_at": time.time()}


def _group(state: RunState, is_new: bool) -> str:
    """The field of `EnqueueReport` that a run belongs to."""
    if state is RunState.SKIPPED:
        return "skipped"
    if is_new:
        return "new"
    if state is RunState.DONE:
        return "existing_done"
    return "existing_open" if state in OPEN_STATES else "existing_failed"
