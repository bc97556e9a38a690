"""What may be stored for gradients: as given, else a share of what is free."""

from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import psutil
import pytest

from zoobench.errors import UsageError
from zoobench.sim import memory_budget
from zoobench.sim.memory_budget import MEMORY_VARIABLE, WORKERS_VARIABLE, free_memory, memory_share, parse_size


@pytest.fixture(autouse=True)
def fresh(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Nothing is known of the environment, before and after."""
    for name in (MEMORY_VARIABLE, WORKERS_VARIABLE):
        monkeypatch.delenv(name, raising=False)
    memory_share.cache_clear()
    yield
    memory_share.cache_clear()


@pytest.mark.parametrize(
    ("text", "size"),
    [("2GB", 2 * 10**9), ("1.5 GiB", 3 * 2**29), ("500mb", 5 * 10**8), ("4096", 4096), (" 7 KiB ", 7 * 2**10)],
)
def test_a_size_is_read(text: str, size: int) -> None:
    """With decimal or binary units, or in bytes."""
    assert parse_size(text) == size


@pytest.mark.parametrize("text", ["", "GB", "-2GB", "0", "2 parsecs", "1e9", "2iB"])
def test_what_is_no_size_is_refused(text: str) -> None:
    """With examples of what is one."""
    with pytest.raises(UsageError, match="Write for example 2GB"):
        parse_size(text)


def test_what_is_given_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    """By each of the workers, of which states get what the process itself leaves, and half of it at least."""
    monkeypatch.setenv(WORKERS_VARIABLE, "4")
    monkeypatch.setenv(MEMORY_VARIABLE, "20GB")
    assert 15 * 10**9 < memory_share() < 20 * 10**9 - memory_budget._COMPILER_MEMORY
    memory_share.cache_clear()
    monkeypatch.setenv(MEMORY_VARIABLE, "2MB")
    assert memory_share() == 10**6


def test_a_quarter_of_each_worker_s_part_is_the_default(monkeypatch: pytest.MonkeyPatch) -> None:
    """And stays so while this process takes it."""
    monkeypatch.setenv(WORKERS_VARIABLE, "2")
    monkeypatch.setattr(memory_budget, "free_memory", lambda: 8000)
    assert memory_share() == 1000
    monkeypatch.setattr(memory_budget, "free_memory", lambda: 80)
    assert memory_share() == 1000


@pytest.mark.parametrize("version", [1, 2])
@pytest.mark.parametrize("place", ["", "a", "a/b"])
def test_a_control_group_may_leave_less(
    version: int, place: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The process's own or one that contains it; what only caches files is free, and `max` is no limit."""
    monkeypatch.setattr(psutil, "virtual_memory", lambda: SimpleNamespace(available=10**6))
    monkeypatch.setattr(memory_budget, "_CONTROL_GROUPS", tmp_path)
    listed = tmp_path / "listed"
    listed.write_text("1:cpu:/elsewhere\n" + ("4:memory:/a/b\n" if version == 1 else "0::/a/b\n"))
    monkeypatch.setattr(memory_budget, "_MEMBERSHIP", listed)
    assert free_memory() == 10**6
    for part, (limit, used, cached) in {"": ("max", 9, 0), place: ("5000", 3000, 400)}.items():
        folder = (tmp_path / "memory" if version == 1 else tmp_path) / part
        folder.mkdir(parents=True, exist_ok=True)
        names = ("memory.limit_in_bytes", "memory.usage_in_bytes") if version == 1 else ("memory.max", "memory.current")
        for name, text in zip(names, (limit, str(used)), strict=True):
            (folder / name).write_text(text)
        (folder / "memory.stat").write_text(f"cache 1\ninactive_file {cached}\n")
    assert free_memory() == 2400
