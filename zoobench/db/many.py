"""The questions about many runs at once. They are answered by few statements, on indexed columns, from tuples."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import fields
from typing import Any

from sqlalchemy import func, or_, select
from sqlalchemy.orm import Session

from zoobench.db.choice import choose, refuse_nothing
from zoobench.db.engine import Database, among, batched
from zoobench.db.many_rows import CellRun, OriginRow, PastRun, PastTotal
from zoobench.db.models import AttemptRecord, FinalRecord, MetricRecord, ProvenanceRecord, RunRecord, SpecRecord
from zoobench.db.rows import AttemptRow, FinalRow, MetricRow, RunRow, RunState, decode_value, document_of
from zoobench.db.runs import fetch_cells, fetch_past, fetch_runs, fetch_totals, last_former_attempt
from zoobench.db.specs import column_text
from zoobench.db.sweeps import narrowed
from zoobench.spec import RunSelection, RunSpec


class ManyReader:
    """The questions about many runs; `Reader` adds those about one."""

    _database: Database

    def runs(
        self,
        *,
        ids: Collection[int] | None = None,
        states: Collection[RunState] | None = None,
        keys: Collection[str] | None = None,
        sweep: int | None = None,
    ) -> list[RunRow]:
        """The runs in the order of their creation; each argument narrows the choice, None does not."""
        conditions = narrowed(ids, sweep)
        if states is not None:
            conditions.append(RunRecord.state.in_([str(state) for state in states]))
        with self._database.read() as session:
            if keys is None:
                return list(fetch_runs(session, None, *conditions))
            parts = (RunRecord.spec_key.in_(some) for some in batched(keys))
            found = [run for part in parts for run in fetch_runs(session, None, *conditions, part)]
            return sorted(found, key=lambda run: run.id)

    def selected(
        self, selection: RunSelection, names: Collection[str] | None = None
    ) -> Iterator[tuple[RunRow, list[FinalRow]]]:
        """The selected runs in the order of their creation, with their final results, of these names if any are given;
        read as they are asked for.

        Raises:
            UsageError: a selector fits no run, as `RunSelection.among`.
        """
        with self._database.read() as session:
            is_empty = True
            for some in batched(fetch_runs(session, choose(session, selection))):
                is_empty = False
                finals = _finals_of(self._database, session, [run.id for run in some], names)
                yield from ((run, finals.get(run.id, [])) for run in some)
            if is_empty:
                refuse_nothing(session, selection)

    def final_names(self, selection: RunSelection) -> list[tuple[str, str]]:
        """Names and units of the final results that selected runs have, sorted; raises as `selected`."""
        with self._database.read() as session:
            conditions = choose(session, selection).conditions
            statement = (
                select(FinalRecord.name, FinalRecord.unit)
                .distinct()
                .join(RunRecord, RunRecord.id == FinalRecord.run_id)
                .where(RunRecord.state == RunState.DONE)
            )
            if conditions:
                statement = statement.join(SpecRecord, SpecRecord.key == RunRecord.spec_key).where(*conditions)
            return sorted((name, unit) for name, unit in session.execute(statement))

    def cells(self, selection: RunSelection, names: Sequence[str]) -> Iterator[CellRun]:
        """The selected runs in the order of their creation, each with these finals and nothing else; as `selected`."""
        with self._database.read() as session:
            found = fetch_cells(session, choose(session, selection), names)
            first = next(found, None)
            if first is None:
                refuse_nothing(session, selection)
                return
            yield first
            yield from found

    def states(self, keys: Collection[str]) -> dict[str, RunState]:
        """The states of the runs with these keys, by key; those that do not exist are absent."""
        found: dict[str, RunState] = {}
        with self._database.read() as session:
            for some in batched(keys):
                statement = select(RunRecord.spec_key, RunRecord.state).where(RunRecord.spec_key.in_(some))
                found.update((key, RunState.stored(state)) for key, state in session.execute(statement))
        return found

    def past(self, specs: Iterable[RunSpec]) -> list[PastRun]:
        """The finished runs in the places of these: with the same environment, design and fidelity as one of them."""
        axes = ("env", "design", "fidelity")
        places = {tuple(getattr(spec, axis) for axis in axes) for spec in specs}
        texts = ({column_text(place[number]) for place in places} for number in range(len(axes)))
        conditions = [getattr(SpecRecord, axis).in_(sorted(some)) for axis, some in zip(axes, texts, strict=True)]
        with self._database.read() as session:
            found = fetch_past(session, *conditions) if places else ()
            return [run for run in found if tuple(getattr(run.spec, axis) for axis in axes) in places]

    def totals(self) -> list[PastTotal]:
        """The total times of all finished runs, by environment and fidelity."""
        with self._database.read() as session:
            return fetch_totals(session)

    def all_finals(self, ids: Collection[int]) -> dict[int, list[FinalRow]]:
        """The final results of many runs at once, by run id. Only those that are DONE have any.

        A run that is being done again keeps its former ones in the database, but they are no result of any run.
        """
        with self._database.read() as session:
            return {
                run_id: rows
                for some in batched(ids)
                for run_id, rows in _finals_of(self._database, session, some).items()
            }

    def all_metrics(self, ids: Collection[int], names: Collection[str] | None) -> dict[int, list[MetricRow]]:
        """These learning curves of many runs at once, all for None, by run id; otherwise as `metrics`."""
        table = MetricRecord  # its columns and not objects of it, of which there may be a million
        statement = (
            select(table.run_id, table.name, table.step, table.value, table.kind, table.attempt)
            .join(RunRecord, RunRecord.id == table.run_id)
            .where(table.attempt > last_former_attempt())
            .order_by(table.run_id, self._database.alphabetical(table.name), table.step)
        )
        if names is not None:
            statement = statement.where(table.name.in_(list(names)))
        found: dict[int, list[MetricRow]] = {}
        with self._database.read() as session:
            for some in batched(ids):
                for run_id, name, step, value, kind, attempt in session.execute(
                    statement.where(among(table.run_id, some))
                ):
                    found.setdefault(run_id, []).append(MetricRow(name, step, decode_value(value, kind), attempt))
        return found

    def all_attempts(self, ids: Collection[int]) -> dict[int, list[AttemptRow]]:
        """All attempts at many runs, by run id, oldest first; those of one origin share its provenance."""
        statement = (
            select(AttemptRecord, ProvenanceRecord.document)
            .join(ProvenanceRecord, ProvenanceRecord.hash == AttemptRecord.provenance_hash)
            .order_by(AttemptRecord.run_id, AttemptRecord.number)
        )
        known: dict[str, Mapping[str, Any]] = {}
        found: dict[int, list[AttemptRow]] = {}
        with self._database.read() as session:
            for some in batched(ids):
                for record, document in session.execute(statement.where(among(AttemptRecord.run_id, some))):
                    if document not in known:
                        known[document] = document_of(document)
                    found.setdefault(record.run_id, []).append(_attempt_row(record, known[document]))
        return found

    def origins(self, ids: Collection[int]) -> list[OriginRow]:
        """Where the results of these runs come from, those that are DONE: one for each provenance.

        All attempts count that carried a run forward. What one gave before the run was done again is nobody's result.
        """
        statement = (
            select(
                AttemptRecord.provenance_hash,
                func.min(AttemptRecord.started_at),
                func.max(func.coalesce(AttemptRecord.ended_at, AttemptRecord.started_at)),
            )
            .join(RunRecord, RunRecord.id == AttemptRecord.run_id)
            .where(
                RunRecord.state == RunState.DONE,
                AttemptRecord.number > last_former_attempt(),
                or_(AttemptRecord.progressed, AttemptRecord.outcome == RunState.DONE),
            )
            .group_by(AttemptRecord.provenance_hash)
        )
        times: dict[str, tuple[float, float]] = {}
        with self._database.read() as session:
            for some in batched(ids):
                for key, begin, end in session.execute(statement.where(among(RunRecord.id, some))):
                    first, last = times.get(key, (begin, end))
                    times[key] = (min(first, begin), max(last, end))
            documents = {key: session.get_one(ProvenanceRecord, key).document for key in sorted(times)}
        return [OriginRow(*times[key], document_of(document)) for key, document in documents.items()]


def _finals_of(
    database: Database, session: Session, ids: Collection[int], names: Collection[str] | None = None
) -> dict[int, list[FinalRow]]:
    """The final results of these runs by run id and name."""
    table = FinalRecord
    statement = (
        select(table.run_id, table.name, table.value, table.kind, table.unit)
        .join(RunRecord, RunRecord.id == table.run_id)
        .where(RunRecord.state == RunState.DONE, among(table.run_id, ids))
        .order_by(table.run_id, database.alphabetical(table.name))
    )
    if names is not None:
        statement = statement.where(table.name.in_(list(names)))
    finals: dict[int, list[FinalRow]] = {}
    for run_id, name, value, kind, unit in session.execute(statement):
        finals.setdefault(run_id, []).append(FinalRow(name, decode_value(value, kind), unit))
    return finals


def _attempt_row(record: AttemptRecord, provenance: Mapping[str, Any]) -> AttemptRow:
    computed: dict[str, Any] = {"outcome": RunState.stored(record.outcome), "provenance": provenance}
    same = {each.name: getattr(record, each.name) for each in fields(AttemptRow) if each.name not in computed}
    return AttemptRow(**same, **computed)
