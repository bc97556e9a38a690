"""Runs with their settings, and the outcomes of cells, read as tuples: there may be a hundred thousand of them."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from itertools import chain
from typing import Any

from sqlalchemy import ColumnElement, ScalarSelect, Select, and_, func, or_, select
from sqlalchemy.orm import Session, aliased

from zoobench.db.choice import Choice
from zoobench.db.many_rows import CellRun, PastRun, PastTotal
from zoobench.db.models import AttemptRecord, FinalRecord, RunRecord, SpecRecord
from zoobench.db.rows import RunRow, RunState
from zoobench.db.specs import CELL_COLUMNS, SpecReader, long_document, parsed
from zoobench.spec import RunSpec

_AT_ONCE = 2_000  # rows that are fetched at a time, so that memory stays small
_OWN = (
    "id", "attempt", "reason", "owner", "created_at", "started_at", "finished_at", "progress_at", "lease_until",
    "fraction", "score",
)  # fmt: skip
"""Columns of a run that `RunRow` has under the same names."""


def last_former_attempt() -> ScalarSelect[int]:
    """Number of the attempt that gave the outer statement's run a result before it was queued to be done again, or 0.

    Nothing up to that attempt has a share in the run's present result.
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


def fetch_runs(session: Session, chosen: Choice | None = None, *conditions: ColumnElement[bool]) -> Iterator[RunRow]:
    """The runs that are chosen and fulfil the conditions, by id; the session stays in use until the last."""
    chosen = chosen or Choice()
    statement = _runs().where(*chosen.conditions, *conditions)
    for cell, key, seed, (*own, state, former, seconds) in _read(session, statement):
        if chosen.holds(cell):
            yield RunRow(
                **dict(zip(_OWN, own, strict=True)),
                key=key,
                spec=replace(cell, seed=seed),
                state=RunState.stored(state),
                first_attempt=former + 1,
                seconds=seconds or 0.0,
            )


@cache
def _runs() -> Select[Any]:
    """The query for runs, by id. A launcher asks twice a second, and this takes longer to build than to answer."""
    own = tuple(getattr(RunRecord, name) for name in _OWN)
    columns = (*own, RunRecord.state, last_former_attempt(), _seconds())
    return _with_specs(columns).order_by(RunRecord.id)


def fetch_cells(session: Session, chosen: Choice, names: Sequence[str]) -> Iterator[CellRun]:
    """The runs that are chosen, each with these finals, by id; those of a cell share its settings."""
    finals = [aliased(FinalRecord) for _ in names]
    columns = (RunRecord.id, RunRecord.state, finals[0].unit, *(final.value for final in finals))
    statement = _with_specs(columns)
    for name, final in zip(names, finals, strict=True):
        statement = statement.outerjoin(final, _is_final(final, name))
    statement = statement.where(*chosen.conditions).order_by(RunRecord.id)
    states = {str(state): state for state in RunState}
    for cell, _, seed, (run_id, state, unit, *values) in _read(session, statement):
        if chosen.holds(cell):
            yield CellRun(cell, run_id, seed, states.get(state, RunState.FAILED), unit or "", values)


def fetch_past(session: Session, *conditions: ColumnElement[bool]) -> Iterator[PastRun]:
    """The runs that are DONE, fulfil the conditions and have taken time, by id."""
    forward, backward = aliased(FinalRecord), aliased(FinalRecord)
    statement = _past(_with_specs((_seconds(), forward.value, backward.value)), forward, backward)
    statement = statement.where(*conditions).order_by(RunRecord.id)
    for cell, _, _, (seconds, substeps, others) in _read(session, statement):
        if seconds:
            yield PastRun(cell, seconds, substeps or 0.0, others or 0.0)


def fetch_totals(session: Session) -> list[PastTotal]:
    """The total times of finished runs, by environment and fidelity, as far as their columns hold those whole."""
    forward, backward = aliased(FinalRecord), aliased(FinalRecord)
    columns = (
        SpecRecord.env,
        SpecRecord.fidelity,
        _seconds().label("seconds"),
        func.coalesce(forward.value, 0.0).label("forward"),
        func.coalesce(backward.value, 0.0).label("backward"),
    )
    runs = select(*columns).select_from(RunRecord).join(SpecRecord, SpecRecord.key == RunRecord.spec_key)
    one = _past(runs, forward, backward).subquery()
    statement = (
        select(one.c.env, one.c.fidelity, *map(func.sum, (one.c.seconds, one.c.forward, one.c.backward)))
        .where(one.c.seconds > 0.0, one.c.forward + one.c.backward > 0.0)
        .group_by(one.c.env, one.c.fidelity)
    )
    rows = ((parsed(env), parsed(fidelity), *sums) for env, fidelity, *sums in session.execute(statement))
    return [PastTotal(*row) for row in rows if row[0] is not None and row[1] is not None]


def _past(statement: Any, forward: Any, backward: Any) -> Any:
    """The statement on runs, with substeps, for those that are DONE."""
    return (
        statement.outerjoin(forward, _is_final(forward, "forward_substeps"))
        .outerjoin(backward, _is_final(backward, "backward_substeps"))
        .where(RunRecord.state == RunState.DONE)
    )


def _read(session: Session, statement: Select[Any]) -> Iterator[tuple[RunSpec, str, int, Sequence[Any]]]:
    """The rows of a statement by `_with_specs`: settings of the cell, key, seed, and the columns that were asked for.

    Rows are as the driver gives them: a session would put each together anew. One with damaged settings is left out.
    """

    def document(key: str) -> str:
        return session.scalars(select(SpecRecord.document).where(SpecRecord.key == key)).one()

    cell_of = SpecReader(document).cell
    count = 3 + len(CELL_COLUMNS)
    result = session.connection().execute(statement, execution_options={"yield_per": _AT_ONCE})
    for row in chain.from_iterable(result.partitions()):
        key, seed, long = row[:3]
        if (cell := cell_of(key, seed, row[3:count], long)) is not None:
            yield cell, key, seed, row[count:]


def _with_specs(columns: tuple[Any, ...]) -> Select[Any]:
    """A statement on runs and their settings: key, seed, a long document, the columns of the cell, then these."""
    spec = (SpecRecord.key, SpecRecord.seed, long_document(), *CELL_COLUMNS)
    return select(*spec, *columns).select_from(RunRecord).join(SpecRecord, SpecRecord.key == RunRecord.spec_key)


def _seconds() -> ScalarSelect[float | None]:
    """Wall time of the outer statement's run in all attempts that its present result comes from [s]."""
    attempt = aliased(AttemptRecord)
    total = select(func.sum(attempt.wall_seconds))
    return (
        total.where(attempt.run_id == RunRecord.id, attempt.number > last_former_attempt())
        .correlate(RunRecord)
        .scalar_subquery()
    )


def _is_final(final: Any, name: str) -> ColumnElement[bool]:
    """Only a run that is DONE has finals; one that is being done again keeps its former ones in the database."""
    return and_(final.run_id == RunRecord.id, final.name == name, RunRecord.state == RunState.DONE)
