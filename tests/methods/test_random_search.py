"""Random search draws from the prior."""

import numpy as np

from tests.methods.toy import OPTIMUM, Context, Quadratic
from zoobench.methods.random_search import RandomSearch
from zoobench.spec import Budget


def test_it_keeps_the_best_draw() -> None:
    """The solution is the draw nearest to the optimum; the draws are the prior's in order."""
    problem = Quadratic(Budget("episodes", 50))
    solution = RandomSearch().run(problem, Context(4))
    rng = np.random.default_rng(4)
    draws = [problem.initial(rng) for _ in range(50)]
    np.testing.assert_array_equal(problem.seen, draws)
    best = min(draws, key=lambda params: float(((params - OPTIMUM) ** 2).sum()))
    np.testing.assert_array_equal(solution.params, best)


def test_the_budget_is_used_to_the_last_episode() -> None:
    """The last batch is reduced to the remaining budget."""
    problem = Quadratic(Budget("substeps", 195))
    RandomSearch(batch=8).run(problem, Context())
    assert problem.meter.episodes == 19
    assert problem.meter.iterations == 3


def test_a_batch_far_beyond_the_budget_begins_at_once() -> None:
    """How many draws the budget affords is not found by counting down to it."""
    problem = Quadratic(Budget("episodes", 3))
    RandomSearch(batch=10**15).run(problem, Context())
    assert problem.meter.episodes == 3
