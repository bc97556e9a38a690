"""A pool of workers that does a set of runs; the one on this machine."""

import logging
import threading
import time
from collections.abc import Callable, Collection, Iterable, Sequence
from pathlib import Path
from typing import Any, Protocol, Self

from zoobench.cell.memory import share_among
from zoobench.db.lifecycle import why_lost
from zoobench.db.owner import Owner
from zoobench.db.rows import RunRow, RunState
from zoobench.db.silence import seconds_silent
from zoobench.db.store import Store
from zoobench.errors import UsageError
from zoobench.harness.interruption import Interruption
from zoobench.harness.process import CHILD_COMMAND, GRACE_SECONDS
from zoobench.harness.worker import WorkerOrders, settings_of_children, work

_LOG = logging.getLogger(__name__)

POLL_SECONDS = 0.5
_SILENT_SECONDS = 20.0  # without a renewed lease, until the user is told
_PATIENCE_SECONDS = GRACE_SECONDS + 5.0  # for workers to stop their children and hand their runs back


class WorkerPool(Protocol):
    """The workers of one `run_all`, wherever they are; leaving the context stops them, their runs resumable."""

    def __enter__(self) -> Self: ...

    def __exit__(self, *_: object) -> None: ...

    def is_elsewhere(self, row: RunRow) -> bool:
        """Whether the run is in the hands of a worker that is known not to be one of these."""

    def tell_of_silence(self, rows: Iterable[RunRow], database: str) -> None:
        """Say so, once, when nothing could be stored of the runs of these workers for long."""

    def wait(self, timeout: float) -> None:
        """Wait until a worker ends, if that can be told, `timeout` [s] at most."""

    def keep_at_work(self, count: int) -> None:
        """Replace workers that have ended, so that `count` are at work.

        Raises:
            ZoobenchError: a worker gave up, for the reason that the error tells.
        """


def run_all(
    location: str | Path,
    run_ids: Collection[int],
    *,
    jobs: int = 2,
    timeout: float | None = None,
    on_update: Callable[[list[RunRow]], None] | None = None,
    child: Sequence[str] = CHILD_COMMAND,
    engine: "Callable[[WorkerOrders], WorkerPool] | None" = None,
) -> list[RunRow]:
    """Do these runs with `jobs` workers and return them, ended, in the order of their ids.

    Args:
        location: path or URL of the database.
        run_ids: those that are queued are done; those that another `run` has in hand are waited for.
        timeout: wall time that one attempt may take [s].
        on_update: called about twice a second with the runs in progress and those whose state has changed, if there are
            any; the first time with all.
        child: the command that does one run.
        engine: makes the workers' pool; None for threads of this process.

    Raises:
        StorageFullError, StorageError: the database refuses; what is stored is safe and the runs can be resumed.
        KeyboardInterrupt: children are stopped and their runs are queued again before it goes on.
    """
    if jobs < 1:
        raise UsageError(f"{jobs} jobs do nothing. Give at least 1.")
    if timeout is not None and not timeout > 0:
        raise UsageError(f"A time limit of {timeout:g} s allows nothing. Give a positive one.")
    with Interruption() as interruption, Store(location, create=False) as store:
        sweep = store.begin_sweep(run_ids)
        orders = WorkerOrders(str(location), sweep, timeout, tuple(child))
        watch = store.watch(sweep)
        with (engine or _LocalPool)(orders) as pool:
            while True:
                interruption.check()
                rows = watch.look()
                if lost := [row.id for row in rows if row.state is RunState.RUNNING and why_lost(row)]:
                    store.recover(ids=lost)
                    rows = list({row.id: row for row in (*rows, *watch.look())}.values())
                if on_update is not None and rows:
                    on_update(rows)
                pool.tell_of_silence(rows, store.name)
                if not watch.open:
                    return store.runs(sweep=sweep)
                pool.keep_at_work(min(jobs, watch.open - sum(map(pool.is_elsewhere, rows))))
                pool.wait(POLL_SECONDS)


class _Worker(threading.Thread):
    """A thread that does runs until none is queued; `error` is what it met, if that ended it."""

    def __init__(self, orders: WorkerOrders, stop: threading.Event, ended: threading.Event) -> None:
        super().__init__(name="worker", daemon=True)  # the end of the process does not wait for a locked database
        self._orders, self._stop_asked, self._ended = orders, stop, ended
        self.error: BaseException | None = None

    def run(self) -> None:
        """Work."""
        try:
            with Store(self._orders.location, create=False) as store:
                work(store, self._orders, self._stop_asked)
        except BaseException as error:
            self.error = error
        self._ended.set()


class _LocalPool:
    """Workers on this machine, threads of this process.

    What they do is to wait for children and for the database. Leaving the context stops them all.
    """

    def __init__(self, orders: WorkerOrders) -> None:
        self._orders = orders
        self._workers: list[_Worker] = []
        self._stop, self._ended = threading.Event(), threading.Event()
        self._settings = settings_of_children()
        self._is_silent = False

    def __enter__(self) -> Self:
        self._settings.__enter__()
        return self

    def __exit__(self, *reason: Any) -> None:
        self._stop.set()
        try:
            deadline = time.monotonic() + _PATIENCE_SECONDS
            for worker in self._workers:
                worker.join(max(deadline - time.monotonic(), 0.0))
        finally:
            self._settings.__exit__(*reason)

    def is_elsewhere(self, row: RunRow) -> bool:
        """Whether the run is in the hands of a worker that is not one of these."""
        return row.state is RunState.RUNNING and not Owner.parse(row.owner or "").is_of_this_process

    def tell_of_silence(self, rows: Iterable[RunRow], database: str) -> None:
        """Say so, once, when nothing could be stored of the runs of these workers for long."""
        ours = [row for row in rows if row.state is RunState.RUNNING and not self.is_elsewhere(row)]
        silent = [seconds_silent(str(row.owner), row.lease_until) for row in ours]
        is_silent = max(silent, default=0.0) > _SILENT_SECONDS
        if is_silent and not self._is_silent:
            _LOG.warning(
                "Nothing could be stored for %.0f s: %s is locked by another zoobench or another program. Waiting.",
                _SILENT_SECONDS,
                database,
            )
        self._is_silent = is_silent

    def wait(self, timeout: float) -> None:
        """Wait until a worker ends, `timeout` [s] at most."""
        self._ended.wait(timeout)

    def keep_at_work(self, count: int) -> None:
        """Replace workers that found nothing to do, so that `count` are at work.

        Raises:
            StorageError: a worker gave up, as the database failed it.
        """
        self._ended.clear()
        for worker in self._workers:
            if worker.error is not None:
                raise worker.error
        self._workers = [worker for worker in self._workers if worker.is_alive()]
        if len(self._workers) < count:
            share_among(count)
        while len(self._workers) < count:
            self._workers.append(_Worker(self._orders, self._stop, self._ended))
            self._workers[-1].start()
