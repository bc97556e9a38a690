"""`zoobench doctor`: checks of the installation, the machine and a database."""

import json
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from zoobench.errors import StorageError, reason

_PACKAGES = (
    "alembic", "cma", "neat-python", "numpy", "pandas", "psutil", "pydantic", "pyyaml", "rich", "roma", "scikit-image",
    "scipy", "sqlalchemy", "taichi", "torch", "typer",
)  # fmt: skip
_LITTLE_SPACE = 1 << 30  # [bytes]
_SOON_READ = 32 << 20  # [bytes]; read within a second
_TAICHI_SECONDS = 120.0

# In a process of its own: a Taichi that does not fit the machine may crash rather than raise.
_TAICHI_PROBE = """
import json, sys
from zoobench.sim import runtime
import torch
runtime.start(32)
runtime.stop()
print(json.dumps({"cache": str(runtime.kernel_folder()), "cuda": torch.cuda.is_available()}))
"""


class Verdict(StrEnum):
    """The result of a check."""

    OK = "ok"
    WARNING = "warning"
    PROBLEM = "problem"


@dataclass(frozen=True)
class Diagnosis:
    """The result of one check; `detail` says what was found, and what to do about a problem."""

    name: str
    verdict: Verdict
    detail: str


def examine(database: str, *, full: bool = False) -> Iterator[Diagnosis]:
    """Name the Python, and check packages, Taichi, the compile cache, plug-ins, the database and disk space.

    A large database is read from end to end only if `full`.
    """
    yield Diagnosis("python", Verdict.OK, sys.version.split()[0])
    yield _check_packages()
    yield from _check_taichi()
    yield _check_plugins()
    yield _check_database(database, full)
    if "://" not in database:
        yield _check_space(Path(database).absolute().parent)


def _check_packages() -> Diagnosis:
    found, missing = [], []
    for name in _PACKAGES:
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            missing.append(name)
    if missing:
        return Diagnosis("packages", Verdict.PROBLEM, f"{', '.join(missing)} missing. Install zoobench again.")
    return Diagnosis("packages", Verdict.OK, ", ".join(found))


def _check_taichi() -> Iterator[Diagnosis]:
    try:
        done = subprocess.run(
            [sys.executable, "-c", _TAICHI_PROBE], capture_output=True, text=True, timeout=_TAICHI_SECONDS, check=False
        )
    except subprocess.TimeoutExpired:
        yield Diagnosis("taichi", Verdict.PROBLEM, f"It did not start within {_TAICHI_SECONDS:.0f} s.")
        return
    if done.returncode:
        last = done.stderr.strip().splitlines()[-1:] or ["no message"]
        yield Diagnosis("taichi", Verdict.PROBLEM, f"It ended with exit code {done.returncode}: {last[0]}")
        return
    told: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    yield Diagnosis("taichi", Verdict.OK, "starts on the CPU; " + ("CUDA is available" if told["cuda"] else "no CUDA"))
    yield _check_cache(Path(told["cache"]))


def _check_cache(folder: Path) -> Diagnosis:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(b"zoobench")
    except OSError as error:
        advice = "Every run will compile anew. Name a writable folder in ZOOBENCH_CACHE."
        return Diagnosis("compile cache", Verdict.WARNING, f"Cannot write to {folder}: {reason(error)}. {advice}")
    return Diagnosis("compile cache", Verdict.OK, f"{folder} is writable")


def _check_plugins() -> Diagnosis:
    from zoobench.registry import failures

    broken = [f"{item.entry_point} of {item.group}: {item.reason}" for item in failures()]
    return Diagnosis("plug-ins", Verdict.PROBLEM if broken else Verdict.OK, "; ".join(broken) or "none is broken")


def _check_database(location: str, full: bool) -> Diagnosis:
    if "://" not in location and not Path(location).exists():
        folder = Path(location).absolute().parent
        if not folder.is_dir():
            advice = "Make it, or give another path with --db."
            return Diagnosis("database", Verdict.PROBLEM, f"There is no folder {folder}. {advice}")
        return Diagnosis("database", Verdict.OK, f"{location} does not exist yet; `zoobench run` makes it")
    from zoobench.db.store import Store

    try:
        with Store(location, create=False) as store:
            is_read = full or store.size <= _SOON_READ
            complaints = (store.check() or store.damage()) if is_read else []
            unproved = store.unsealed() if is_read else 0
            runs = sum(store.counts().values())
    except StorageError as error:
        return Diagnosis("database", Verdict.PROBLEM, str(error))
    if complaints:
        return Diagnosis("database", Verdict.PROBLEM, f"{store.name} is damaged: {_first(complaints)}.")
    if not is_read:
        size = f"{store.size / 2**30:.1f} GiB"
        detail = f"{store.name} opens and holds {runs} runs; --full also reads all of its {size}"
        return Diagnosis("database", Verdict.OK, detail)
    intact = f"{store.name} is intact and holds {runs} runs"
    if unproved:
        doubt = f"{intact}; {unproved} that have ended have no digest, so that nothing proves their results"
        return Diagnosis("database", Verdict.WARNING, doubt)
    return Diagnosis("database", Verdict.OK, intact)


def _first(complaints: list[str]) -> str:
    more = f"; and {len(complaints) - 3:,} more" if len(complaints) > 3 else ""
    return "; ".join(complaints[:3]) + more


def _check_space(folder: Path) -> Diagnosis:
    try:
        free = shutil.disk_usage(folder).free
    except OSError as error:
        return Diagnosis("disk space", Verdict.PROBLEM, f"Cannot examine {folder}: {reason(error)}.")
    verdict = Verdict.OK if free > _LITTLE_SPACE else Verdict.WARNING
    return Diagnosis("disk space", verdict, f"{free / 2**30:.1f} GiB free in {folder}")
