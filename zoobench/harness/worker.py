"""A worker: takes one run at a time from the queue and does it in a child process, until the queue is empty.

`python -m zoobench.harness.worker` reads its orders, a `WorkerOrders` as JSON, from the first line of standard
input and stops, its runs resumable, when that is closed. If the database fails it, it says so in one JSON line.
"""

import json
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any, Self

from zoobench import registry
from zoobench.cell.memory import allowed
from zoobench.db.owner import Owner
from zoobench.db.store import ClaimLostError, Store
from zoobench.errors import ZoobenchError
from zoobench.harness.lifeline import Lifeline
from zoobench.harness.process import CHILD_COMMAND
from zoobench.harness.provenance import THREAD_VARIABLES, gather, plugins_of
from zoobench.inputs import named_runs
from zoobench.spec import RunSpec


@dataclass(frozen=True)
class WorkerOrders:
    """The orders of a worker.

    Attributes:
        sweep: the runs that it may take; None for all.
        timeout: of one attempt [s], None for no limit.
        child: the command that does a run.
        requests: descriptor of the socket to a fork server; None without.
        note: first line of the log of every attempt; empty for none.
    """

    location: str
    sweep: int | None = None
    timeout: float | None = None
    child: tuple[str, ...] = CHILD_COMMAND
    requests: int | None = None
    note: str = ""

    def to_json(self) -> str:
        """One line of text."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: bytes) -> Self:
        """The inverse of `to_json`."""
        data: Mapping[str, Any] = json.loads(text)
        return cls(**{**data, "child": tuple(data["child"])})


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
    from zoobench.harness.process import start
    from zoobench.harness.supervise import Limits, supervise  # loads what the launcher need not have

    requests = None if orders.requests is None else socket.socket(fileno=orders.requests)
    limits = Limits(orders.timeout, allowed(), shift.ask_at, shift.end_at, orders.note)
    taken = 0
    while not stop.is_set() and time.monotonic() < shift.ask_at and taken != shift.runs:
        store.recover(sweep=orders.sweep)
        # Gathered anew for every run: its child imports the code as it is then, not as it was when this worker began.
        claim = store.claim(Owner.current(), provenance=gather(), plugins=plugins_of, sweep=orders.sweep)
        if claim is None:
            return
        taken += 1
        on_run(claim.run_id)
        spec = claim.spec if orders.child == CHILD_COMMAND and _may_share_kernels(claim.spec) else None
        begin = partial(start, orders.child, requests, spec, lambda: not stop.is_set())
        with suppress(ClaimLostError):  # somebody took this worker for dead, or cancelled the run
            supervise(store, claim, begin, stop=stop, limits=limits)
        on_run(claim.run_id)


def _may_share_kernels(spec: RunSpec) -> bool:
    """Whether a run's kernels may be loaded for others, too: not if it needs more than its spec, nor beside plug-ins.

    These may do to a process what they like, and so before kernels are loaded.
    """
    return not (registry.has_plugins() or named_runs(spec.design, spec.controller, spec.method))


def main() -> int:
    """Read the orders and work; the exit code is that of the error, if any."""
    lifeline = Lifeline()
    line = lifeline.line()
    if line is None:
        return 0
    orders = WorkerOrders.from_json(line)
    stop = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: stop.set())
    lifeline.watch(on_line=lambda _: None, on_end=stop.set)
    # One thread for each child: both faster and reproducible, as sums are added in one order.
    os.environ.update(dict.fromkeys(THREAD_VARIABLES, "1"))
    try:
        with Store(orders.location, create=False) as store:
            work(store, orders, stop)
    except ZoobenchError as error:
        print(json.dumps({"error": type(error).__name__, "message": str(error)}), flush=True)
        return error.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main())
