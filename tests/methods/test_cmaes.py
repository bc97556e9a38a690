"""CMA-ES on problems with known answers."""

import numpy as np
import pytest

from tests.methods.toy import OPTIMUM, Context, Quadratic
from zoobench.arrays import Array
from zoobench.cell.episode import Evaluation
from zoobench.methods.cmaes import CmaEs, Strategies
from zoobench.spec import Budget


@pytest.mark.slow
def test_a_stagnated_strategy_is_replaced() -> None:
    """Long after the optimum is found, and the best is kept."""
    solution = CmaEs().run(Quadratic(Budget("episodes", 2500)), Context(1))  # type: ignore[arg-type]
    assert solution.facts["strategies"] > 1
    np.testing.assert_allclose(solution.params, OPTIMUM, atol=1e-5)


def test_a_failed_episode_costs_more_than_the_worst_that_did_not_fail() -> None:
    """Its own score is unknown, and the strategy must not be led there; the others cost their negated scores."""
    strategies = Strategies(0.1, 4, lambda: np.zeros(3), np.random.default_rng(0))
    scores = (-7.0, np.nan, 0.5, -np.inf)
    told = strategies.digest([Evaluation(score, {}, np.zeros(0)) for score in scores])
    assert (told[0], told[2]) == (7.0, -0.5)
    assert min(told[1], told[3]) > 7.0


class Given(Quadratic):
    """A robot without parameters."""

    parameter_count = 0

    def _one(self, params: Array) -> tuple[Evaluation, Array]:
        return super()._one(OPTIMUM)


def test_a_robot_without_parameters_is_evaluated_once() -> None:
    """There is nothing to be found, and its score is the result."""
    problem = Given(Budget("episodes", 2500))
    solution = CmaEs().run(problem, Context(1))  # type: ignore[arg-type]
    assert (solution.evaluation.score, len(solution.params), problem.meter.episodes) == (1.0, 0, 1)
