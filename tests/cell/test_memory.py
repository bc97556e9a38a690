"""The memory of a process, in bytes on every system."""

import resource
import sys
from types import SimpleNamespace

import pytest

from zoobench.cell.memory import peak_memory


@pytest.mark.parametrize(("system", "told"), [("linux", 3 * 2**10), ("darwin", 3 * 2**20)])
def test_peak_memory_is_in_bytes(monkeypatch: pytest.MonkeyPatch, system: str, told: int) -> None:
    """Linux counts in KiB, macOS in bytes."""
    monkeypatch.setattr(sys, "platform", system)
    monkeypatch.setattr(resource, "getrusage", lambda _: SimpleNamespace(ru_maxrss=told))
    assert peak_memory() == 3 * 2**20


def test_a_system_that_does_not_tell_is_no_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """Windows does not have the module."""
    monkeypatch.setitem(sys.modules, "resource", None)
    assert peak_memory() is None


def test_memory_that_was_used_is_in_the_peak() -> None:
    """The peak includes memory that was released."""
    block = bytearray(50 * 2**20)
    del block
    found = peak_memory()
    assert found is not None
    assert 50 * 2**20 < found < 2**34
