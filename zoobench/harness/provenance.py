"""Where a number comes from: code, packages, machine, thread and rounding settings, as plain JSON data.

Nothing in it changes between two runs of the same code on the same machine, so a database stores it once.
"""

import hashlib
import json
import os
import platform
import subprocess
import sys
from collections.abc import Collection, Iterable, Iterator, Mapping
from functools import cache, lru_cache
from importlib.metadata import PackageNotFoundError, packages_distributions, version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import psutil

import zoobench
from zoobench import __version__, registry, rounding
from zoobench.files import hash_of_sources
from zoobench.spec import AXES, RunSpec

PACKAGES = (
    "alembic", "cma", "gymnasium", "neat-python", "numpy", "pandas", "psutil", "pydantic", "pypcd4", "pyyaml", "ribs",
    "roma", "scikit-image", "scipy", "sqlalchemy", "stable-baselines3", "taichi", "torch", "trimesh", "zoobench",
)  # fmt: skip
"""Every distribution that takes part in making a number or in keeping it."""
_COMMIT_FILE = "commit.json"  # beside the package's modules, where it was installed from a checkout
THREAD_VARIABLES = ("MKL_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")


def gather() -> dict[str, Any]:
    """Code (commit, hash of uncommitted changes), packages, Python, platform, CPU, GPUs and settings, as of now."""
    return {
        "zoobench": __version__,
        "code": _code(Path(zoobench.__file__).parent),
        "packages": _versions(tuple(_changed_at(Path(place)) for place in sys.path)),
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
    """Commit and uncommitted changes of the checkout that it runs from, or was built from; always its files' hash.

    What an installed package was built from, `hatch_build.py` has written beside its modules.
    """
    code: dict[str, Any] = {"files": hash_of_sources(package), "commit": None, "dirty": None, "diff": None}
    if not (package.parent / ".git").exists():
        built = package / _COMMIT_FILE
        return code | (json.loads(built.read_text()) if built.exists() else {})
    commit = _output("git", "-C", str(package.parent), "rev-parse", "HEAD")
    changes = _output("git", "-C", str(package.parent), "status", "--porcelain", "--", package.name)
    diff = _output("git", "-C", str(package.parent), "diff", "HEAD", "--", package.name)
    code |= {"commit": commit or None, "dirty": bool(changes)}
    if diff:
        code["diff"] = hashlib.sha256(diff.encode()).hexdigest()
    return code


def sources() -> str:
    """A hash of zoobench's modules, as of now."""
    return hash_of_sources(Path(zoobench.__file__).parent)


def plugins_of(spec: RunSpec) -> dict[str, dict[str, str | None]]:
    """Distribution, version and code hash of the components of a run that are plug-ins', by kind, name and version.

    Those of zoobench itself are told by `code` and their versions. Empty if there are no others.
    """
    if not registry.has_plugins():  # then zoobench's own need not be loaded either
        return {}
    found = {}
    for axis, kind in registry.KINDS.items():
        ref = getattr(spec, axis)
        if ref.name not in registry.names(kind):
            continue
        module = registry.get(kind, ref.name).factory.__module__
        top = module.partition(".")[0]
        if top != zoobench.__name__:
            found[f"{kind.noun} {ref.name}-v{ref.version}"] = {**_distribution_of(top), "code": _module_hash(top)}
    return found


def changed_plugins(specs: Iterable[RunSpec], stored: Collection[Mapping[str, Any]]) -> Iterator[str]:
    """A line for each plug-in's component of these runs whose code is another than any that runs were done with.

    Args:
        specs: of the runs.
        stored: `plugins_of` of earlier runs.
    """
    parts = {(getattr(spec, axis), axis): spec for spec in specs for axis in AXES}
    now = {name: facts for spec in parts.values() for name, facts in plugins_of(spec).items()}
    for name, facts in sorted(now.items()):
        codes = {each[name]["code"] for each in stored if name in each}
        if codes and facts["code"] not in codes:
            yield (
                f"The code of the {name}, of {facts['distribution']} {facts['version']}, has changed since runs here "
                "were done. If its numbers have, raise its version, or do those runs again with --rerun."
            )


def _distribution_of(module: str) -> dict[str, str | None]:
    """Name and version of a top-level module's distribution, which one in a checkout has by its entry point alone."""
    found = registry.distributions().get(module) or next(iter(_distributions().get(module, [])), None)
    return {"distribution": found, "version": None if found is None else _version(found)}


@cache
def _distributions() -> Mapping[str, list[str]]:
    """Distributions by top-level module; to read the lists of files of all that are installed takes a second."""
    return packages_distributions()


def _module_hash(module: str) -> str | None:
    """A hash of the files of a top-level module or package, as of now; None if it has none."""
    found = find_spec(module)
    if found is None or found.origin is None:
        return None
    path = Path(found.origin)
    is_package = found.submodule_search_locations is not None
    return hash_of_sources(path.parent) if is_package else hashlib.sha256(path.read_bytes()).hexdigest()


@lru_cache(maxsize=1)
def _versions(installed: tuple[int, ...]) -> dict[str, str | None]:
    """The versions of `PACKAGES`, which take long to read: anew only where something was `installed` since."""
    return {name: _version(name) for name in PACKAGES}


def _changed_at(folder: Path) -> int:
    """When something was last added to a folder or taken away [ns]; 0 if there is none."""
    return folder.stat().st_mtime_ns if folder.exists() else 0


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
