"""A worker's child process does run after run as long as it is what a new one would be."""

import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import psutil
import pytest

from tests.harness.helpers import children, enqueue, fake, launch_fakes, numbers, spec, work_on_fakes
from tests.harness.test_messages import bad
from zoobench.db.rows import Claim, RunRow, RunState
from zoobench.db.store import Store
from zoobench.harness import executor
from zoobench.harness.executor import Executor
from zoobench.harness.process import StartedProcess
from zoobench.harness.worker import WorkerOrders, work
from zoobench.inputs import Start
from zoobench.spec import Ref


def _processes(path: Path) -> list[float]:
    """The number of the process of each run."""
    with Store(path) as store:
        return [final.value for row in store.runs() for final in store.finals(row.id) if final.name == "process"]


def _log(path: Path, run_id: int) -> list[str]:
    with Store(path) as store:
        return [line.text for line in store.logs(run_id)]


def test_one_process_does_run_after_run(tmp_path: Path) -> None:
    """Each has its own log, and the process goes on: the attempts tell no exit code. Then it ends with its worker."""
    path = tmp_path / "zoo.db"
    assert [row.state for row in work_on_fakes(path, 3, child=bad("none"))] == [RunState.DONE] * 3
    assert len(set(_processes(path))) == 1
    assert [_log(path, run_id) for run_id in (1, 2, 3)] == [[f"run {seed}", "begins"] for seed in range(3)]
    with Store(path) as store:
        assert {store.attempts(run_id)[0].exit_code for run_id in (1, 2, 3)} == {None}
    assert children() == []


@pytest.mark.slow
def test_what_a_run_prints_is_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also a line that is longer than is kept, and what a library has not yet written."""
    monkeypatch.delenv("PYTHONUNBUFFERED", raising=False)
    path = tmp_path / "zoo.db"
    work_on_fakes(path, 2, child=bad("prints"))
    assert _log(path, 1) == ["run 0", "begins", "x" * 2000, "by Python", "by a library"]
    assert _log(path, 2) == ["run 1", "begins"]
    assert len(set(_processes(path))) == 1


def test_environment_and_random_numbers_are_put_back(tmp_path: Path) -> None:
    """Libraries change them when they are loaded, and seed them: the next run draws what the last did."""
    path = tmp_path / "zoo.db"
    work_on_fakes(path, 2, child=bad("draws"))
    assert len(set(_processes(path))) == 1
    assert _log(path, 1)[2:] == _log(path, 2)[2:] != []


@pytest.mark.slow  # test_process.py reads a flood over
def test_a_flood_is_counted_for_each_run(tmp_path: Path) -> None:
    """The log of a run after one of a million lines is whole."""
    path = tmp_path / "zoo.db"
    work_on_fakes(path, 2, child=bad("flood-of-lines"))
    assert len(set(_processes(path))) == 1
    assert len(_log(path, 1)) == 10_000
    assert _log(path, 2) == ["run 1", "begins"]


@pytest.mark.slow
def test_a_run_that_diverges_is_no_reason_for_a_new_process(tmp_path: Path) -> None:
    """It is a result like others; one that fails may have left anything."""
    for mode, codes in (("diverge", {None}), ("fail", {0})):
        path = tmp_path / f"{mode}.db"
        work_on_fakes(path, 2, child=fake(mode))
        with Store(path) as store:
            assert {store.attempts(run_id)[0].exit_code for run_id in (1, 2)} == codes


@pytest.mark.slow  # an interrupted launch goes on in one process in test_worker_pool.py
def test_a_run_goes_on_from_its_checkpoint_in_a_process_that_has_done_another(tmp_path: Path) -> None:
    """Two runs were stopped; one process brings both to the end of runs that were not."""

    def interrupt(rows: list[RunRow]) -> None:
        if all(row.fraction > 0.0 for row in rows):
            raise KeyboardInterrupt

    path, straight, walk = tmp_path / "zoo.db", tmp_path / "straight.db", fake(iterations=100, pause=0.02)
    with pytest.raises(KeyboardInterrupt):
        launch_fakes(path, 2, child=walk, on_update=interrupt)
    work_on_fakes(path, 2, child=walk)
    work_on_fakes(straight, 2, child=fake(iterations=100, pause=0.0))
    with Store(path) as store:
        last = [store.attempts(run_id)[-1] for run_id in (1, 2)]
    assert [(attempt.outcome, attempt.resumed, attempt.exit_code) for attempt in last] == [
        (RunState.DONE, True, None)
    ] * 2
    assert [numbers(path, run_id) for run_id in (1, 2)] == [numbers(straight, run_id) for run_id in (1, 2)]


_ONE_OF_EACH_KIND = ("grows", "leaves", "sets-a-signal")
_OTHERS = (
    "closes-output", "is-foreign", "leaves-a-thread",
    "is-full", "leaves-sessions", "goes-away", "sets-the-path", "redirects-output", "replaces-output", "ignores-errors",
)  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("oddities", [_ONE_OF_EACH_KIND, _OTHERS], ids=["one-of-each-kind", "others"])
def test_a_process_in_which_a_run_has_left_something_does_no_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, oddities: tuple[str, ...]
) -> None:
    """All runs are done and keep their logs, each by a process of its own; nothing is left in the end."""
    monkeypatch.setenv("ZOOBENCH_MEMORY", "1GB")
    path = tmp_path / "zoo.db"
    rows = work_on_fakes(path, len(oddities) + 1, child=bad(*oddities))
    assert [(row.state, row.attempt) for row in rows] == [(RunState.DONE, 1)] * len(rows)
    used = _processes(path)
    assert [oddity for oddity, *pair in zip(oddities, used, used[1:], strict=False) if len(set(pair)) == 1] == []
    for row in rows:
        assert _log(path, row.id)[:2] == [f"run {row.id - 1}", "begins"]
    assert _log(path, len(rows))[2:] == []
    assert children() == []


@pytest.fixture
def executing() -> Any:
    """An executor whose processes sleep."""
    command = (sys.executable, "-c", "import sys; sys.stdin.read()")
    with Executor(partial(StartedProcess, command)) as made:
        yield made


_CLAIM = Claim(1, spec(), "owner", 1, None)


def test_a_process_serves_as_long_as_a_new_one_would_begin_with_the_same(
    executing: Executor, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Code and packages, plug-ins, the environment, stored runs, and whether there is a GPU."""
    child = executing.child_for(_CLAIM, {"code": 1})
    assert executing.child_for(replace(_CLAIM, run_id=2, spec=spec(3)), {"code": 1}) is child

    def is_new(claim: Claim = _CLAIM, code: int = 2) -> bool:
        nonlocal child
        before, child = child, executing.child_for(claim, {"code": code})
        return child is not before

    assert is_new()
    assert not is_new()
    assert is_new(replace(_CLAIM, stored=(Start(spec(), (1.0,)),)))
    assert is_new(replace(_CLAIM, stored=(Start(spec(), (2.0,)),)))
    assert is_new(replace(_CLAIM, spec=replace(spec(), fidelity=Ref.parse("draft[device=cuda]"))))
    assert is_new()
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    assert is_new()
    monkeypatch.setattr(executor, "plugins_of", lambda _: {"method odd-v1": {"code": "hash"}})
    assert is_new()
    assert not is_new()


