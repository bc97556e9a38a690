"""A child process that does something odd in the run with seed 0, `bad_child.py ODDITY`, and is well otherwise."""

import math
import os
import subprocess
import sys
from contextlib import suppress
from typing import Any

from zoobench.harness.child import ChildContext, RunOutcome, serve
from zoobench.spec import RunSpec

SLEEP = (sys.executable, "-c", "import time; time.sleep(600)")


def solve(spec: RunSpec, context: ChildContext) -> RunOutcome:
    """A run with one iteration."""
    context.report(1, position=1.0)
    if spec.seed == 0:
        ODDITIES[sys.argv[1]](context)
    is_nan = spec.seed == 0 and sys.argv[1] == "nan-params"
    return RunOutcome([("score", 1.0, "m")], [math.nan if is_nan else 1.0])


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
    for _ in range(256):
        os.write(2, b"x" * (1 << 20))


def _flood_lines(context: ChildContext) -> None:
    """200 MB of short lines."""
    for _ in range(200):
        os.write(2, b"a line of twenty b.\n" * 50_000)
    os.write(2, b"the last line\n")


def _close_standard_input(context: ChildContext) -> None:
    sys.stdin.close()
    with suppress(OSError):
        os.close(0)


def _nest(context: ChildContext) -> None:
    os.write(context._wire._stream.fileno(), b'{"type":"metric","step":' + b"[" * 200_000 + b"\n")


ODDITIES: dict[str, Any] = {
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
