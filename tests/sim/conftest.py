"""The runtime is ended with the session, because only then the compiled kernels reach the cache."""

from collections.abc import Iterator

import pytest

from zoobench.sim import runtime


@pytest.fixture(scope="session", autouse=True)
def _end_runtime() -> Iterator[None]:
    yield
    runtime.stop()
