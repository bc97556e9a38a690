"""One changed bit in what is stored is found: in settings when they are read, in results by their digest."""

from collections.abc import Iterator
from dataclasses import replace

import pytest
from sqlalchemy import text

from tests.harness.helpers import spec
from zoobench.db.lifecycle import MAX_STRIKES
from zoobench.db.owner import Owner
from zoobench.db.rows import Batch, Ending, FinalRow, MilestoneRow, RunState
from zoobench.db.store import Store
from zoobench.errors import StorageError

DONE = Ending(RunState.DONE, finals=(FinalRow("score", 1.5, "m/s"),), params=(0.25, 0.5), archive=b"many")


@pytest.fixture
def store(location: str) -> Iterator[Store]:
    """A store with a run that is done and one that has failed, and everything that a run may leave."""
    with Store(location) as store:
        store.enqueue([spec(0), spec(1)])
        for ending in (DONE, Ending(RunState.FAILED, "boom")):
            claim = store.claim(Owner.current(), provenance={"machine": "test"})
            assert claim is not None
            milestone = MilestoneRow(1, 0.5, (0.1, 0.2))
            store.commit(claim, Batch(metrics={("loss", 0): 1.0, ("loss", 1): 0.5}, milestones={1: milestone}))
            store.finish(claim, ending, Batch(metrics={("loss", 2): 0.25}))
        yield store


def _change(store: Store, statement: str) -> None:
    with store._database.write() as session:
        assert session.execute(text(statement)).rowcount  # type: ignore[attr-defined]


def test_what_is_intact_is_found_intact(store: Store) -> None:
    """However often one looks, and as well while a run is queued to be done again."""
    assert store.damage() == []
    store.retry([1], states=[RunState.DONE])
    assert store.damage() == []
    assert store.unsealed() == 0


@pytest.mark.parametrize(
    "change",
    [
        "UPDATE finals SET value = 1.5000000000000002",
        "UPDATE finals SET unit = 'm/r'",
        "UPDATE solutions SET params = archives.data FROM archives",
        "DELETE FROM archives",
        "UPDATE milestones SET score = 0.6 WHERE run_id = 1",
        "UPDATE metrics SET value = 0.26 WHERE step = 2 AND run_id = 1",
        "UPDATE metrics SET step = 3 WHERE step = 2 AND run_id = 1",
        "UPDATE runs SET state = 'failed' WHERE id = 1",
        "UPDATE attempts SET wall_seconds = 1000000.0 WHERE run_id = 1",
    ],
)
def test_a_changed_result_is_found(store: Store, change: str) -> None:
    """In a score, a unit, a solution, a curve or a state; the run that is intact is not accused."""
    _change(store, change)
    assert store.damage() == ["the results of run 1 have changed"]
    assert store.damage([2]) == []


def test_a_changed_curve_of_a_failed_run_is_found(store: Store) -> None:
    """Runs that ended without a result have a digest, too, and so have those given up after losses."""
    _change(store, "UPDATE metrics SET value = 0.26 WHERE step = 2 AND run_id = 2")
    assert store.damage() == ["the results of run 2 have changed"]
    store.enqueue([spec(2)])
    for _ in range(MAX_STRIKES):
        assert store.claim(replace(Owner.current(), start=1), provenance={}) is not None
        store.recover()
    _change(store, "UPDATE attempts SET started_at = 1.0 WHERE run_id = 3")
    assert store.damage([3]) == ["the results of run 3 have changed"]


def test_a_changed_provenance_is_found(store: Store) -> None:
    """Its hash is that of its document."""
    _change(store, """UPDATE provenance SET document = '{"machine":"tess"}'""")
    (complaint,) = store.damage()
    assert complaint.startswith("the provenance ")


def test_changed_settings_are_refused_in_words(store: Store) -> None:
    """Not believed, and no traceback: the key tells what they were. Where the columns agree with it, those count.

    Among others the run is left out.
    """
    _change(store, "UPDATE specs SET document = replace(document, 'caterpillar', 'caterpilmar') WHERE seed = 0")
    assert store.damage() == ["the settings of run 1 have changed"]
    assert store.runs()[0].spec == spec(0)
    _change(store, "UPDATE specs SET design = 'caterpilmar' WHERE seed = 0")
    assert [run.id for run in store.runs()] == [2]
    for read in (lambda: store.run("1"), lambda: store.stored(spec(0).key())):
        with pytest.raises(StorageError, match="are damaged: their sha256 is not its key"):
            read()


def test_the_queue_goes_on_behind_changed_settings(store: Store) -> None:
    """That run has failed, for this reason; the next is claimed."""
    store.enqueue([spec(2), spec(3)])
    _change(store, "UPDATE specs SET document = replace(document, '}', ')') WHERE seed = 2")
    claim = store.claim(Owner.current(), provenance={})
    assert claim is not None
    assert claim.spec == spec(3)
    assert [row.outcome for row in store.attempts(3)] == [RunState.FAILED]


def test_runs_of_an_earlier_zoobench_have_none(store: Store) -> None:
    """They are counted, and not taken for damaged."""
    _change(store, "UPDATE runs SET digest = NULL WHERE id = 1")
    assert store.damage() == []
    assert store.unsealed() == 1
