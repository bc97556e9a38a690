"""One damaged run never takes the others along: in reading, merging and removing; and what can be mended is."""

import hashlib
import json
import logging
import sqlite3
from collections.abc import Iterator
from pathlib import Path

import pytest
from sqlalchemy import text

from tests.harness.helpers import spec
from tests.report.content import claim_new
from zoobench.db import specs
from zoobench.db.owner import Owner
from zoobench.db.rows import Batch, Ending, FinalRow, RunState
from zoobench.db.store import Store
from zoobench.errors import StorageError
from zoobench.spec import RunSelection

DONE = Ending(RunState.DONE, finals=(FinalRow("score", 1.5, "m/s"),), params=(0.25, 0.5))
KEY = spec(1).key()


@pytest.fixture(autouse=True)
def _untold(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing was said about a damaged run yet."""
    monkeypatch.setattr(specs, "_told", set())


@pytest.fixture
def store(location: str) -> Iterator[Store]:
    """A store with three runs that are done."""
    with Store(location) as store:
        for seed in range(3):
            store.finish(claim_new(store, spec(seed)), DONE, Batch())
        yield store


def _change(store: Store, statement: str) -> None:
    with store._database.write() as session:
        session.execute(text(statement.replace(":", r"\:")))


def _damage(store: Store) -> None:
    """Of the second run neither the document nor the columns are what they were."""
    _change(store, f"UPDATE specs SET document = 'x' || document, env = 'sea-v1' WHERE key = '{KEY}'")


def test_others_are_read_beside_a_damaged_run(store: Store, caplog: pytest.LogCaptureFixture) -> None:
    """It is left out of every listing, with a word, once."""
    _damage(store)
    with caplog.at_level(logging.WARNING):
        assert [run.id for run in store.runs()] == [1, 3]
        assert [run.id for run, _ in store.selected(RunSelection())] == [1, 3]
        assert [run.id for run in store.cells(RunSelection(), ["score"])] == [1, 3]
        assert [run.id for run in store.newest(5)] == [3, 1]
        assert len(store.past([spec()])) <= 2
    (record,) = caplog.records
    assert "doctor --repair" in record.message
    assert store.damage() == ["the settings of run 2 have changed"]


def test_others_are_removed_beside_a_damaged_run(store: Store) -> None:
    """And a run is added."""
    _damage(store)
    store.remove([1])
    assert [run.id for run in store.runs()] == [3]
    assert store.enqueue([spec(7)]).new


@pytest.mark.parametrize(
    "change",
    [
        "UPDATE provenance SET document = '{\"a'",
        "UPDATE runs SET state = 'dome' WHERE id = 2",
        "UPDATE finals SET value = NULL, kind = 'fin' WHERE run_id = 2",
        "UPDATE attempts SET outcome = 'dome' WHERE run_id = 2",
    ],
)
def test_a_damaged_row_of_any_table_is_read_over(store: Store, change: str) -> None:
    """What it holds is nothing; every question about the others is answered."""
    _change(store, change)
    assert store.finals(1) == store.finals(3) == [FinalRow("score", 1.5, "m/s")]
    store.finals(2)
    assert [run.id for run in store.runs()] == [1, 2, 3]
    assert sum(store.counts().values()) == 3
    assert set(store.all_attempts([1, 2, 3])) == {1, 2, 3}
    assert store.origins([1, 2, 3])
    assert store.plugins() == []
    assert store.damage()


def test_a_queued_run_with_damaged_settings_fails_with_a_digest(location: str) -> None:
    """As every run that this version ends, so that doctor does not call it one of an earlier version."""
    with Store(location) as store:
        store.enqueue([spec(1)])
        _damage(store)
        assert store.claim(Owner.current(), provenance={}) is None
        assert store.counts() == {RunState.FAILED: 1}
        assert store.unsealed() == 0


def test_settings_are_mended_by_what_is_left_of_them(store: Store) -> None:
    """A document by its columns, columns by their document; what nothing tells is removed."""
    before = store.runs()
    _change(store, f"UPDATE specs SET document = '?' WHERE key = '{KEY}'")
    _change(store, f"UPDATE specs SET env = 'sea-v1', seed = 9 WHERE key = '{spec(0).key()}'")
    said = store.mend()
    assert sorted(said) == ["the settings of run 1 were restored", "the settings of run 2 were restored"]
    assert (store.runs(), store.damage(), store.mend()) == (before, [], [])
    _damage(store)
    assert store.mend() == ["run 2 was removed: its settings cannot be restored"]
    assert [run.id for run in store.runs()] == [1, 3]
    assert store.damage() == []


def test_a_run_with_other_results_is_queued_again(store: Store) -> None:
    """Its settings decide them; those that are intact stay."""
    _change(store, "UPDATE finals SET value = 9e9 WHERE run_id = 2")
    assert store.mend() == ["run 2 is queued again: its results had changed"]
    assert [run.state for run in store.runs()] == [RunState.DONE, RunState.QUEUED, RunState.DONE]
    assert store.damage() == []


def test_a_damaged_run_is_not_merged(store: Store, tmp_path: Path) -> None:
    """It is named, and the others are taken; half of its settings are enough."""
    _damage(store)
    _change(store, f"UPDATE specs SET document = '?' WHERE key = '{spec(2).key()}'")
    with Store(tmp_path / "here.db") as here:
        report = here.merge(store)
        assert report.left_out == ((2, "is damaged: its settings are not those of its key"),)
        assert [run.spec for run in here.runs()] == [spec(0), spec(2)]
        assert here.damage() == []


def test_a_forged_run_is_not_merged(store: Store, tmp_path: Path) -> None:
    """One whose settings have the right digest and are none, and one in a state that there is not."""
    document = json.dumps({"env": 1})
    key = hashlib.sha256(document.encode()).hexdigest()
    columns = "env, task, design, controller, method, fidelity, seed, frames, budget_kind, budget_amount"
    _change(store, f"INSERT INTO specs SELECT '{key}', '{document}', {columns} FROM specs WHERE key = '{KEY}'")
    _change(store, f"UPDATE runs SET spec_key = '{key}' WHERE id = 2")
    _change(store, "UPDATE runs SET state = 'dome', digest = NULL WHERE id = 3")
    with Store(tmp_path / "here.db") as here:
        assert dict(here.merge(store).left_out).keys() == {2, 3}
        assert [run.spec for run in here.runs()] == [spec(0)]


def test_a_run_without_a_digest_is_told_of(store: Store, tmp_path: Path) -> None:
    """Nothing proves that its score is the one that was stored."""
    _change(store, "UPDATE finals SET value = 9e9 WHERE run_id = 2")
    _change(store, "UPDATE runs SET digest = NULL WHERE id = 2")
    with Store(tmp_path / "here.db") as here:
        report = here.merge(store)
        assert (report.added, report.unproved) == ((1, 2, 3), (2,))
        assert here.unsealed() == 1


@pytest.mark.parametrize(
    "what",
    ["TRIGGER rise AFTER INSERT ON finals BEGIN UPDATE finals SET value = 9e9; END", "VIEW best AS SELECT 1"],
)
def test_a_file_with_a_trigger_or_a_view_is_refused(tmp_path: Path, what: str) -> None:
    """It would change results at the next write."""
    path = tmp_path / "zoo.db"
    Store(path).close()
    with sqlite3.connect(path) as connection:
        connection.execute(f"CREATE {what}")
    connection.close()
    with pytest.raises(StorageError, match="no zoobench makes"):
        Store(path)


def test_a_schema_of_strangers_is_not_trusted(tmp_path: Path) -> None:
    """It calls no function with side effects."""
    with Store(tmp_path / "zoo.db") as store, store._database.read() as session:
        assert session.scalar(text("PRAGMA trusted_schema")) == 0
