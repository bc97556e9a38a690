"""Digests that tell damage: of the settings of a run, which is its key, and of all that is stored of its result.

A disk, a copy or another program may change a bit, and no database notices it within a number or a text.
"""

import hashlib
import json
from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Sequence
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import InstrumentedAttribute, Session

from zoobench.db.engine import among, batched
from zoobench.db.models import (
    ArchiveRecord,
    AttemptRecord,
    FinalRecord,
    MetricRecord,
    MilestoneRecord,
    ProvenanceRecord,
    RunRecord,
    SolutionRecord,
    SpecRecord,
)

_RUNS_AT_ONCE = 200
DIGESTED: dict[str, tuple[InstrumentedAttribute[Any], ...]] = {
    "run": (RunRecord.id, RunRecord.spec_key, RunRecord.state, RunRecord.score, RunRecord.reason),
    "attempts": (
        AttemptRecord.run_id,
        AttemptRecord.number,
        AttemptRecord.outcome,
        AttemptRecord.started_at,
        AttemptRecord.wall_seconds,
        AttemptRecord.provenance_hash,
    ),
    "finals": (FinalRecord.run_id, FinalRecord.name, FinalRecord.value, FinalRecord.kind, FinalRecord.unit),
    "solution": (SolutionRecord.run_id, SolutionRecord.params),
    "archive": (ArchiveRecord.run_id, ArchiveRecord.data),
    "milestones": (MilestoneRecord.run_id, MilestoneRecord.step, MilestoneRecord.score, MilestoneRecord.params),
    "metrics": (MetricRecord.run_id, MetricRecord.name, MetricRecord.step, MetricRecord.value, MetricRecord.kind),
}
"""The columns that a run's digest covers, the first of them its id."""


def seal(session: Session, run_id: int) -> None:
    """Store the digest of a run that has ended, within the transaction that ends it."""
    session.flush()
    session.get_one(RunRecord, run_id).digest = digests(session, [run_id])[run_id]


def digests(session: Session, ids: Collection[int]) -> dict[int, str]:
    """The digests of runs, by id, of the data that is stored of them now."""
    found: dict[int, dict[str, list[Any]]] = {run_id: defaultdict(list) for run_id in ids}
    for name, (run_id, *columns) in DIGESTED.items():
        for number, *row in session.execute(select(run_id, *columns).where(among(run_id, ids))):
            found[number][name].append([_plain(value) for value in row])
    for contents in found.values():
        for rows in contents.values():
            rows.sort(key=_text)  # each database has an order of its own
    return {run_id: _sha256(_text(contents).encode()) for run_id, contents in found.items()}


def damage(session: Session, ids: Collection[int] | None = None) -> Iterator[str]:
    """Data that does not agree with its digest, as sentences: settings and results of these runs, of all for None.

    Runs that an earlier zoobench ended have no digest, and only their settings are checked.
    """
    chosen = () if ids is None else (among(RunRecord.id, ids),)
    runs = session.execute(select(RunRecord.id, RunRecord.digest).where(*chosen).order_by(RunRecord.id)).all()
    for some in batched(runs, _RUNS_AT_ONCE):
        yield from _damaged_runs(session, some)
    if ids is None:
        yield from _damaged_documents(session)


def unsealed(session: Session) -> int:
    """Number of ended runs without a digest."""
    statement = select(func.count()).where(RunRecord.digest.is_(None), RunRecord.finished_at.is_not(None))
    return session.scalar(statement) or 0


def _damaged_runs(session: Session, runs: Sequence[Any]) -> Iterator[str]:
    numbers = [run_id for run_id, _ in runs]
    documents = (
        select(RunRecord.id, SpecRecord.key, SpecRecord.document)
        .join(SpecRecord, SpecRecord.key == RunRecord.spec_key)
        .where(among(RunRecord.id, numbers))
    )
    for run_id, key, document in session.execute(documents):
        if _sha256(document.encode(errors="replace")) != key:
            yield f"the settings of run {run_id} have changed"
    yield from (f"the results of run {run_id} have changed" for run_id in _changed(session, runs))


def changed_results(session: Session) -> list[int]:
    """The runs whose results are not as they were stored, by id."""
    runs = session.execute(select(RunRecord.id, RunRecord.digest).order_by(RunRecord.id)).all()
    return [run_id for some in batched(runs, _RUNS_AT_ONCE) for run_id in _changed(session, some)]


def _changed(session: Session, runs: Sequence[Any]) -> list[int]:
    """Those of these runs, given with their digests, whose results have another now."""
    known = {run_id: digest for run_id, digest in runs if digest is not None}
    now = digests(session, known) if known else {}
    return [run_id for run_id in known if now[run_id] != known[run_id]]


def _damaged_documents(session: Session) -> Iterable[str]:
    for key, document in session.execute(select(ProvenanceRecord.hash, ProvenanceRecord.document)):
        if _sha256(document.encode(errors="replace")) != key:
            yield f"the provenance {key[:12]} has changed"


def _text(value: Any) -> str:
    """The text of a value, whatever damage has made of it."""
    return json.dumps(value, sort_keys=True)


def _plain(value: Any) -> Any:
    return _sha256(value) if isinstance(value, bytes) else value


def _sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
