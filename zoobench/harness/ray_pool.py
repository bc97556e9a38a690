"""Runs on a cluster of Ray: it finds a place for each, and this process alone writes the database; the extra `ray`.

A place is an actor on a node that starts child processes there and passes their streams on. A thread of this process
claims a run for each place and supervises it as if the child were here. With a node its places are lost: their runs
are queued again, and go on from their checkpoints in new places.
"""

import os
import queue
import sys
import threading
import time
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import IO, Any, Self

from zoobench.cell.memory import allowed, memory_of
from zoobench.db.lifecycle import why_lost
from zoobench.db.owner import Owner
from zoobench.db.rows import Batch, Ending, RunRow, RunState
from zoobench.db.store import ClaimLostError, Store
from zoobench.errors import UsageError, ZoobenchError
from zoobench.harness.executor import Executor
from zoobench.harness.process import StartedProcess
from zoobench.harness.provenance import THREAD_VARIABLES, gather, plugins_of, sources
from zoobench.harness.supervise import Limits, supervise
from zoobench.harness.worker import WorkerOrders

_CHUNK = 1 << 16
_READ_SECONDS = 0.5  # that a place waits for output before it says that there is none
_LOST = -9  # exit code of a process whose node is gone


class Place:
    """An actor: it does one run after the other in child processes of its node."""

    def __init__(self) -> None:
        os.environ.update(dict.fromkeys(THREAD_VARIABLES, "1"))
        self._process: StartedProcess | None = None
        self._output: queue.Queue[tuple[int, bytes]] = queue.Queue(100)

    def origin(self) -> tuple[dict[str, Any], str]:
        """Provenance of what is computed here, and the hash of the code."""
        return gather(), sources()

    def start(self, command: Sequence[str]) -> None:
        """Start a child, which dies with this place."""
        self._output = queue.Queue(100)
        self._process = StartedProcess((sys.executable, *command[1:]))
        for number, stream in ((1, self._process.stdout), (2, self._process.stderr)):
            threading.Thread(target=_pump, args=(stream, number, self._output), daemon=True).start()

    def read(self) -> list[tuple[int, bytes]]:
        """What the child has said since: number of the stream and bytes, none at its end."""
        found = []
        try:
            found.append(self._output.get(timeout=_READ_SECONDS))
            while len(found) < 100:
                found.append(self._output.get_nowait())
        except queue.Empty:
            pass
        return found

    def write(self, data: bytes) -> None:
        """Tell the child; one that is dead does not hear it."""
        assert self._process is not None
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(data)
            self._process.stdin.flush()
        except OSError:
            return

    def close_input(self) -> None:
        """Tell the child that there will be no other run: it ends by itself."""
        assert self._process is not None
        assert self._process.stdin is not None
        with suppress(OSError):
            self._process.stdin.close()

    def kill(self) -> None:
        """End the child and its group."""
        if self._process is not None:
            self._process.kill()

    def wait(self) -> int:
        """Its exit code, or minus the number of the signal that killed it."""
        assert self._process is not None
        return self._process.wait()

    def memory(self) -> int:
        """Resident memory of the child and its descendants [bytes]."""
        return 0 if self._process is None else memory_of(self._process.pid)


def _pump(stream: IO[bytes], number: int, output: "queue.Queue[tuple[int, bytes]]") -> None:
    while chunk := stream.read1(_CHUNK):  # type: ignore[attr-defined]  # a buffered pipe
        output.put((number, chunk))
    output.put((number, b""))


class _Input:
    """The standard input of a child in a place."""

    def __init__(self, place: Any) -> None:
        self._place = place

    def write(self, data: bytes) -> None:
        self._place.write.remote(data)

    def flush(self) -> None:
        """Nothing is held back."""

    def close(self) -> None:
        """There is no more to tell."""
        self._place.close_input.remote()


class PlacedProcess:
    """A child in a place, as `zoobench.harness.process.Process`.

    Raises:
        RayError: the place is gone.
    """

    def __init__(self, place: Any, command: Sequence[str]) -> None:
        import ray

        self._place = place
        ray.get(place.start.remote(list(command)))
        self.stdin: Any = _Input(place)
        ends = [os.pipe() for _ in range(2)]
        self.stdout: IO[bytes] | None = os.fdopen(ends[0][0], "rb")
        self.stderr: IO[bytes] | None = os.fdopen(ends[1][0], "rb")
        self._writers = {1: os.fdopen(ends[0][1], "wb", 0), 2: os.fdopen(ends[1][1], "wb", 0)}
        self._code: int | None = None
        self.died_alone = True
        self._ended = threading.Event()
        threading.Thread(target=self._relay, daemon=True).start()

    def kill(self) -> None:
        """End it now, if it still runs."""
        if not self._ended.is_set():
            self._place.kill.remote()

    def wait(self) -> int:
        """Its exit code, or minus the number of the signal that killed it, -9 if its node is gone."""
        self._ended.wait()
        assert self._code is not None
        return self._code

    def memory(self) -> int:
        """Resident memory of it and its descendants [bytes]; 0 if it or its node is gone."""
        import ray

        try:
            return 0 if self._ended.is_set() else int(ray.get(self._place.memory.remote()))
        except ray.exceptions.RayError:
            return 0

    def _relay(self) -> None:
        import ray

        try:
            while self._writers:
                for number, chunk in ray.get(self._place.read.remote()):
                    self._pass_on(number, chunk)
            self._code = int(ray.get(self._place.wait.remote()))
        except ray.exceptions.RayError:
            self._code, self.died_alone = _LOST, False
            if 2 in self._writers:
                self._pass_on(2, b"The node of this process, or its place there, is gone.\n")
        for number in list(self._writers):
            self._pass_on(number, b"")
        self._ended.set()

    def _pass_on(self, number: int, chunk: bytes) -> None:
        if chunk:
            try:
                self._writers[number].write(chunk)
            except OSError:  # nobody reads any more
                return
        else:
            self._writers.pop(number).close()


