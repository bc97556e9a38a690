"""A child process that does something odd in the first runs, `bad_child.py ODDITY...`, and is well otherwise.

The run with seed 0 does the first oddity, that with seed 1 the second, and so on.

A result of each run is the number of its process.
"""

import _thread
import ctypes
import math
import os
import random
import signal
import subprocess
import sys
import time
from contextlib import suppress
from typing import Any

import numpy as np

from zoobench.harness import child
from zoobench.harness.child import ChildContext, RunOutcome, serve
from zoobench.spec import RunSpec

SLEEP = (sys.executable, "-c", "import time; time.sleep(600)")


def solve(spec: RunSpec, context: ChildContext) -> RunOutcome:
    """A run with one iteration."""
    os.write(2, f"run {spec.seed}\nbegins\n".encode())
    context.report(1, position=1.0)
    if sys.argv[1] == "draws" and "ODD" not in os.environ:
        os.environ.update(ODD="1")
        print(random.random(), np.random.random(), flush=True)
    oddity = dict(enumerate(sys.argv[1:])).get(spec.seed, "none")
    ODDITIES[oddity](context)
    is_nan = oddity == "nan-params"
    finals = [("score", 1.0, "m"), ("process", float(os.getpid()), "")]
    return RunOutcome(finals, [math.nan if is_nan else 1.0])


def _leave_a_process(context: ChildContext) -> None:
    print(f"left {subprocess.Popen(SLEEP).pid}", file=sys.stderr)


def _leave_sessions(context: ChildContext) -> None:
    """Processes in sessions of their own, whose parent is gone: as what runs in the background does."""
    start = "import subprocess as s, sys; print(s.Popen(sys.argv[1:], stdout=2, start_new_session=True).pid)"
    for _ in range(3):
        done = subprocess.run((sys.executable, "-c", start, *SLEEP), stdout=subprocess.PIPE, text=True, check=True)
        print(f"left {done.stdout.strip()}", file=sys.stderr, flush=True)


def _leave_sessions_and_die(context: ChildContext) -> None:
    _leave_sessions(context)
    os.abort()


def _leave_a_process_and_die(context: ChildContext) -> None:
    _leave_a_process(context)
    sys.stderr.flush()
    os.abort()


def _flood(context: ChildContext) -> None:
    for _ in range(128):
        os.write(2, b"x" * (1 << 20))


def _flood_lines(context: ChildContext) -> None:
    """20 MB of short lines."""
    for _ in range(20):
        os.write(2, b"a line of twenty b.\n" * 50_000)
    os.write(2, b"the last line\n")


def _close_standard_input(context: ChildContext) -> None:
    sys.stdin.close()
    with suppress(OSError):
        os.close(0)


def _nest(context: ChildContext) -> None:
    os.write(context._wire._stream.fileno(), b'{"type":"metric","step":' + b"[" * 200_000 + b"\n")


def _print_without_end(context: ChildContext) -> None:
    """A line longer than is kept, and two that wait in buffers of Python and of a library."""
    ctypes.CDLL(None).printf(b"by a library")
    sys.stdout.write("x" * (1 << 20) + "\n")
    sys.stdout.write("by Python\n")


def _fail(context: ChildContext) -> None:
    raise ValueError


def _grow(context: ChildContext) -> None:
    KEPT.append(np.ones(20 << 20))


KEPT: list[Any] = []
ODDITIES: dict[str, Any] = {
    "none": lambda context: None,
    "draws": lambda context: None,
    "prints": _print_without_end,
    "fails": _fail,
    "is-foreign": lambda context: setattr(child, "plugins_of", lambda _: {"method odd-v1": {}}),
    "is-full": lambda context: setattr(child, "_MOST_RUNS", 1),
    "grows": _grow,
    "leaves-a-thread": lambda context: _thread.start_new_thread(lambda: time.sleep(600.0), ()),
    "goes-away": lambda context: os.chdir("/"),
    "sets-the-path": lambda context: sys.path.append("odd"),
    "closes-output": lambda context: sys.stdout.close(),
    "redirects-output": lambda context: os.dup2(os.open(os.devnull, os.O_WRONLY), 2),
    "replaces-output": lambda context: setattr(sys, "stdout", sys.stderr),
    "sets-a-signal": lambda context: signal.signal(signal.SIGUSR1, signal.SIG_IGN),
    "ignores-errors": lambda context: np.seterr(all="ignore"),
    "nan-progress": lambda context: context.progress(math.nan, None),
    "large-step": lambda context: context.report(2**70, position=1.0),
    "nested": _nest,
    "nan-params": lambda context: None,
    "leaves": _leave_a_process,
    "leaves-and-dies": _leave_a_process_and_die,
    "leaves-sessions": _leave_sessions,
    "leaves-sessions-and-dies": _leave_sessions_and_die,
    "flood": _flood,
    "flood-of-lines": _flood_lines,
    "closes-input": _close_standard_input,
}

if __name__ == "__main__":
    serve(solve)
