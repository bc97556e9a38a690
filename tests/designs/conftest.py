"""Fixtures of the tests of designs."""

import pytest


@pytest.fixture
def few_iterations(monkeypatch: pytest.MonkeyPatch) -> None:
    """A tenth of the barycenter's iterations: their number is fixed, so that what a map owes holds for any."""
    monkeypatch.setattr("zoobench.designs.barycenter._ITERATIONS", 10)
