"""The memory that the states stored for gradients may take."""

import contextlib
import os
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import psutil

from zoobench.errors import UsageError

MEMORY_VARIABLE = "ZOOBENCH_MEMORY"
"""Environment variable with the memory that a process may take, as `parse_size` reads it.

Half of it at least is for the stored states."""

WORKERS_VARIABLE = "ZOOBENCH_WORKERS"
"""Environment variable with the number of processes that share this machine's memory; 1 if it is not set."""

_SHARE = 0.25
_COMPILER_MEMORY = 150 * 10**6  # [bytes], for the kernels that are compiled later
_UNITS = {"": 1, "B": 1, "KB": 10**3, "MB": 10**6, "GB": 10**9, "KIB": 2**10, "MIB": 2**20, "GIB": 2**30}
_CONTROL_GROUPS = Path("/sys/fs/cgroup")
_MEMBERSHIP = Path("/proc/self/cgroup")
_LIMIT_FILES = {
    "": ("memory.max", "memory.current"),  # the second version of control groups lists no controllers
    "memory": ("memory.limit_in_bytes", "memory.usage_in_bytes"),
}


def parse_size(text: str) -> int:
    """Read `2GB`, `1.5 GiB` or a plain number as bytes.

    Raises:
        UsageError: another shape, or nothing at all.
    """
    match = re.fullmatch(r"\s*([0-9]+(?:\.[0-9]+)?)\s*([kKmMgG]?i?[bB]|)\s*", text)
    size = int(float(match[1]) * _UNITS[match[2].upper()]) if match and match[2].upper() in _UNITS else 0
    if size <= 0:
        raise UsageError(f"Cannot read {text!r} as a size of memory. Write for example 2GB, 500MB or 1.5GiB.")
    return size


def allowed() -> int | None:
    """Memory limit of each process of a run, from the environment variable [bytes]; None for no limit.

    Raises:
        UsageError: the environment variable cannot be read.
    """
    text = os.environ.get(MEMORY_VARIABLE)
    return parse_size(text) if text else None


@cache
def memory_share(device: str = "cpu") -> int:
    """Memory for the stored states of this process on a device [bytes].

    The limit of the environment variable less the memory of the process itself; without it, and on CUDA, a quarter of
    this process's part of the free memory.

    The same for as long as the process runs.

    Raises:
        UsageError: the variable cannot be read.
    """
    workers = max(1, int(os.environ.get(WORKERS_VARIABLE, "1")))
    if device == "cuda":
        import torch

        return int(_SHARE * torch.cuda.mem_get_info()[0] / workers)
    if (whole := allowed()) is not None:
        return max(whole - psutil.Process().memory_info().rss - _COMPILER_MEMORY, whole // 2)
    return int(_SHARE * free_memory() / workers)


def free_memory() -> int:
    """Memory of this machine that is not in use, or that this process's control groups still allow, if less [bytes]."""
    return max(0, min([psutil.virtual_memory().available, *_group_memory(_CONTROL_GROUPS)]))


def _group_memory(root: Path) -> Iterator[int]:
    """Free memory of each control group of this process that has a limit [bytes]; none outside Linux.

    Memory that only caches files is counted as free.
    """
    with contextlib.suppress(OSError):
        for line in _MEMBERSHIP.read_text().splitlines():
            _, controllers, path = line.split(":", 2)
            folder = root / controllers
            for place in (folder, *(folder / part for part in _ancestry(path))):
                with contextlib.suppress(OSError, ValueError, KeyError):
                    limit, used = (int((place / name).read_text()) for name in _LIMIT_FILES[controllers])
                    yield limit - used + _file_cache(place / "memory.stat")


def _ancestry(path: str) -> Iterator[str]:
    """The group and all that contain it, as relative paths."""
    parts = path.strip("/").split("/")
    yield from ("/".join(parts[:count]) for count in range(1, len(parts) + 1) if parts[0])


def _file_cache(stat: Path) -> int:
    """Bytes that the group's files take and that can be given back."""
    found = re.search(r"^(?:total_)?inactive_file (\d+)$", stat.read_text(), re.MULTILINE)
    return int(found[1]) if found else 0