def resources(limit: int | None, expected: int | None, nodes: Iterable[Mapping[str, float]]) -> dict[str, int]:
    """What a place asks Ray for: a processor, and the memory that a run may take, or else is expected to.

    Args:
        limit, expected: [bytes]; None if there is none. An expectation is no reason to refuse: a place asks for no more
            than the largest node has.
        nodes: the resources of each.

    Raises:
        UsageError: no node has what a run may take; Ray would wait for one for ever.
    """
    largest = int(max((node.get("memory", 0.0) for node in nodes), default=0.0))
    if limit is not None and limit > largest:
        raise UsageError(
            f"A run may take {limit / 2**30:.2g} GiB by --memory, and the largest node of the Ray cluster offers "
            f"{largest / 2**30:.2g}. Allow less, or add a node."
        )
    memory = min(expected or 0, largest) if limit is None else limit
    return {"num_cpus": 1, **({"memory": memory} if memory else {})}


@dataclass
class _Slot:
    thread: threading.Thread
    error: ZoobenchError | None = None


class RayPool:
    """The places of one `run_all`, as its worker pool; leaving the context hands their runs back.

    Args:
        orders: of the workers.
        address: of a cluster; empty for that of this machine or a new one for the occasion.
        memory: what a run is expected to take [bytes], where no limit is set; None if that is not known.

    Raises:
        UsageError: there is no such cluster, or none of its nodes has the memory that runs may take.
    """

    def __init__(self, orders: WorkerOrders, address: str = "", memory: int | None = None) -> None:
        import ray

        self._ray, self._orders = ray, orders
        self._stop = threading.Event()
        self._slots: list[_Slot] = []
        self._is_ours = not ray.is_initialized()
        if self._is_ours:
            try:
                ray.init(address=address or None, log_to_driver=False, include_dashboard=False if not address else None)
            except (ConnectionError, ValueError) as error:
                raise UsageError(f"No Ray cluster answers at {address!r}: {error}") from None
        try:
            list_nodes: Any = ray.nodes  # has no types
            nodes = (node["Resources"] for node in list_nodes() if node["Alive"])
            self._resources = resources(allowed(), memory, nodes)
        except UsageError:
            self.__exit__()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        for slot in self._slots:
            slot.thread.join()
        if self._is_ours:
            self._ray.shutdown()

    def is_elsewhere(self, row: RunRow) -> bool:
        """Whether the run is in the hands of another process."""
        is_ours = Owner.parse(row.owner or "").is_of_this_process
        return row.state is RunState.RUNNING and not is_ours and why_lost(row) is None

    def tell_of_silence(self, rows: Iterable[RunRow], database: str) -> None:
        """Nothing: this process writes, and notices itself."""

    def wait(self, timeout: float) -> None:
        """Wait so long [s]."""
        time.sleep(timeout)

    def keep_at_work(self, count: int) -> None:
        """See that there are `count` slots.

        Raises:
            ZoobenchError: one of them gave up.
        """
        for slot in self._slots:
            if slot.error is not None:
                raise slot.error
        self._slots = [slot for slot in self._slots if slot.thread.is_alive()]
        for _ in range(count - len(self._slots)):
            slot = _Slot(threading.Thread())
            slot.thread = threading.Thread(target=self._fill, args=(slot,), daemon=True)
            self._slots.append(slot)
            slot.thread.start()

    def _fill(self, slot: _Slot) -> None:
        """Do runs in one place after the other until none is queued."""
        try:
            with Store(self._orders.location, create=False) as store:
                while self._work_in_place(store):
                    pass
        except ZoobenchError as error:
            slot.error = error

    def _work_in_place(self, store: Store) -> bool:
        """Do runs in a place until none is queued; True if the place is lost before."""
        place: Any = self._ray.remote(Place).options(max_concurrency=8, **self._resources).remote()
        try:
            asked = place.origin.remote()
            while not self._ray.wait([asked], timeout=_READ_SECONDS)[0]:  # the cluster may be full
                if self._stop.is_set():
                    return False
            with Executor(partial(PlacedProcess, place, self._orders.child)) as executor:
                return self._do_runs(store, place, executor)
        except self._ray.exceptions.RayError:
            return not self._stop.is_set()
        finally:
            self._ray.kill(place)

    def _do_runs(self, store: Store, place: Any, executor: Executor) -> bool:
        """Do runs until none is queued; True if the place is lost before."""
        while not self._stop.is_set():
            origin, code = self._ray.get(place.origin.remote())
            if code != sources():
                raise UsageError(f"{origin['host']} has another zoobench than this machine. Install the same one.")
            claim = store.claim(Owner.current(), provenance=origin, plugins=plugins_of, sweep=self._orders.sweep)
            if claim is None:
                return False
            limits = Limits(self._orders.timeout, allowed(), note=f"In a place of Ray on {origin['host']}.")
            try:
                supervise(store, claim, executor.child_for(claim, origin), stop=self._stop, limits=limits)
            except ClaimLostError:
                continue  # it was cancelled
            except self._ray.exceptions.RayError:  # before the child had begun
                store.finish(claim, Ending(RunState.LOST, "Its node was lost."), Batch())
                return True
        return False
