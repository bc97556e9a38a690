"""A worker: takes one run at a time from the queue and has it done in a child process, until the queue is empty."""

import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial

from zoobench.cell.memory import WORKERS_VARIABLE, allowed
from zoobench.db.owner import Owner
from zoobench.db.store import ClaimLostError, Store
from zoobench.harness.executor import Executor
from zoobench.harness.process import CHILD_COMMAND, StartedProcess
from zoobench.harness.provenance import THREAD_VARIABLES, gather, plugins_of
from zoobench.harness.supervise import Limits, supervise

_LOOK_SECONDS = 1.0  # between looks at a run that another worker seems to have left


@dataclass(frozen=True)
class WorkerOrders:
    """The orders of a worker.

    Attributes:
        sweep: the runs that it may take; None for all.
        timeout: of one attempt [s], None for no limit.
        child: the command that does runs.
        note: first line of the log of every attempt; empty for none.
    """

    location: str
    sweep: int | None = None
    timeout: float | None = None
    child: tuple[str, ...] = CHILD_COMMAND
    note: str = ""


@dataclass(frozen=True)
class Shift:
    """How long a worker works.

    Attributes:
        ask_at: when the run in hand is asked to stop at a checkpoint and no other is taken; of the monotonic clock [s].
        end_at: when it is stopped wherever it is; of the monotonic clock [s].
        runs: how many are taken at most; None for any number.
    """

    ask_at: float = float("inf")
    end_at: float = float("inf")
    runs: int | None = None


UNTIL_DONE = Shift()


def work(
    store: Store,
    orders: WorkerOrders,
    stop: threading.Event,
    shift: Shift = UNTIL_DONE,
    on_run: Callable[[int], None] = lambda _: None,
) -> None:
    """Do runs until none is queued, `stop` is set or the shift is over.

    `on_run` is called with the id of every run when it is taken, and when its attempt has ended.

    Raises:
        StorageError: the database refuses; the run in hand can be resumed.
    """
    limits = Limits(orders.timeout, allowed(), shift.ask_at, shift.end_at, orders.note)
    taken = 0
    with Executor(partial(StartedProcess, orders.child)) as executor:
        while not stop.is_set() and time.monotonic() < shift.ask_at and taken != shift.runs:
            store.recover(sweep=orders.sweep)
            # gathered anew for every run: its child is to have the code as it is then
            origin = gather()
            claim = store.claim(Owner.current(), provenance=origin, plugins=plugins_of, sweep=orders.sweep)
            if claim is None:
                if not store.has_overdue(orders.sweep):
                    return
                stop.wait(_LOOK_SECONDS)
                continue
            taken += 1
            on_run(claim.run_id)
            with suppress(ClaimLostError):  # somebody took this worker for dead, or cancelled the run
                supervise(store, claim, executor.child_for(claim, origin), stop=stop, limits=limits)
            on_run(claim.run_id)


@contextmanager
def settings_of_children() -> Iterator[None]:
    """What is set in the environment for children within; one thread each, as it is faster, and sums have one order."""
    before = {name: os.environ.get(name) for name in (*THREAD_VARIABLES, WORKERS_VARIABLE)}
    os.environ.update(dict.fromkeys(THREAD_VARIABLES, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name, None)
            if value is not None:
                os.environ[name] = value
