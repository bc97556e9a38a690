"""CMA-ES on problems with known answers."""

import numpy as np
import pytest

from tests.methods.toy import OPTIMUM, Context, Quadratic, Rosenbrock
from zoobench.errors import UsageError
from zoobench.methods.cmaes import CmaEs
from zoobench.spec import Budget


def test_it_finds_the_optimum_of_a_quadratic() -> None:
    """To a thousandth in every parameter, from a start far outside the first deviation."""
    solution = CmaEs().run(Quadratic(Budget("episodes", 2000)), Context(1))  # type: ignore[arg-type]
    np.testing.assert_allclose(solution.params, OPTIMUM, atol=1e-3)


def test_it_finds_the_end_of_a_bent_valley() -> None:
    """Which needs the covariance: Rosenbrock's function in four dimensions."""
    solution = CmaEs().run(Rosenbrock(Budget("episodes", 6000)), Context(1))  # type: ignore[arg-type]
    np.testing.assert_allclose(solution.params, 1.0, atol=1e-3)


def test_a_stagnated_strategy_gives_way_to_a_new_one() -> None:
    """Long after the optimum is found the count goes on, and the best is not lost."""
    solution = CmaEs().run(Quadratic(Budget("episodes", 12000)), Context(1))  # type: ignore[arg-type]
    assert solution.facts["strategies"] > 1
    np.testing.assert_allclose(solution.params, OPTIMUM, atol=1e-5)


def test_what_cannot_evolve_is_refused() -> None:
    """A deviation of zero, or too few to learn from."""
    with pytest.raises(UsageError, match="sigma"):
        CmaEs(sigma=0.0)
    with pytest.raises(UsageError, match="population"):
        CmaEs(population=2)
