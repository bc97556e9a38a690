"""Sessions of the toy problems."""

import pytest

from tests.methods.toy_session import Mirror, Obey
from zoobench.cell.problem import Problem
from zoobench.cell.session import Session, new_session
from zoobench.methods import ppo


@pytest.fixture(autouse=True)
def _toy_sessions(monkeypatch: pytest.MonkeyPatch) -> None:
    def chosen(problem: Problem | Obey, worlds: int) -> Session | Mirror:
        return problem.session(worlds) if isinstance(problem, Obey) else new_session(problem, worlds)

    monkeypatch.setattr(ppo, "new_session", chosen)


@pytest.fixture
def no_checkpoints(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is packed, which takes up to half of the time of a long run: for runs that go on from no checkpoint."""
    for module in ("base", "generations"):
        monkeypatch.setattr(f"zoobench.methods.{module}.pack", lambda state: b"")
