"""The simulator's runtime is ended with the session, because only then the compiled kernels reach the cache."""

import gc
import os
import signal
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import zoobench  # noqa: F401  # before any library whose rounding it chooses
from tests.postgres import Server, ServerError
from zoobench.inputs import Start, find_with

# For libraries that are loaded from here on. Two workers share the cores, and threads of linear algebra wait for each
# other in a loop, which took a third of the processor's time of the designs.
for _library in ("MKL", "OMP", "OPENBLAS"):
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")

# For workers and other processes that are started from here on. The GNU C library returns the memory of every large
# array to the system at once, which then has to clear it for the next: a twentieth of the processor's time of designs.
for _threshold in ("MMAP", "TRIM"):
    os.environ.setdefault(f"MALLOC_{_threshold}_THRESHOLD_", str(2**30))

_OF_CELLS = ("cell", "gym", "render", "cli", "conformance", "envs", "studies", "verify")
_WITH = {
    "test_compiled_functions.py": "cell",
    "test_advection.py": "cell",
    "test_immersed.py": "cell",
    "test_stored_gait.py": "cell",
    "test_repetition.py": "cell",
    "test_probe.py": "cell",
    "test_external.py": "cell",
    "test_energy_audit.py": "sim",
    "test_cpp_reference.py": "sim",
    "test_surface_water.py": "cell",
    "test_check_method.py": "cell",
}
"""Files that need the kernels of another folder's tests, and which."""

_RESTARTING = ("test_launch.py", "test_runtime.py")
"""Files that restart the runtime, which then loads again what others have compiled: they come before those."""


_SLOW_TIMEOUT = 3600  # [s]


def pytest_configure(config: pytest.Config) -> None:
    """Kernels are compiled quickly, in child processes, too; with `-m slow` as users have them.

    While tests are collected, garbage is not looked for, which takes an eighth of that time.
    """
    gc.disable()
    if config.option.markexpr != "slow":
        os.environ.setdefault("ZOOBENCH_QUICK_COMPILE", "1")


@pytest.hookimpl(trylast=True)  # halves are of the tests that are selected
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """The first half begins with the cells of the benchmark, the second with scenes of the tests' own.

    Each of two workers begins with a half and takes over what the other leaves at its end. Kernels are shared by tests
    within these groups and seldom between them, so that few are compiled twice.
    """
    groups: dict[str, list[pytest.Item]] = {}
    for item in items:
        if item.get_closest_marker("slow"):
            item.add_marker(pytest.mark.timeout(_SLOW_TIMEOUT))
        folder = item.path.relative_to(config.rootpath / "tests").parts[0]
        groups.setdefault(_WITH.get(item.path.name, folder), []).append(item)
    cells = [item for name in _OF_CELLS for item in groups.pop(name, [])]
    scenes = sorted(groups.pop("sim", []), key=lambda item: item.path.name not in _RESTARTING)
    others = [item for group in groups.values() for item in group]
    share = max(len(items) // 2 - len(cells), 0)
    items[:] = cells + others[:share] + scenes + others[share:]


def pytest_collection_finish() -> None:
    """What was loaded and collected stays: to look through it again and again for garbage takes seconds.

    What is loaded from here on stays, too, and all of it is looked through ten times more seldom than Python does.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(700, 10, 100)
    gc.enable()


@pytest.fixture(scope="session", autouse=True)
def _end_runtime() -> Iterator[None]:
    yield
    if (runtime := sys.modules.get("zoobench.sim.runtime")) is not None:
        runtime.stop()


@pytest.fixture(scope="session", autouse=True)
def _quick_databases() -> Iterator[None]:
    # late: it loads libraries whose threads are chosen above
    from tests.new_databases import repeated_migrations, unsynced_files

    with repeated_migrations(), unsynced_files():
        yield


@pytest.fixture
def ctrl_c() -> Iterator[None]:
    """SIGINT as Python handles it, though the tests may run in the background, where it is ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture
def keep() -> Iterator[dict[str, Start]]:
    """The stored runs of this process, by name; put some in."""
    found: dict[str, Start] = {}
    find_with(found.get)
    yield found
    find_with({}.get)


@pytest.fixture(scope="session")
def postgres() -> Iterator[Server]:
    """A PostgreSQL server for all tests of this process, started when the first asks for it."""
    try:
        with Server.running() as server:
            yield server
    except ServerError as error:
        pytest.skip(str(error))


@pytest.fixture(params=["sqlite", pytest.param("postgresql", marks=pytest.mark.slow)])
def location(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """Where a new database will be, of each kind: what is said of one holds for the other.

    In fast tests `tests/db/test_postgres.py` and `test_store.py` have PostgreSQL.
    """
    if request.param == "sqlite":
        return str(tmp_path / "zoo.db")
    return str(request.getfixturevalue("postgres").new_database())
