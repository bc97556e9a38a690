"""Runs from queue to result, with real workers and child processes and a small method in place of the simulator."""

import signal
import sqlite3
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import psutil
import pytest

from tests.harness.helpers import children, enqueue, fake, launch_fakes, numbers, work_on_fakes
from tests.postgres import Server
from zoobench.db.rows import Batch, RunRow, RunState
from zoobench.db.store import Store
from zoobench.errors import StorageError, StorageFullError, UsageError
from zoobench.harness import worker_pool
from zoobench.harness.process import ChildProcess, StartedProcess
from zoobench.harness.supervise import supervise
from zoobench.harness.worker_pool import run_all

_SLOW_WALK = fake(iterations=150, pause=0.01)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Where the database will be."""
    return tmp_path / "zoo.db"


def test_runs_are_done_and_recorded(path: Path) -> None:
    """Every run ends DONE with its curve, its finals, its log and one attempt with a provenance and its memory."""
    updates: list[list[RunRow]] = []
    rows = launch_fakes(path, 3, on_update=updates.append)
    assert [row.state for row in rows] == [RunState.DONE] * 3
    assert [row.state for row in updates[0]] == [RunState.QUEUED] * 3
    with Store(path) as store:
        for row in rows:
            curve = store.metrics(row.id, "position")
            assert [point.step for point in curve] == list(range(1, 21))
            finals = {final.name: final for final in store.finals(row.id)}
            assert (finals["score"].value, finals["score"].unit) == (curve[-1].value, "m")
            assert store.solution(row.id) == (curve[-1].value,)
            assert [line.text for line in store.logs(row.id)] == ["a word on standard output"]
            (attempt,) = store.attempts(row.id)
            assert (attempt.outcome, attempt.exit_code, attempt.signal) == (RunState.DONE, None, None)
            assert attempt.provenance["thread_settings"]["OMP_NUM_THREADS"] == "1"
            assert attempt.peak_memory is not None
            assert 10 * 2**20 < attempt.peak_memory < 2**34  # an interpreter with its packages takes more [bytes]


@pytest.mark.parametrize(
    ("mode", "state", "reason"),
    [
        ("fail", RunState.FAILED, "ValueError: the middle of the walk"),
        ("diverge", RunState.DIVERGED, "The simulation diverged by substep 2"),
        pytest.param(
            "vanish",
            RunState.FAILED,
            "exit code 7 and said nothing. Its last line: last words",
            marks=pytest.mark.slow,  # its four attempts are those of the next
        ),
        ("segfault", RunState.FAILED, "killed by signal 11 (SIGSEGV)"),
    ],
)
def test_each_way_to_fail_has_its_state_and_reason(path: Path, mode: str, state: RunState, reason: str) -> None:
    """No failure is a success: no finals, a reason, and every attempt kept."""
    (row,) = work_on_fakes(path, child=fake(mode))
    assert row.state is state
    assert reason in (row.reason or "")
    with Store(path) as store:
        attempts = store.attempts(row.id)
        assert store.finals(row.id) == []
    if mode == "fail":
        assert "in solve" in (attempts[0].traceback or "")
    if mode in ("vanish", "segfault"):
        assert {attempt.outcome for attempt in attempts} == {RunState.LOST}
        assert [attempt.progressed for attempt in attempts] == [True, False, False, False]
        assert attempts[0].signal == (signal.SIGSEGV if mode == "segfault" else None)


def test_a_child_that_hangs_is_ended_by_the_time_limit(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """TIMEOUT is neither FAILED nor LOST, and what was reported is kept."""
    monkeypatch.setattr("zoobench.harness.supervise.GRACE_SECONDS", 0.3)
    (row,) = work_on_fakes(path, child=fake("hang"), timeout=4.0)
    assert row.state is RunState.TIMEOUT
    assert "4 s" in (row.reason or "")
    assert len(numbers(path, row.id)[0]) == 20


@pytest.mark.slow  # a run beside one that fails is done in test_messages.py
def test_one_failure_does_not_stop_the_others(path: Path) -> None:
    """Finished runs are not done again, and a queue with a failure is emptied all the same."""
    rows = work_on_fakes(path, child=fake("fail"))
    assert rows[0].state is RunState.FAILED
    again = work_on_fakes(path, 3)
    assert [row.state for row in again] == [RunState.DONE] * 2
    with Store(path) as store:
        assert len(store.attempts(rows[0].id)) == 1


@pytest.mark.slow
def test_an_interrupt_leaves_the_runs_to_go_on_with(path: Path) -> None:
    """After Ctrl-C nothing runs, the runs are queued, and typed again they end as if nothing had happened.

    Every stored number is that of an undisturbed run in another database.
    """

    moved: set[int] = set()

    def interrupt(rows: list[RunRow]) -> None:
        moved.update(row.id for row in rows if row.fraction > 0.0)
        if len(moved) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        launch_fakes(path, 2, child=_SLOW_WALK, on_update=interrupt)
    assert children() == []
    with Store(path) as store:
        assert store.counts() == {RunState.QUEUED: 2}
        assert [attempt.outcome for attempt in store.attempts(1)] == [RunState.CANCELLED]
    rows = work_on_fakes(path, 2, child=_SLOW_WALK)
    assert [row.state for row in rows] == [RunState.DONE] * 2
    with Store(path) as store:
        first, second = store.attempts(1)
        assert (first.progressed, second.resumed) == (True, True)
        assert {point.attempt for point in store.metrics(1)} == {1, 2}
    straight = path.with_name("straight.db")
    work_on_fakes(straight, 2, child=fake(iterations=150, pause=0.0))
    assert [numbers(path, run_id) for run_id in (1, 2)] == [numbers(straight, run_id) for run_id in (1, 2)]


@pytest.mark.slow
def test_an_interrupt_is_not_lost_in_a_finaliser(path: Path, ctrl_c: None) -> None:
    """Ctrl-C while Python disposes of something, where an exception would be printed and forgotten."""

    class Disposed:
        def __del__(self) -> None:
            signal.raise_signal(signal.SIGINT)

    def interrupt(rows: list[RunRow]) -> None:
        if rows[0].fraction > 0.0:
            Disposed()

    with pytest.raises(KeyboardInterrupt):
        launch_fakes(path, child=_SLOW_WALK, on_update=interrupt)
    with Store(path) as store:
        assert store.counts() == {RunState.QUEUED: 1}
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.mark.slow
def test_an_interrupt_is_no_divergence(path: Path) -> None:
    """A method that met divergences alone until it was asked to stop has its run queued, and goes on to its end."""

    def interrupt(rows: list[RunRow]) -> None:
        if rows[0].fraction > 0.0:
            raise KeyboardInterrupt

    blind = fake("blind", iterations=150, pause=0.01)
    with pytest.raises(KeyboardInterrupt):
        launch_fakes(path, child=blind, on_update=interrupt)
    with Store(path) as store:
        assert store.counts() == {RunState.QUEUED: 1}
    assert [row.state for row in work_on_fakes(path, child=blind)] == [RunState.DONE]


def test_children_die_with_their_launcher(path: Path) -> None:
    """`kill -9` of `run` leaves no process behind, and the runs are queued."""
    code = "import sys; from tests.harness.helpers import *; launch_fakes(sys.argv[1], 2, child=fake(iterations=4000))"
    launcher = subprocess.Popen([sys.executable, "-c", code, str(path)])
    family = _family(launcher.pid, 2)
    launcher.kill()
    launcher.wait()
    _, alive = psutil.wait_procs(family, timeout=15.0)
    assert alive == []
    with Store(path) as store:
        store.recover()
        assert store.counts() == {RunState.QUEUED: 2}


def _family(pid: int, size: int) -> list[psutil.Process]:
    """The descendants of a process, once there are this many."""
    deadline = time.monotonic() + 30.0
    while time.monotonic() < deadline:
        family = psutil.Process(pid).children(recursive=True)
        if len(family) >= size:
            return family
        time.sleep(0.05)
    raise AssertionError(f"the process never had {size} descendants")


@pytest.mark.slow  # tests/db/test_races.py has many at once, on both kinds of database
def test_runs_in_other_hands_are_waited_for(location: str) -> None:
    """A second launcher of the same runs does none of them twice."""
    ids = enqueue(location, 2)
    other = threading.Thread(target=run_all, args=(location, ids), kwargs={"child": fake(iterations=50), "jobs": 1})
    other.start()
    rows = run_all(location, ids, child=fake(iterations=50), jobs=1)
    other.join()
    assert [(row.state, row.attempt) for row in rows] == [(RunState.DONE, 1)] * 2


@pytest.mark.slow  # tests/db/test_postgres.py has a server that is gone, and others a worker that is
def test_a_server_that_is_stopped_loses_nothing(postgres: Server, path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The database's server goes away in the midst of a run; when it is back, the run goes on to the same end."""
    # this process, whose threads held the run, lives on, so that only the lease tells that nobody has it
    monkeypatch.setattr("zoobench.db.store.LEASE_SECONDS", 6.0)
    url = postgres.new_database()

    def stop(rows: list[RunRow]) -> None:
        if rows[0].fraction > 0.0:
            postgres.stop()

    try:
        with pytest.raises(StorageError, match="Stored data is safe"):
            launch_fakes(url, child=_SLOW_WALK, on_update=stop)
        assert children() == []
    finally:
        postgres.start()
    assert [row.state for row in launch_fakes(url, child=_SLOW_WALK)] == [RunState.DONE]
    with Store(url) as store:
        assert [(attempt.outcome, attempt.resumed) for attempt in store.attempts(1)] == [
            (RunState.LOST, False),
            (RunState.DONE, True),
        ]
    work_on_fakes(path, child=_SLOW_WALK)
    assert numbers(url, 1) == numbers(path, 1)


