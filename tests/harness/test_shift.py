"""Workers of batch jobs, as processes of their own, with a small method in place of the simulator."""

import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.harness.helpers import enqueue, fake, numbers, work_on_fakes
from zoobench.db.rows import RunState
from zoobench.db.store import Store
from zoobench.errors import UsageError
from zoobench.harness.shift import shift_of, work_shift
from zoobench.harness.worker import Shift, WorkerOrders

_SLOW = fake(iterations=150, pause=0.01)
_WORK = (
    "import sys; from tests.harness.test_shift import *; work_shift(orders(sys.argv[1], sys.argv[2:]), shift_of(None))"
)


def orders(path: str | Path, child: list[str] | tuple[str, ...] = ()) -> WorkerOrders:
    """To do all runs with fake children."""
    return WorkerOrders(str(path), child=tuple(child or fake()))


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Where the database will be."""
    return tmp_path / "zoo.db"


@pytest.mark.slow  # tests/db/test_races.py has many beside each other
def test_a_worker_ends_when_nothing_is_queued(path: Path) -> None:
    """Two workers beside each other do every run once, and tell of each when it is taken and when it has ended."""
    ids = enqueue(path, 4)
    other = subprocess.Popen([sys.executable, "-c", _WORK, str(path), *fake()])
    told: list[int] = []
    is_stopped = work_shift(orders(path), shift_of(None), lambda _, run_id: told.append(run_id))
    assert (is_stopped, other.wait(60.0)) == (False, 0)
    assert told[::2] == told[1::2]
    with Store(path) as store:
        assert [(row.state, row.attempt) for row in store.runs(ids=ids)] == [(RunState.DONE, 1)] * 4


def test_a_worker_takes_no_more_runs_than_it_may(path: Path) -> None:
    """The rest stays queued."""
    enqueue(path, 3)
    work_shift(orders(path), shift_of(None, runs=2))
    with Store(path) as store:
        assert store.counts() == {RunState.DONE: 2, RunState.QUEUED: 1}


@pytest.mark.slow
def test_a_worker_takes_only_the_runs_of_its_sweep(path: Path) -> None:
    """A sweep that does not exist is refused."""
    ids = enqueue(path, 3)
    with Store(path) as store:
        sweep = store.begin_sweep(ids[1:2])
    work_shift(WorkerOrders(str(path), sweep, child=fake()), shift_of(None))
    with Store(path) as store:
        assert [row.id for row in store.runs(states=[RunState.DONE])] == list(ids[1:2])
    with pytest.raises(UsageError, match="no sweep 9"):
        work_shift(WorkerOrders(str(path), 9, child=fake()), shift_of(None))


@pytest.mark.slow
def test_a_run_goes_back_to_the_queue_when_the_time_is_nearly_over(path: Path) -> None:
    """It stops at a checkpoint within the time, and the next worker comes to the numbers of an undisturbed run."""
    enqueue(path)
    slow = fake(iterations=1000, pause=0.01)
    now = time.monotonic()
    work_shift(orders(path, slow), Shift(ask_at=now + 5.0, end_at=now + 30.0))  # a child takes long to begin under load
    with Store(path) as store:
        (row,) = store.runs()
        (attempt,) = store.attempts(1)
        assert (row.state, attempt.outcome, attempt.progressed) == (RunState.QUEUED, RunState.CANCELLED, True)
        assert (attempt.exit_code, "time of its worker" in (attempt.reason or "")) == (0, True)
    work_shift(orders(path, fake(iterations=1000, pause=0.0)), shift_of(None))
    straight = path.with_name("straight.db")
    work_on_fakes(straight, child=fake(iterations=1000, pause=0.0))
    assert numbers(path, 1) == numbers(straight, 1)


@pytest.mark.slow
def test_a_child_that_does_not_obey_is_ended_before_the_time_is_over(path: Path) -> None:
    """The worker would be killed otherwise, and the run lost until its lease ends."""
    enqueue(path)
    work_shift(orders(path, fake("hang")), shift_of(6.0))
    with Store(path) as store:
        assert store.counts() == {RunState.QUEUED: 1}
        assert store.attempts(1)[0].signal == signal.SIGKILL


def test_sigterm_hands_the_run_back(path: Path) -> None:
    """As a batch system or a container asks for the end; nothing is lost."""
    enqueue(path, 2)
    worker = subprocess.Popen([sys.executable, "-c", _WORK, str(path), *fake(iterations=4000)])
    _wait_for(lambda: _progress(path) > 0.0)
    worker.send_signal(signal.SIGTERM)
    assert worker.wait(30.0) == 0
    with Store(path) as store:
        assert store.counts() == {RunState.QUEUED: 2}
        assert [attempt.outcome for attempt in store.attempts(1)] == [RunState.CANCELLED]


@pytest.mark.slow
def test_a_cancelled_run_is_dropped_by_its_worker(path: Path) -> None:
    """It has ended at once, its worker goes on with the next, and `retry` goes on from its checkpoint."""
    enqueue(path, 2)
    worker = subprocess.Popen([sys.executable, "-c", _WORK, str(path), *_SLOW])
    _wait_for(lambda: _progress(path) > 0.0)
    with Store(path) as store:
        assert store.cancel([1]) == [1]
        assert worker.wait(60.0) == 0
        first, second = store.runs()
        assert (first.state, second.state) == (RunState.CANCELLED, RunState.DONE)
        assert store.attempts(1)[0].outcome is RunState.CANCELLED
        assert store.damage() == []
        assert store.cancel([1, 2]) == []
        assert store.retry([1]) == [1]
    work_shift(orders(path, _SLOW), shift_of(None))
    straight = path.with_name("straight.db")
    work_on_fakes(straight, child=fake(iterations=150, pause=0.0))
    assert numbers(path, 1) == numbers(straight, 1)


@pytest.mark.slow
def test_a_process_that_takes_more_memory_than_it_may_fails(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """FAILED says how much it took and what to do; one that takes less is DONE."""
    enqueue(path)
    monkeypatch.setenv("ZOOBENCH_MEMORY", "10MB")
    work_shift(orders(path, fake("hang")), shift_of(None))
    with Store(path) as store:
        (row,) = store.runs()
        assert row.state is RunState.FAILED
        assert "MB of memory, and --memory allows 10 MB. Allow more" in (row.reason or "")
        store.retry([1])
    monkeypatch.setenv("ZOOBENCH_MEMORY", "30GB")
    work_shift(orders(path), shift_of(None))
    with Store(path) as store:
        assert store.counts() == {RunState.DONE: 1}


def _progress(path: Path) -> float:
    with Store(path) as store:
        return store.runs(ids=[1])[0].fraction


def _wait_for(is_so: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 30.0
    while not is_so():
        assert time.monotonic() < deadline
        time.sleep(0.2)
