"""Fixtures of the tests of designs."""

from collections.abc import Iterator

import pytest
import torch


@pytest.fixture(autouse=True)
def one_thread() -> Iterator[None]:
    """One thread, as in a run: on small fields, threads cost more than they save."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


@pytest.fixture
def few_iterations(monkeypatch: pytest.MonkeyPatch) -> None:
    """A tenth of the barycenter's iterations: their number is fixed, so that what a map owes holds for any."""
    monkeypatch.setattr("zoobench.designs.barycenter._ITERATIONS", 10)