_LAUNCH = (
    "import sys; from tests.harness.helpers import *; import zoobench.db.store as store; store.LEASE_SECONDS = 0.5; "
    "launch_fakes(sys.argv[1], child=tuple(sys.argv[2:]))"
)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="signals are Linux's")
def test_a_launcher_that_is_stopped_keeps_its_runs(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Three times for longer than its lease, beside one that is at work: nothing is lost, and no number is another."""
    monkeypatch.setattr("zoobench.db.lifecycle.SILENT_SECONDS", 0.2)
    child = fake(iterations=150, pause=0.02)
    with subprocess.Popen([sys.executable, "-c", _LAUNCH, str(path), *child]) as launcher:
        while not path.exists() or not _is_begun(path):
            time.sleep(0.05)
        for _ in range(3):
            launcher.send_signal(signal.SIGSTOP)
            for _ in range(5):
                time.sleep(0.2)
                with Store(path) as store:
                    assert store.recover() == []
            launcher.send_signal(signal.SIGCONT)
            time.sleep(0.3)
        assert launcher.wait(60.0) == 0
    with Store(path) as store:
        assert [attempt.outcome for attempt in store.attempts(1)] == [RunState.DONE]


def _is_begun(path: Path) -> bool:
    with suppress(StorageError), Store(path, create=False) as store:
        return any(run.fraction > 0.0 for run in store.runs())
    return False


@pytest.mark.slow
@pytest.mark.parametrize("jump", [86_400.0, *(pytest.param(jump, marks=pytest.mark.slow) for jump in (90.0, -300.0))])
def test_a_clock_that_is_set_in_the_midst_of_runs_loses_none(
    path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, jump: float
) -> None:
    """Three runs go on here; their times are those that have passed, and nobody is told of silence."""

    def set_clock(rows: list[RunRow]) -> None:
        if rows[0].fraction > 0.2:
            monkeypatch.setattr(time, "time", lambda: clock() + jump)

    clock = time.time
    rows = launch_fakes(path, 3, child=fake(iterations=100, pause=0.02), jobs=3, on_update=set_clock)
    with Store(path) as store:
        attempts = [attempt for row in rows for attempt in store.attempts(row.id)]
    assert [attempt.outcome for attempt in attempts] == [RunState.DONE] * 3
    assert all(attempt.wall_seconds is not None and 2.0 < attempt.wall_seconds < 60.0 for attempt in attempts)
    assert caplog.records == []


@pytest.mark.parametrize(("jobs", "timeout"), [(0, None), (-1, None), (1, 0.0), (1, float("nan"))])
def test_settings_that_allow_nothing_are_refused(path: Path, jobs: int, timeout: float | None) -> None:
    """Before anything is started."""
    with pytest.raises(UsageError):
        run_all(path, enqueue(path), jobs=jobs, timeout=timeout)


class _FullDisk(Store):
    """A store whose disk is full from the second commit on that has something to keep."""

    commits = 0

    def commit(self, claim: object, batch: Batch) -> None:
        self.commits += bool(batch.metrics)  # a child that starts slowly has nothing to say at first
        if self.commits > 1:
            with self._database.read() as session:
                pages = session.connection().exec_driver_sql("PRAGMA page_count").scalar()
                session.connection().exec_driver_sql(f"PRAGMA max_page_count = {pages}")
            batch.checkpoint = bytes(1 << 20)
        super().commit(claim, batch)  # type: ignore[arg-type]


@pytest.mark.slow
def test_a_full_disk_stops_the_child_and_the_run_goes_on_later(path: Path) -> None:
    """SQLite's own SQLITE_FULL: the error arrives, no child is left, the earlier commit stays, the run resumes."""
    from zoobench.db.owner import Owner

    enqueue(path)
    with _FullDisk(path) as store:
        claim = store.claim(Owner.current(), provenance={})
        assert claim is not None
        with pytest.raises(StorageFullError):
            supervise(store, claim, ChildProcess(StartedProcess(_SLOW_WALK)), stop=threading.Event())
    assert children() == []
    with Store(path) as store:
        assert store.check() == []
        assert store.counts() == {RunState.QUEUED: 1}
        assert store.metrics(1) != []
    (row,) = work_on_fakes(path, child=_SLOW_WALK)
    assert (row.state, row.attempt) == (RunState.DONE, 2)


@pytest.mark.slow
def test_a_workers_storage_error_is_the_launchers(path: Path) -> None:
    """A database that breaks under way ends the pool with a message, not with a silent loop."""
    ids = enqueue(path)

    def spoil(rows: list[RunRow]) -> None:
        if path.exists():
            path.rename(path.with_name("moved.db"))

    with pytest.raises(StorageError, match="There is no database"):
        run_all(path, ids, child=_SLOW_WALK, on_update=spoil)


@pytest.mark.slow
def test_a_stopped_writer_is_waited_for_with_a_word(
    path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """A writer that has stopped within its transaction stops the others for a while, and loses no run of theirs."""
    monkeypatch.setattr(worker_pool, "_SILENT_SECONDS", 1.0)
    ids = enqueue(path, 1)
    writers: list[sqlite3.Connection] = []

    def stop(rows: list[RunRow]) -> None:
        if not writers and rows[0].fraction > 0.0:
            writers.append(sqlite3.connect(path, isolation_level=None, check_same_thread=False))
            writers[0].execute("BEGIN IMMEDIATE")
            threading.Timer(2.5, writers[0].close).start()

    (row,) = run_all(path, ids, child=_SLOW_WALK, on_update=stop)
    assert (row.state, row.attempt) == (RunState.DONE, 1)
    assert [record.message for record in caplog.records] == [
        f"Nothing could be stored for 1 s: {path} is locked by another zoobench or another program. Waiting."
    ]


@pytest.fixture(autouse=True)
def _no_orphans() -> Iterator[None]:
    """Every test ends with the processes that it began with."""
    yield
    for process in children():
        process.kill()