@pytest.mark.slow
def test_an_idle_process_that_is_killed_costs_no_run_an_attempt(tmp_path: Path) -> None:
    """It is found dead before the next run is handed over, or else that goes on in another."""
    path = tmp_path / "zoo.db"
    ids = enqueue(path, 3)

    def kill(_: int) -> None:
        for process in children():
            process.kill()
        psutil.wait_procs(children(), timeout=10.0)
        time.sleep(0.1)

    with Store(path) as store:
        work(store, WorkerOrders(str(path), child=bad("none")), threading.Event(), on_run=kill)
        assert [(row.state, row.attempt) for row in store.runs(ids=ids)] == [(RunState.DONE, 1)] * 3
    assert len(set(_processes(path))) == 3


_IDLE = """
import sys, threading, time
from tests.harness.helpers import *
from tests.harness.test_messages import bad
path = sys.argv[1]
enqueue(path, 2)
def wait(_):
    print("idle", flush=True)
    time.sleep(600.0 * bool(next(taken) == 2))
taken = iter(range(1, 5))
with Store(path) as store:
    work(store, WorkerOrders(path, child=bad("none")), threading.Event(), on_run=wait)
"""


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_an_idle_process_ends_with_its_worker(tmp_path: Path, number: signal.Signals) -> None:
    """However that ends."""
    with subprocess.Popen([sys.executable, "-c", _IDLE, tmp_path / "zoo.db"], stdout=subprocess.PIPE) as worker:
        assert worker.stdout is not None
        for _ in range(2):  # a run was taken, and has ended
            worker.stdout.readline()
        family = psutil.Process(worker.pid).children(recursive=True)
        assert family
        worker.send_signal(number)
    _, alive = psutil.wait_procs(family, timeout=10.0)
    assert alive == []
