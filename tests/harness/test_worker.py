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


def _work(path: Path, monkeypatch: pytest.MonkeyPatch, meanwhile: Callable[[Store], None]) -> RunState:
    """The state of a run after a worker has waited long for its process."""

    def begin(command: Any, requests: Any, spec: Any, is_wanted: Callable[[], bool]) -> Process:
        with Store(path) as other:
            meanwhile(other)
            assert is_wanted()
        return start(command)

    monkeypatch.setattr(worker, "_RENEW_SECONDS", 0.0)
    monkeypatch.setattr(worker, "start", begin)
    enqueue(path)
    with Store(path) as store:
        work(store, WorkerOrders(str(path), child=fake()), threading.Event())
        return store.run("1").state


def test_the_lease_is_renewed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Compiling kernels may take longer than a lease."""
    leases: list[float | None] = []

    def note(store: Store) -> None:
        leases.append(store.run("1").lease_until)

    real = Store.commit

    def commit(store: Store, *arguments: Any) -> None:
        real(store, *arguments)
        note(store)

    monkeypatch.setattr(Store, "commit", commit)
    assert _work(tmp_path / "zoo.db", monkeypatch, note) is RunState.DONE
    claimed, renewed, *_ = leases
    assert claimed is not None
    assert renewed is not None
    assert renewed > claimed


def test_a_run_that_is_cancelled_gets_no_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The worker finds out, and goes on with the queue."""
    assert _work(tmp_path / "zoo.db", monkeypatch, lambda store: store.cancel([1]) and None) is RunState.CANCELLED
