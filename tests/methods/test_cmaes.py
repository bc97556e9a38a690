"""CMA-ES on problems with known answers."""

import numpy as np

from tests.methods.toy import OPTIMUM, Context, Quadratic, Rosenbrock
from zoobench.methods.cmaes import CmaEs
from zoobench.spec import Budget


def test_it_finds_the_optimum_of_a_quadratic() -> None:
    """To 1e-3 in every parameter, from a start many standard deviations away."""
    solution = CmaEs().run(Quadratic(Budget("episodes", 2000)), Context(1))  # type: ignore[arg-type]
    np.testing.assert_allclose(solution.params, OPTIMUM, atol=1e-3)


def test_it_finds_the_end_of_a_bent_valley() -> None:
    """Rosenbrock's function in four dimensions, which needs the covariance."""
    solution = CmaEs().run(Rosenbrock(Budget("episodes", 6000)), Context(1))  # type: ignore[arg-type]
    np.testing.assert_allclose(solution.params, 1.0, atol=1e-3)


def test_a_stagnated_strategy_is_replaced() -> None:
    """Long after the optimum is found, and the best is kept."""
    solution = CmaEs().run(Quadratic(Budget("episodes", 12000)), Context(1))  # type: ignore[arg-type]
    assert solution.facts["strategies"] > 1
    np.testing.assert_allclose(solution.params, OPTIMUM, atol=1e-5)
