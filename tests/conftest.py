"""The simulator's runtime is ended with the session, because only then the compiled kernels reach the cache."""

import sys
from collections.abc import Iterator

import pytest


@pytest.fixture(scope="session", autouse=True)
def _end_runtime() -> Iterator[None]:
    yield
    if (runtime := sys.modules.get("zoobench.sim.runtime")) is not None:
        runtime.stop()
