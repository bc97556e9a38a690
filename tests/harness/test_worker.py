"""A worker holds its run while the process for it is waited for."""

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.harness.helpers import enqueue, fake
from zoobench.db.rows import RunState
from zoobench.db.store import Store
from zoobench.harness import worker
from zoobench.harness.process import Process, start
from zoobench.harness.worker import WorkerOrders, work


def _leases(path: Path, monkeypatch: pytest.MonkeyPatch, meanwhile: Callable[[Store], object]) -> list[float | None]:
    """When the lease ends, before and after a worker is asked whether it still waits for its process, and after work.

    The middle one is missing where it waits no more.
    """
    leases: list[float | None] = []

    def begin(command: Any, requests: Any, spec: Any, is_wanted: Callable[[], bool]) -> Process:
        with Store(path) as other:
            leases.append(other.run("1").lease_until)
            meanwhile(other)
            assert is_wanted()
            leases.append(other.run("1").lease_until)
        return start(command)

    monkeypatch.setattr(worker, "_RENEW_SECONDS", 0.0)
    monkeypatch.setattr(worker, "start", begin)
    enqueue(path)
    with Store(path) as store:
        work(store, WorkerOrders(str(path), child=fake()), threading.Event())
        return [*leases, store.run("1").lease_until]


def test_the_lease_is_renewed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Compiling kernels may take longer than a lease."""
    path = tmp_path / "zoo.db"
    claimed, renewed, ended = _leases(path, monkeypatch, lambda _: None)
    assert claimed is not None
    assert renewed is not None
    assert renewed > claimed
    assert ended is None
    with Store(path) as store:
        assert store.run("1").state is RunState.DONE


def test_a_run_that_is_cancelled_gets_no_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The worker finds out, and goes on with the queue."""
    path = tmp_path / "zoo.db"
    _, ended = _leases(path, monkeypatch, lambda store: store.cancel([1]))
    assert ended is None
    with Store(path) as store:
        assert store.run("1").state is RunState.CANCELLED
