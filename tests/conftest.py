"""The simulator's runtime is ended with the session, because only then the compiled kernels reach the cache."""

import signal
import sys
from collections.abc import Iterator

import pytest

import zoobench  # noqa: F401  # before any library whose rounding it chooses


@pytest.fixture(scope="session", autouse=True)
def _end_runtime() -> Iterator[None]:
    yield
    if (runtime := sys.modules.get("zoobench.sim.runtime")) is not None:
        runtime.stop()


@pytest.fixture
def ctrl_c() -> Iterator[None]:
    """SIGINT as Python handles it, though the tests may run in the background, where it is ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)
