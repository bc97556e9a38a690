"""Memory that processes use, and what they may use."""

import os
import re
import sys
from contextlib import suppress
from pathlib import Path

import psutil

from zoobench.sim.memory_budget import MEMORY_VARIABLE, memory_share, parse_size
from zoobench.sim.memory_budget import WORKERS_VARIABLE as WORKERS_VARIABLE
from zoobench.sim.memory_budget import allowed as allowed  # harness reads it here

_STATUS = Path("/proc/self/status")


def allow(size: str) -> None:
    """Let this process, and those that it starts from now on, store so much for gradients, as in `2GB`.

    Raises:
        UsageError: the size cannot be read.
    """
    parse_size(size)
    os.environ[MEMORY_VARIABLE] = size


def memory_of(pid: int) -> int:
    """Resident memory of a process and its descendants [bytes]; 0 if it has ended.

    What several of them share, as a process and its forks do, counts once where the system tells of it, as on Linux.
    """
    try:
        process = psutil.Process(pid)
        family = [process, *process.children(recursive=True)]
    except psutil.Error:
        return 0
    return sum(_share(member) if len(family) > 1 else _resident(member) for member in family)


def _share(process: psutil.Process) -> int:
    """The resident memory of a process, of pages in several processes its part of them [bytes]."""
    try:
        lines = Path(f"/proc/{process.pid}/smaps_rollup").read_text().splitlines()
        return next(int(line.split()[1]) * 1024 for line in lines if line.startswith("Pss:"))
    except (OSError, StopIteration):
        return _resident(process)


def _resident(process: psutil.Process) -> int:
    try:
        return int(process.memory_info().rss)
    except psutil.Error:
        return 0


def share_among(workers: int) -> None:
    """Let the processes that are started from now on share the memory that is free with so many like them."""
    os.environ[WORKERS_VARIABLE] = str(workers)


def begin_account() -> None:
    """Let `peak_memory` tell the peak from now on, and the memory for stored states be measured anew."""
    memory_share.cache_clear()
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")  # the peak of resident memory, see proc(5)


def peak_memory() -> int | None:
    """Peak resident memory of this process since `begin_account` [bytes]; None where the system does not report it.

    Only on Linux; on other systems it is the peak since the process began.
    """
    with suppress(OSError):
        if found := re.search(r"^VmHWM:\s+(\d+) kB$", _STATUS.read_text(), re.MULTILINE):
            return int(found[1]) * 1024
    try:
        import resource
    except ImportError:  # Windows
        return None
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit
