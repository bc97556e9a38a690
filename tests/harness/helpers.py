"""Specs, and runs of the fake child, for the tests of database and harness."""

import random
import sys
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import psutil

from zoobench.db.rows import FinalRow, MetricRow, RunRow, RunState
from zoobench.db.store import Store
from zoobench.harness.worker import WorkerOrders, work
from zoobench.harness.worker_pool import run_all
from zoobench.spec import Budget, Ref, RunSpec

FAKE_CHILD = "tests.harness.fake_child"


def spec(seed: int = 0, method: str = "random") -> RunSpec:
    """A spec that nothing needs to resolve."""
    refs = (Ref(name, 1) for name in ("desert", "turning", "caterpillar", "sine-basis", method))
    return RunSpec(*refs, seed=seed, budget=Budget("substeps", 10), fidelity=Ref("smoke", 1), frames=6)


def fake(mode: str = "steady", *, iterations: int = 20, pause: float = 0.01) -> tuple[str, ...]:
    """The command of a fake child."""
    return (sys.executable, "-m", FAKE_CHILD, mode, str(iterations), str(pause))


def enqueue(location: str | Path, count: int = 1) -> tuple[int, ...]:
    """Queue that many runs and return their ids."""
    with Store(location) as store:
        return store.enqueue(spec(seed) for seed in range(count)).open


def launch_fakes(
    location: str | Path,
    count: int = 1,
    *,
    child: Sequence[str] = (),
    jobs: int = 2,
    timeout: float | None = None,
    on_update: Callable[[list[RunRow]], None] | None = None,
) -> list[RunRow]:
    """Queue that many runs, do them with fake children, and return them."""
    ids = enqueue(location, count)
    return run_all(location, ids, jobs=jobs, timeout=timeout, on_update=on_update, child=child or fake())


def work_on_fakes(
    location: str | Path, count: int = 1, *, child: Sequence[str] = (), timeout: float | None = None
) -> list[RunRow]:
    """The same by a worker in this process, one run after the other: no worker has to be started."""
    ids = enqueue(location, count)
    with Store(location) as store:
        orders = WorkerOrders(str(location), store.begin_sweep(ids), timeout, tuple(child or fake()))
        work(store, orders, threading.Event())
        return store.runs(ids=ids)


def children() -> list[psutil.Process]:
    """The processes that this one has started, and theirs."""
    return psutil.Process().children(recursive=True)


class Killer:
    """Kills the child process at random moments of its run: after a share of it, and a part of an iteration."""

    def __init__(self, seed: str, kills: int = 1) -> None:
        self._random = random.Random(seed)
        # in stretches one after the other: an attempt that gets nowhere would count against the run
        self._shares = [(number + self._random.uniform(0.1, 0.9)) * 0.8 / kills for number in range(kills)]
        self.done = 0

    def __call__(self, rows: list[RunRow]) -> None:
        if self.done == len(self._shares) or rows[0].fraction < self._shares[self.done]:
            return
        found = children()
        if found and rows[0].state is RunState.RUNNING:
            time.sleep(self._random.uniform(0.0, 0.2))
            for child in found:
                child.kill()
            self.done += 1


Numbers = tuple[list[tuple[str, int, float]], list[FinalRow]]


def numbers(location: str | Path, run_id: int) -> Numbers:
    """All numbers that every run of a spec shares: curves, but for seconds and attempts, and finals."""
    with Store(location, create=False) as store:
        return [_point(row) for row in store.metrics(run_id) if not row.name.endswith("seconds")], store.finals(run_id)


def _point(row: MetricRow) -> tuple[str, int, float]:
    return row.name, row.step, row.value
