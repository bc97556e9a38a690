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
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Self

from zoobench.db.owner import Owner
from zoobench.db.store import ClaimLostError, Store
from zoobench.errors import ZoobenchError
from zoobench.harness.lifeline import Lifeline
from zoobench.harness.process import CHILD_COMMAND
from zoobench.harness.provenance import THREAD_VARIABLES, gather


@dataclass(frozen=True)
class WorkerOrders:
    """The orders of a worker.

    Attributes:
        sweep: the runs that it may take; None for all.
        timeout: of one attempt [s], None for no limit.
        child: the command that does a run.
        requests: descriptor of the socket to a fork server; None without.
    """

    location: str
    sweep: int | None = None
    timeout: float | None = None
    child: tuple[str, ...] = CHILD_COMMAND
    requests: int | None = None

    def to_json(self) -> str:
        """One line of text."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: bytes) -> Self:
        """The inverse of `to_json`."""
        data: Mapping[str, Any] = json.loads(text)
        return cls(data["location"], data["sweep"], data["timeout"], tuple(data["child"]), data["requests"])


def work(store: Store, orders: WorkerOrders, stop: threading.Event) -> None:
    """Do runs until none is queued or `stop` is set.

    Raises:
        StorageError: the database refuses; the run in hand can be resumed.
    """
    from zoobench.harness.supervise import supervise  # loads what the launcher need not have

    requests = None if orders.requests is None else socket.socket(fileno=orders.requests)
    while not stop.is_set():
        store.recover(sweep=orders.sweep)
        # Gathered anew for every run: its child imports the code as it is then, not as it was when this worker began.
        claim = store.claim(Owner.current(), provenance=gather(), sweep=orders.sweep)
        if claim is None:
            return
        try:
            supervise(store, claim, orders.child, timeout=orders.timeout, stop=stop, requests=requests)
        except ClaimLostError:
            continue  # somebody took this worker for dead, and the run is in other hands


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
