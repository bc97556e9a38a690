"""Queueing, workers, and what is done with runs as a whole, on the command line."""

import sqlite3
from collections import deque
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from tests.cli.conftest import ROOT, Command
from tests.harness.helpers import fake
from tests.report.content import add_done, make_spec
from zoobench.db.rows import RunState, StudyRow
from zoobench.db.store import Store
from zoobench.harness import worker

CELL = ("--env", "desert", "--task", "turning", "--method", "random")


@pytest.fixture
def pretend_to_work(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    """Choose how the fake child of `zoobench work` behaves."""
    real = worker.WorkerOrders

    def choose(mode: str) -> None:
        monkeypatch.setattr(worker, "WorkerOrders", partial(real, child=fake(mode)))
        monkeypatch.setenv("PYTHONPATH", str(ROOT))

    return choose


def test_runs_are_queued_and_a_worker_does_them(
    zoobench: Command, tmp_path: Path, pretend_to_work: Callable[[str], None]
) -> None:
    """The command that `run --no-wait` ends with can be typed, and does what was asked for and no more."""
    pretend_to_work("steady")
    assert zoobench("run", "--env", "ice", *CELL[2:], "--no-wait", "--seeds", "1").code == 0
    reply = zoobench("run", *CELL, "--no-wait")
    assert reply.err.splitlines()[-1] == "Next: zoobench work --sweep 2"
    reply = zoobench("work", "--sweep", "2")
    assert reply.code == 0
    assert "2 done of 2 taken" in reply.err
    with Store(tmp_path / "zoobench.db") as store:
        assert [row.state for row in store.runs()] == [RunState.QUEUED, RunState.DONE, RunState.DONE]
    assert "No run is left to do" in zoobench("run", *CELL, "--no-wait").err
    assert zoobench("work", "--sweep", "7").code == 2
    assert zoobench("run", *CELL, "--no-wait", "--memory", "2GB").code == 2


@pytest.mark.slow
def test_a_worker_with_a_failed_run_ends_with_1(zoobench: Command, pretend_to_work: Callable[[str], None]) -> None:
    """As `run` does."""
    pretend_to_work("fail")
    zoobench("run", *CELL, "--no-wait", "--seeds", "1")
    reply = zoobench("work", "--max-runs", "1", "--max-time", "1h")
    assert reply.code == 1
    assert "0 done of 1 taken" in reply.err


def test_priority_is_set_where_runs_are_queued(zoobench: Command, tmp_path: Path) -> None:
    """Asked for again with another one, they are moved."""
    from zoobench.db.owner import Owner

    zoobench("run", *CELL, "--no-wait")
    zoobench("run", *CELL, "--seeds", "1,", "--priority", "3", "--no-wait")
    with Store(tmp_path / "zoobench.db") as store:
        claim = store.claim(Owner.current(), provenance={})
        assert claim is not None
        assert claim.spec.seed == 1


def test_a_priority_that_no_database_can_hold_is_refused(zoobench: Command, tmp_path: Path) -> None:
    """Before anything is queued."""
    for priority in ("99999999999999999999", "-2147483648"):
        reply = zoobench("run", *CELL, "--priority", priority, "--no-wait")
        assert reply.code == 2
        assert f"priority={priority} is too large for a database" in reply.err
    assert not (tmp_path / "zoobench.db").exists()


@pytest.mark.parametrize("command", [("work",), ("cancel",), ("db", "remove")])
def test_a_sweep_that_no_database_can_hold_is_refused(zoobench: Command, command: tuple[str, ...]) -> None:
    """As one that is not there is."""
    zoobench("run", *CELL, "--no-wait")
    reply = zoobench(*command, "--sweep", "99999999999999999999")
    assert reply.code == 2
    assert "sweep=99999999999999999999 is too large for a database" in reply.err


def test_cancelled_runs_are_not_done_until_they_are_asked_for(zoobench: Command, tmp_path: Path) -> None:
    """`run` leaves them alone but for --retry cancelled; what is not named is refused."""
    zoobench("run", *CELL, "--no-wait")
    assert zoobench("cancel").code == 2
    assert "1 cancelled, 0 had ended" in zoobench("cancel", "1").err
    assert "1 cancelled, 1 had ended" in zoobench("cancel", "--sweep", "1").err
    assert "No run is left to do" in zoobench("run", *CELL, "--no-wait").err
    assert "2 to be repeated" in zoobench("run", *CELL, "--no-wait", "--retry", "cancelled").err
    with Store(tmp_path / "zoobench.db") as store:
        assert store.counts() == {RunState.QUEUED: 2}


def test_runs_are_removed_only_on_demand_and_with_what_needs_them(zoobench: Command, tmp_path: Path) -> None:
    """First it says what would go."""
    from zoobench.inputs import run_name

    with Store(tmp_path / "zoobench.db") as store:
        first = make_spec()
        for spec in (first, make_spec(method=f"diffphysics-v2[start={run_name(first.key())}]"), make_spec(seed=1)):
            add_done(store, spec, 1.0)
    reply = zoobench("db", "remove", "1")
    assert reply.code == 0
    assert "would remove 2" in reply.err
    assert "which depends on one of them" in reply.err
    assert zoobench("db", "remove", "1", "--yes").code == 0
    with Store(tmp_path / "zoobench.db") as store:
        assert [row.id for row in store.runs()] == [3]


def test_databases_are_merged_and_differences_named(zoobench: Command, tmp_path: Path) -> None:
    """Exit code 1 where the same run has other results; a database is not merged into itself."""
    for name, score in (("a.db", 1.0), ("b.db", 2.0)):
        with Store(tmp_path / name) as store:
            add_done(store, make_spec(), score)
            add_done(store, make_spec(seed=int(score)), score)
            store.begin_sweep([1])
            deque(store.save_study("transfer", [StudyRow("run 1 in ice", "OK", {})], provenance={}), maxlen=0)
    reply = zoobench("db", "merge", "a.db", "b.db")
    assert reply.code == 1
    assert reply.err.splitlines()[0] == "1 added, 1 differing"
    assert reply.err.splitlines()[-1] == "Not merged: 1 sweeps, 1 rows of transfer"
    assert "run 1 of the target and run 1 of the source differ in finals" in reply.err
    assert zoobench("db", "merge", "a.db", "./a.db").code == 2
    assert zoobench("db", "merge", "new.db", "a.db").code == 0
    with sqlite3.connect("a.db") as connection:
        connection.execute("UPDATE runs SET digest = NULL WHERE id = 1")
    connection.close()
    reply = zoobench("db", "merge", "newer.db", "a.db")
    assert reply.code == 0
    assert "1 runs without a digest, whose results cannot be verified, in the target: 1" in reply.err
    reply = zoobench("db", "merge", "other.db", "none.db")
    assert reply.code == 2
    assert reply.err.strip().endswith("There is no database none.db to take runs from. Name one that exists.")
    assert not Path("other.db").exists()


def test_results_are_exported(zoobench: Command, database: Path, tmp_path: Path) -> None:
    """To a file of the one format; another ending is refused."""
    assert zoobench("db", "export", "-o", "all.parquet", "--env", "ice").code == 0
    assert (tmp_path / "all.parquet").stat().st_size > 0
    assert zoobench("db", "export", "-o", "all.csv").code == 2
    assert zoobench("db", "export", "-o", "none/all.parquet").code == 2
