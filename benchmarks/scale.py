"""Time and memory of the commands that read a large database; prints a table.

`python -m tests.large large.db` makes the database, `python -m benchmarks.scale large.db` measures.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from statistics import median
from typing import NamedTuple

_CELL = ("--env", "ice", "--task", "turning", "--design", "fish", "--method", "random", "--fidelity", "draft")
_PLAN = ("--env", "ice", "--task", "turning", "--design", "fish", "--method", "random", "--seeds", "2,3,4,5",
         "--budget", "60000")  # fmt: skip
_COMMANDS = {
    "table": ["table"],
    "table of one environment": ["table", "--env", "ice"],
    "table of a suite": ["leaderboard", "show", "gaits"],
    "run --dry-run of 4 runs": ["run", "--dry-run", *_PLAN],
    "results of one cell": ["results", *_CELL],
    "curves of one cell": ["curves", *_CELL],
    "doctor": ["doctor"],
    "results of all as CSV": ["results", "--format", "csv"],
    "status": ["status"],
}
_POLLS = 50
_RUNNING = 4  # runs of the sweep that are in progress
_OTHERS = 20_000  # ids of the sweep that is polled come after so many runs


class Cost(NamedTuple):
    """Wall and processor time [s] and peak memory [bytes] of a command, and its exit code."""

    wall: float
    cpu: float
    memory: int
    code: int


def measure(words: list[str], limit: float) -> Cost:
    """Run a command line of zoobench in a process of its own; it is ended after `limit` [s]."""
    begin = time.monotonic()
    child = subprocess.Popen(
        ["timeout", f"{limit}", sys.executable, "-m", "zoobench", *words],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    _, status, used = os.wait4(child.pid, 0)
    return Cost(
        time.monotonic() - begin,
        used.ru_utime + used.ru_stime,
        used.ru_maxrss * 1024,
        os.waitstatus_to_exitcode(status),
    )


def poll(location: str, count: int) -> Iterator[tuple[str, float]]:
    """Processor times of a launcher's look at a sweep [s]: the first, and the median of those that follow."""
    from zoobench.db.owner import Owner
    from zoobench.db.store import Store

    with Store(location, create=False) as store:
        sweep = store.begin_sweep(range(_OTHERS, _OTHERS + count))
        for _ in range(_RUNNING):
            store.claim(Owner.current(), provenance={}, sweep=sweep)
        watch = store.watch(sweep)
        times = []
        for _ in range(_POLLS):
            begin = time.process_time()
            watch.look()
            times.append(time.process_time() - begin)
    yield f"first look at a sweep of {count:,} runs, CPU", times[0]
    yield f"poll of a sweep of {count:,} runs, CPU", median(times[1:])


def queue(count: int) -> Iterator[tuple[str, float]]:
    """Times of queueing [s]: all of it, and the longest time that another had to wait for the database meanwhile."""
    from tests.large import specs
    from zoobench.db.store import Store

    wanted = list(islice(specs(), count))
    with tempfile.TemporaryDirectory() as folder:
        location = str(Path(folder) / "queue.db")
        with (
            Store(location) as store,
            subprocess.Popen(
                [sys.executable, "-c", _PROBE, location], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
            ) as other,
        ):
            assert other.stdout is not None
            other.stdout.readline()
            begin = time.perf_counter()
            store.enqueue(wanted)
            whole = time.perf_counter() - begin
            told, _ = other.communicate()
    yield f"queueing {count:,} runs", whole
    yield "  longest wait of another writer meanwhile", float(told)


_PROBE = """
import select, sys, time
from zoobench.db.store import Store
store, longest = Store(sys.argv[1]), 0.0
print("ready", flush=True)
while not select.select([sys.stdin], [], [], 0.01)[0]:
    begin = time.perf_counter()
    with store._database.write() as session:
        session.connection()
    longest = max(longest, time.perf_counter() - begin)
print(longest)
"""


def main() -> None:
    """Read the command line, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file")
    parser.add_argument("--only", default="", help="commands whose names contain this")
    parser.add_argument("--limit", type=float, default=120.0, help="longest time of a command [s]")
    given = parser.parse_args()
    print(f"{'command':<45} {'wall [s]':>9} {'CPU [s]':>9} {'peak [MB]':>9}")
    for name, words in _COMMANDS.items():
        if given.only in name:
            found = measure([*words, "--db", given.file], given.limit)
            note = f"  exit code {found.code}" if found.code else ""
            print(f"{name:<45} {found.wall:9.2f} {found.cpu:9.2f} {found.memory / 1e6:9.0f}{note}", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        copy = str(Path(folder) / "copy.db")
        if given.only in "poll":
            shutil.copy(given.file, copy)
            for name, seconds in poll(copy, 10_000):
                print(f"{name:<45} {seconds:9.4f}", flush=True)
    for count in (10_000, 100_000):
        if given.only in "queueing":
            for name, seconds in queue(count):
                print(f"{name:<45} {seconds:9.2f}", flush=True)


if __name__ == "__main__":
    main()
