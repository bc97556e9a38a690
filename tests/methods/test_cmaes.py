"""CMA-ES on problems with known answers."""

import numpy as np

from tests.methods.toy import OPTIMUM, Context, Quadratic
from zoobench.methods.cmaes import CmaEs
from zoobench.spec import Budget


def test_a_stagnated_strategy_is_replaced() -> None:
    """Long after the optimum is found, and the best is kept."""
    solution = CmaEs().run(Quadratic(Budget("episodes", 2500)), Context(1))  # type: ignore[arg-type]
    assert solution.facts["strategies"] > 1
    np.testing.assert_allclose(solution.params, OPTIMUM, atol=1e-5)
