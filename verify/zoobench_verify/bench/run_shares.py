"""Where the processor time of `zoobench run` goes, all its processes together."""

import json
import os
import shlex
import subprocess
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from zoobench.errors import UsageError, ZoobenchError
from zoobench.sim.launch_clock import VARIABLE


@dataclass(frozen=True)
class RunShare:
    """Where the processor time of `zoobench run` goes: of all its processes together [s].

    Attributes:
        command: the options of the run.
        processes: that have simulated.
        cpu_s, wall_s: of the command, from its start to its end.
        advance_s, reverse_s, survey_s: inside these kernels.
        launching_s: cost of the launches themselves; that of surveys is not known apart and is in `survey_s`.
        loading_s: loading kernels from the cache, or compiling them.
        rest_s: everything else.
    """

    command: str
    processes: int
    cpu_s: float
    wall_s: float
    advance_s: float
    reverse_s: float
    survey_s: float
    launching_s: float
    loading_s: float
    rest_s: float


def measure_run(options: str) -> RunShare:
    """Carry out `zoobench run` with these options, and a database of its own that is thrown away.

    Kernels come from the user's cache, as always: measure twice if the first time may have to compile.

    Raises:
        UsageError: the system does not tell the processor time of other processes, or the options are unreadable.
        ZoobenchError: the run failed.
    """
    try:
        words = shlex.split(options)
    except ValueError as error:
        raise UsageError(f"Cannot read the options {options!r} of a run: {error}.") from error
    with tempfile.TemporaryDirectory(prefix="zoobench-bench-") as folder:
        begin, wall = _seconds_of_children(), time.perf_counter()
        done = subprocess.run(
            [sys.executable, "-m", "zoobench", "run", *words, "--db", str(Path(folder) / "run.db")],
            env=os.environ | {VARIABLE: folder},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
        cpu, wall = _seconds_of_children() - begin, time.perf_counter() - wall
        if done.returncode:
            last = done.stderr.strip().splitlines()[-1:] or ["no message"]
            raise ZoobenchError(f"`zoobench run {options}` failed: {last[0]}")
        return share(options, cpu, wall, Path(folder))


def share(command: str, cpu: float, wall: float, folder: Path) -> RunShare:
    """The shares of `cpu` seconds, from what each simulating process has written into a folder (`launch_clock`)."""
    files = sorted(folder.glob("*.json"))
    kernels: Counter[str] = Counter()
    overhead: Counter[str] = Counter()
    for file in files:
        for launches in json.loads(file.read_text(encoding="utf-8"))["launches"]:
            for name, spent in launches.items():
                kernels[name] += spent["kernel_s"]
                overhead["launching_s"] += spent["launching_s"]
                overhead["loading_s"] += spent["loading_s"]
    times = {f"{name}_s": float(kernels[name]) for name in ("advance", "reverse", "survey")}
    return RunShare(
        command,
        processes=len(files),
        cpu_s=cpu,
        wall_s=wall,
        **times,
        launching_s=float(overhead["launching_s"]),
        loading_s=float(overhead["loading_s"]),
        rest_s=cpu - kernels.total() - overhead.total(),
    )


def _seconds_of_children() -> float:
    """Processor time of all processes that this one and its children have waited for [s]."""
    try:
        import resource
    except ImportError:  # Windows
        raise UsageError("This system does not tell the processor time of other processes. Leave --run out.") from None
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime
