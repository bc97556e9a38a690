"""PPO on a toy with a known best policy, and the requirements on every method."""

import sys

import numpy as np
import pytest
import torch

from tests.conformance.cells import cell
from tests.methods.toy import Context
from tests.methods.toy_session import FRAMES, PLENTY, Obey
from zoobench.cell.problem import Problem
from zoobench.errors import BudgetExhaustedError, UsageError
from zoobench.methods.base import Solution
from zoobench.methods.ppo import Ppo
from zoobench.spec import Budget

BUFFER = 32
SMALL = Ppo(buffer=BUFFER, batch=16, epochs=2, worlds=4)


def _run(problem: Obey, context: Context, method: Ppo = SMALL) -> Solution:
    return method.run(problem, context)  # type: ignore[arg-type]


def test_it_has_the_settings_of_the_specification() -> None:
    """F.2."""
    ppo = Ppo()
    assert (ppo.timesteps, ppo.buffer, ppo.batch, ppo.epochs) == (100_000, 2048, 32, 20)
    assert (ppo.gae, ppo.discount, ppo.entropy, ppo.lr, ppo.clip) == (0.95, 0.98, 0.001, 1e-4, 0.2)


@pytest.mark.slow
def test_it_learns_to_do_as_it_is_told() -> None:
    """The best constant policy scores 0.79 on average, the best policy 1; the exploration shrinks."""
    context = Context(1)
    method = Ppo(timesteps=5120, buffer=512, batch=64, epochs=10, lr=3e-3, worlds=16)
    solution = _run(Obey(PLENTY), context, method)
    assert 0.95 < solution.evaluation.score <= 1.0
    assert context.curve[-1][1]["reward_explored"] > context.curve[0][1]["reward_explored"] + 0.2
    assert context.curve[-1][1]["deviation"] < 0.29


@pytest.mark.parametrize("kind", ["substeps", "episodes", "iterations"])
def test_the_budget_is_honoured(kind: str) -> None:
    """It is not exceeded, and what is left does not suffice for another buffer and its evaluation."""
    amount = {"substeps": 5 * (BUFFER + FRAMES) - 1, "episodes": 30, "iterations": 3}[kind]
    problem, context = Obey(Budget(kind, amount)), Context()
    solution = _run(problem, context)
    buffers = {"substeps": 4, "episodes": 6, "iterations": 3}[kind]
    assert problem.meter.spent(kind) <= amount
    assert problem.meter.iterations == solution.facts["iterations"] == len(problem.seen) == buffers
    assert problem.meter.substeps == buffers * (BUFFER + FRAMES)
    assert context.fractions == sorted(context.fractions)


def test_timesteps_end_the_run_too() -> None:
    """Rounded up to whole buffers; 0 for no limit."""
    few = _run(Obey(PLENTY), Context(), Ppo(timesteps=BUFFER + 1, buffer=BUFFER, epochs=1, worlds=4))
    assert few.facts["timesteps"] == 2 * BUFFER
    free = _run(Obey(Budget("iterations", 3)), Context(), Ppo(timesteps=0, buffer=BUFFER, epochs=1, worlds=4))
    assert free.facts["timesteps"] == 3 * BUFFER


def test_it_restores_generators_and_threads() -> None:
    """The global generators and the number of threads are as before."""
    torch.manual_seed(3)
    np.random.seed(3)
    threads = torch.get_num_threads()
    _run(Obey(Budget("iterations", 1)), Context())
    drawn = torch.rand(1).item(), np.random.rand()
    torch.manual_seed(3)
    np.random.seed(3)
    assert drawn == (torch.rand(1).item(), np.random.rand())
    assert torch.get_num_threads() == threads


def test_an_interrupted_run_goes_on_and_says_so() -> None:
    """With its learner, cost and incumbent to the same end; counted as resumed if it learns further."""
    whole = Context(2)
    expected = _run(Obey(Budget("iterations", 4)), whole)
    assert expected.facts["resumed"] == 0
    first, second = Context(2, stop_after=2), Context(99)
    _run(Obey(Budget("iterations", 4)), first)
    second.stored = first.stored
    problem = Obey(Budget("iterations", 4))
    result = _run(problem, second)
    assert first.curve == whole.curve[:2]
    assert [step for step, _ in second.curve] == [3, 4]
    assert result.facts["resumed"] == 1
    assert result.facts["timesteps"] == expected.facts["timesteps"]
    assert problem.meter.substeps == whole.curve[-1][1]["substeps"]
    assert second.curve[0][1]["score"] >= first.curve[-1][1]["score"]


def test_the_solution_is_the_best_policy_met() -> None:
    """Its parameters give its score again."""
    problem, context = Obey(Budget("iterations", 5)), Context(3)
    solution = _run(problem, context)
    assert solution.evaluation.score == max(metrics["score_current"] for _, metrics in context.curve)
    assert Obey(PLENTY).evaluate(solution.params).score == solution.evaluation.score


def test_episodes_that_fail_are_begun_again_within_the_budget() -> None:
    """Each counts, so that a budget of episodes can end within a buffer; the incumbent is kept."""
    problem = Obey(Budget("episodes", 60), limit=0.6)
    solution = _run(problem, Context())
    assert problem.meter.episodes <= 60
    assert solution.facts["diverged_episodes"] > 0
    assert solution.evaluation.failure is None


def test_a_budget_too_small_for_anything_is_an_error() -> None:
    """Nothing is simulated, and the message names buffer and evaluation."""
    problem = Obey(Budget("substeps", BUFFER + FRAMES - 1))
    with pytest.raises(BudgetExhaustedError, match="first buffer of 32 frames and an evaluation of 10"):
        _run(problem, Context())
    assert problem.meter.substeps == 0


def test_a_controller_that_is_no_policy_is_refused() -> None:
    """The message names the controller to choose."""
    with pytest.raises(UsageError, match="--controller policy-network"):
        SMALL.run(Problem(cell(budget=Budget("iterations", 1))), Context())


def test_without_stable_baselines_it_says_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    """The message names the extra to install."""
    monkeypatch.delitem(sys.modules, "zoobench.gym.learner", raising=False)
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    with pytest.raises(UsageError, match=r"stable_baselines3, which is not installed.*zoobench\[ppo\]"):
        _run(Obey(PLENTY), Context())
