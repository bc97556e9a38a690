"""A pool of workers that does a set of runs; the one on this machine."""

import json
import logging
import subprocess
import sys
import time
from collections.abc import Callable, Collection, Iterable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import replace
from multiprocessing import connection
from pathlib import Path
from typing import Protocol, Self

from zoobench import errors
from zoobench.cell.memory import shared_among
from zoobench.db.lifecycle import LEASE_SECONDS, why_lost
from zoobench.db.owner import Owner
from zoobench.db.rows import RunRow, RunState
from zoobench.db.store import Store
from zoobench.errors import StorageError, UsageError, ZoobenchError
from zoobench.harness.fork_server import ForkServer, can_fork
from zoobench.harness.interruption import Interruption
from zoobench.harness.process import CHILD_COMMAND, GRACE_SECONDS
from zoobench.harness.worker import WorkerOrders

_LOG = logging.getLogger(__name__)

POLL_SECONDS = 0.5
_WORKER_COMMAND = (sys.executable, "-m", "zoobench.harness.worker")
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
        engine: makes the workers' pool; None for processes of this machine.

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


class _Worker:
    def __init__(self, orders: WorkerOrders, workers: int) -> None:
        # A session of its own, so that Ctrl-C reaches `run` alone, which then stops its workers in order.
        self.process = subprocess.Popen(
            _WORKER_COMMAND,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,
            pass_fds=() if orders.requests is None else (orders.requests,),
            env=shared_among(workers),
        )
        assert self.process.stdin is not None
        with suppress(OSError):
            self.process.stdin.write(orders.to_json().encode() + b"\n")
            self.process.stdin.flush()

    def ask_to_stop(self) -> None:
        assert self.process.stdin is not None
        with suppress(OSError):
            self.process.stdin.close()

    def error(self) -> ZoobenchError | None:
        """The reason why an ended worker gave up; None if it was killed: then another takes its place."""
        code = self.process.poll()
        if not code or code < 0:
            return None
        said, trace = (text.decode(errors="replace").strip() for text in self.process.communicate())
        if said:
            told = json.loads(said.splitlines()[-1])
            return _rebuild(told["error"], told["message"])
        return ZoobenchError(f"A worker ended with exit code {code}. Please report this:\n{trace}")

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        for stream in (self.process.stdin, self.process.stdout, self.process.stderr):
            assert stream is not None
            with suppress(OSError):
                stream.close()


class _LocalPool:
    """Workers on this machine, and the fork server of their children; leaving the context stops them all."""

    def __init__(self, orders: WorkerOrders) -> None:
        self._orders = orders
        self._workers: list[_Worker] = []
        self._server = ExitStack()
        self._is_silent = False

    def __enter__(self) -> Self:
        if self._orders.child == CHILD_COMMAND and can_fork():
            server = self._server.enter_context(ForkServer())
            self._orders = replace(self._orders, requests=server.requests.fileno())
        return self

    def __exit__(self, *_: object) -> None:
        try:
            deadline = time.monotonic() + _PATIENCE_SECONDS
            for worker in self._workers:
                worker.ask_to_stop()
            for worker in self._workers:
                with suppress(subprocess.TimeoutExpired):
                    worker.process.wait(timeout=max(deadline - time.monotonic(), 0.0))
        finally:
            _close(self._workers)
            self._server.close()

    def is_elsewhere(self, row: RunRow) -> bool:
        """Whether the run is in the hands of a worker that is not one of these."""
        if row.state is not RunState.RUNNING or row.owner is None:
            return False
        owner = Owner.parse(row.owner)
        return not (owner.is_here and owner.pid in {worker.process.pid for worker in self._workers})

    def tell_of_silence(self, rows: Iterable[RunRow], database: str) -> None:
        """Say so, once, when nothing could be stored of the runs of these workers for long."""
        ours = [row for row in rows if row.state is RunState.RUNNING and not self.is_elsewhere(row)]
        renewed = [row.lease_until - LEASE_SECONDS for row in ours if row.lease_until is not None]
        is_silent = bool(renewed) and time.time() - min(renewed) > _SILENT_SECONDS
        if is_silent and not self._is_silent:
            _LOG.warning(
                "Nothing could be stored for %.0f s: %s is locked by another zoobench or another program. Waiting.",
                _SILENT_SECONDS,
                database,
            )
        self._is_silent = is_silent

    def wait(self, timeout: float) -> None:
        """Wait until a worker ends, which closes its output, `timeout` [s] at most."""
        outputs = [worker.process.stdout.fileno() for worker in self._workers if worker.process.stdout]
        if outputs:
            connection.wait(outputs, timeout)
        else:
            time.sleep(timeout)

    def keep_at_work(self, count: int) -> None:
        """Replace workers that were killed, so that `count` are at work.

        Raises:
            ZoobenchError: a worker gave up, for the reason that the error tells.
        """
        ended = [worker for worker in self._workers if worker.process.poll() is not None]
        reasons = [reason for worker in ended if (reason := worker.error()) is not None]
        _close(ended)
        self._workers = [worker for worker in self._workers if worker not in ended]
        if reasons:
            raise reasons[0]
        while len(self._workers) < count:
            self._workers.append(_Worker(self._orders, count))


def _close(workers: Iterable[_Worker]) -> None:
    for worker in workers:
        worker.close()


def _rebuild(name: str, message: str) -> ZoobenchError:
    """The error that a worker met, as this process's own."""
    kind = getattr(errors, name, None)
    if isinstance(kind, type) and issubclass(kind, StorageError):
        return kind(message)
    return ZoobenchError(message)
