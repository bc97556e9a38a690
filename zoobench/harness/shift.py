"""A worker in this process, as a batch job or a container needs it: for some time, and until it is asked to stop."""

import signal
import threading
import time
from collections.abc import Callable

from zoobench.db.store import Store
from zoobench.errors import UsageError
from zoobench.harness.worker import Shift, WorkerOrders, settings_of_children, work

_MARGIN_SECONDS = 60.0  # before the end, for the run in hand to reach a checkpoint, but no more than the share
_MARGIN_SHARE = 0.2
_EXIT_SECONDS = 2.0  # after the end of the run in hand, to store it and to end


def shift_of(seconds: float | None, runs: int | None = None) -> Shift:
    """A shift that begins now, of so many seconds and runs at most; None for no limit."""
    if seconds is None:
        return Shift(runs=runs)
    end_at = time.monotonic() + max(seconds - _EXIT_SECONDS, 0.0)
    return Shift(end_at - min(_MARGIN_SECONDS, _MARGIN_SHARE * seconds), end_at, runs)


def work_shift(orders: WorkerOrders, shift: Shift, on_run: Callable[[Store, int], None] = lambda *_: None) -> bool:
    """Do runs in child processes until none is queued, the shift is over, or SIGTERM or Ctrl-C asks for the end.

    Whether it was asked; then the run in hand is queued again and goes on from its checkpoint. `on_run` is called with
    the id of every run when it is taken, and when its attempt has ended.

    Raises:
        UsageError: there is no such sweep.
        StorageError: the database refuses; the run in hand can be resumed.
    """
    stop = threading.Event()
    before = {number: signal.signal(number, lambda *_: stop.set()) for number in (signal.SIGTERM, signal.SIGINT)}
    try:
        with settings_of_children(), Store(orders.location, create=False) as store:
            if orders.sweep is not None and not store.runs(sweep=orders.sweep):
                raise UsageError(f"There is no sweep {orders.sweep} here. `zoobench run --no-wait` prints its number.")
            work(store, orders, stop, shift, lambda run_id: on_run(store, run_id))
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    return stop.is_set()
