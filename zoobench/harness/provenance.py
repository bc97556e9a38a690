"""Where a number comes from: code, packages, machine, thread and rounding settings, as plain JSON data.

Nothing in it changes between two runs of the same code on the same machine, so a database stores it once.
"""

import hashlib
import os
import platform
import subprocess
import sys
from collections.abc import Iterable
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import psutil

import zoobench
from zoobench import __version__, rounding

_PACKAGES = ("alembic", "numpy", "pandas", "scipy", "sqlalchemy", "taichi", "torch", "zoobench")
THREAD_VARIABLES = ("MKL_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")


def gather() -> dict[str, Any]:
    """Code (commit, hash of uncommitted changes), packages, Python, platform, CPU, GPUs and settings, as of now."""
    return {
        "zoobench": __version__,
        "code": _code(Path(zoobench.__file__).parent),
        "packages": {name: _version(name) for name in _PACKAGES},
        "python": platform.python_version(),
        "implementation": platform.python_implementation(),
        "platform": platform.platform(),
        "host": platform.node(),
        "cpu": {
            "model": _cpu_model(),
            "cores": psutil.cpu_count(logical=False),
            "threads": psutil.cpu_count(logical=True),
        },
        "memory": psutil.virtual_memory().total,
        "gpus": _gpus(),
        "thread_settings": _settings(THREAD_VARIABLES),
        "rounding": _settings(rounding.CHOICES),
    }


def _settings(variables: Iterable[str]) -> dict[str, str | None]:
    return {name: os.environ.get(name) for name in variables}


def _code(package: Path) -> dict[str, Any]:
    """Commit and uncommitted changes if the package runs from a checkout; the hash of its files always."""
    code: dict[str, Any] = {"files": sources(package), "commit": None, "dirty": None, "diff": None}
    if not (package.parent / ".git").exists():
        return code
    commit = _output("git", "-C", str(package.parent), "rev-parse", "HEAD")
    changes = _output("git", "-C", str(package.parent), "status", "--porcelain", "--", package.name)
    diff = _output("git", "-C", str(package.parent), "diff", "HEAD", "--", package.name)
    code |= {"commit": commit or None, "dirty": bool(changes)}
    if diff:
        code["diff"] = hashlib.sha256(diff.encode()).hexdigest()
    return code


def sources(package: Path = Path(zoobench.__file__).parent) -> str:
    """A hash of the names and contents of a package's files, as of now."""
    files = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        files.update(path.relative_to(package).as_posix().encode() + b"\0" + path.read_bytes())
    return files.hexdigest()


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _cpu_model() -> str:
    if sys.platform == "linux":
        for line in Path("/proc/cpuinfo").read_text(errors="replace").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor()


@cache
def _gpus() -> list[str]:
    """Name, driver and memory of each NVIDIA GPU, as its own tool tells them; empty without one."""
    query = "--query-gpu=name,driver_version,memory.total"
    return _output("nvidia-smi", query, "--format=csv,noheader").splitlines()


def _output(*command: str) -> str:
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=10.0, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""
