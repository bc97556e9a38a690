"""Sweeps: what a launcher sees of its runs, and which of them its workers take."""

from collections.abc import Iterator

import pytest
from sqlalchemy import update

from tests.harness.helpers import spec
from zoobench.db import sweeps
from zoobench.db.models import RunRecord
from zoobench.db.owner import Owner
from zoobench.db.rows import Batch, Ending, RunState
from zoobench.db.store import Store

ME = Owner.current()
DONE = Ending(RunState.DONE)


@pytest.fixture
def store(location: str) -> Iterator[Store]:
    """A store with five queued runs."""
    with Store(location) as store:
        store.enqueue(spec(seed) for seed in range(5))
        yield store


def test_workers_take_the_runs_of_their_sweep_alone(store: Store) -> None:
    """In the order of their ids; a run may be in several sweeps, and is done once."""
    first, second = store.begin_sweep([4, 2]), store.begin_sweep([2, 3])
    claims = [store.claim(ME, provenance={}, sweep=sweep) for sweep in (first, first, first, second, second)]
    assert [claim and claim.run_id for claim in claims] == [2, 4, None, 3, None]
    assert [run.id for run in store.runs(sweep=second)] == [2, 3]


def test_a_look_tells_what_has_changed(store: Store) -> None:
    """All runs at first, then those in progress and those that have begun, ended or been queued again."""
    watch = store.watch(store.begin_sweep([1, 2, 3]))
    assert [run.id for run in watch.look()] == [1, 2, 3]
    assert watch.look() == []
    first, second = (store.claim(ME, provenance={}) for _ in range(2))
    assert first is not None
    assert second is not None
    for _ in range(2):
        assert [(run.id, run.state) for run in watch.look()] == [(1, RunState.RUNNING), (2, RunState.RUNNING)]
    store.finish(first, DONE, Batch())
    store.finish(second, Ending(RunState.CANCELLED), Batch())
    assert [(run.id, run.state) for run in watch.look()] == [(1, RunState.DONE), (2, RunState.QUEUED)]
    assert watch.open == 2
    assert watch.look() == []


def test_a_run_that_begins_and_ends_between_two_looks_is_told(store: Store) -> None:
    """Though it was never seen in progress."""
    watch = store.watch(store.begin_sweep([1, 2]))
    watch.look()
    claim = store.claim(ME, provenance={})
    assert claim is not None
    store.finish(claim, DONE, Batch())
    assert [run.id for run in watch.look()] == [1]
    assert watch.open == 1


def test_a_run_that_ended_by_a_wrong_clock_is_told_by_the_next_full_look(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A machine whose clock is an hour behind dates the end of its run before the last look."""
    watch = store.watch(store.begin_sweep([1, 2]))
    watch.look()
    claim = store.claim(ME, provenance={})
    assert claim is not None
    store.finish(claim, DONE, Batch())
    with store._database.write() as session:
        session.execute(update(RunRecord).where(RunRecord.id == 1).values(finished_at=RunRecord.finished_at - 3600.0))
    assert watch.look() == []
    monkeypatch.setattr(sweeps, "_FULL_SECONDS", 0.0)
    assert [run.id for run in watch.look()] == [1]


def test_others_may_write_while_many_runs_are_queued(location: str) -> None:
    """The database is not locked from the first to the last."""
    with Store(location) as store, Store(location) as other:
        asked, seen = [], []

        def told() -> Iterator[None]:
            real = store._database.write

            def write(**options: bool) -> object:
                asked.append(other.enqueue([spec(10_000 + len(asked))]).new)
                seen.append(len(store.runs()))
                return real(**options)

            store._database.write = write  # type: ignore[method-assign, assignment]
            yield
            store._database.write = real  # type: ignore[method-assign]

        steps = told()
        next(steps)
        report = store.enqueue(spec(seed) for seed in range(2_500))
        next(steps, None)
        assert len(report.new) == 2_500
        assert len(asked) == 3
        assert seen[0] < seen[1] < seen[2], "what is queued is there before the rest is"
        assert store.enqueue(spec(seed) for seed in range(2_500)).existing_open == report.new
