"""Agents that were trained elsewhere."""

from pathlib import Path

import numpy as np
import pytest

from tests.conformance.cells import cell
from tests.methods.toy import Context
from zoobench import registry
from zoobench.cell.problem import Problem
from zoobench.errors import BudgetExhaustedError, UsageError
from zoobench.gym.single import ZooEnv
from zoobench.harness.grid import parse_selector
from zoobench.methods.base import Solution
from zoobench.methods.external import External
from zoobench.registry import Kind
from zoobench.spec import Budget

FRAMES = 4
PLAYED = f"trajectory[frames={FRAMES}]"
AGENT = """
import numpy as np
from beside import SCALE

def act(seen):
    return np.sin(np.arange(90) + SCALE * seen[:90].sum()).astype(np.float32)

def short(seen):
    return [0.0]
"""


@pytest.fixture
def agent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An agent of two files in the present folder."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "beside.py").write_text("SCALE = 50.0")
    (tmp_path / "agent.py").write_text(AGENT)
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path / "agent.py"


def _solved(text: str, controller: str = PLAYED, episodes: int = 2) -> tuple[Problem, Solution]:
    spec = cell(Budget("episodes", episodes), FRAMES, controller=controller, method=text)
    problem = Problem(spec)
    method: External = registry.create(Kind.METHOD, spec.method)
    return problem, method.run(problem, Context())


@pytest.mark.usefixtures("agent")
def test_its_score_is_that_in_the_environment_and_can_be_repeated() -> None:
    """Under the meter: an episode of the agent, and one of the activity that is kept."""
    problem, solution = _solved("external[policy=agent.py]")
    assert (problem.meter.episodes, problem.meter.iterations) == (2, 1)
    assert solution.evaluation.score == solution.facts["score_acting"]
    repeated = Problem(cell(controller=PLAYED, frames=FRAMES)).evaluate(solution.params)
    assert repeated.score == solution.evaluation.score
    env = ZooEnv("ground", "caterpillar", "movement-speed", fidelity="smoke", frames=FRAMES)
    seen, over = env.reset()[0], False
    while not over:
        seen, _, _, over, told = env.step(np.sin(np.arange(90) + 50.0 * seen[:90].sum()).astype(np.float32))
    assert told["score"] == solution.evaluation.score


def test_another_file_is_another_run(agent: Path) -> None:
    """The digest of the file is part of the settings, and a file that has changed since is refused."""
    spec = cell(Budget("episodes", 2), FRAMES, controller=PLAYED, method="external[policy=agent.py]")
    agent.write_text(AGENT + "# changed")
    method: External = registry.create(Kind.METHOD, spec.method)
    with pytest.raises(UsageError, match="has changed"):
        method.run(Problem(spec), Context())


@pytest.mark.usefixtures("agent")
def test_what_cannot_be_an_agent_is_refused() -> None:
    """No such function, no such action, another controller, or too small a budget."""
    with pytest.raises(UsageError, match="no function"):
        _solved("external[policy=agent.py,function=missing]")
    with pytest.raises(UsageError, match="shape"):
        _solved("external[policy=agent.py,function=short]")
    with pytest.raises(UsageError, match="trajectory"):
        _solved("external[policy=agent.py]", controller="sine-basis")
    with pytest.raises(BudgetExhaustedError):
        _solved("external[policy=agent.py]", episodes=1)


def test_a_glob_never_means_it() -> None:
    """It is of one user, and in no grid or suite that does not name it."""
    assert "external" not in [ref.name for ref in parse_selector("*", Kind.METHOD)]
