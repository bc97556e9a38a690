"""CMA-ES on problems with known answers."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.methods.toy import OPTIMUM, Context, Quadratic, Rosenbrock
from zoobench.methods.cmaes import CmaEs
from zoobench.spec import Budget


@pytest.mark.parametrize(("toy", "best", "episodes"), [(Quadratic, OPTIMUM, 2000), (Rosenbrock, np.ones(4), 6000)])
def test_it_finds_the_optimum(toy: type[Quadratic], best: np.ndarray, episodes: int) -> None:
    """To 1e-3 in every parameter, from many deviations away, and along a bent valley, which needs the covariance."""
    solution = CmaEs().run(toy(Budget("episodes", episodes)), Context(1))  # type: ignore[arg-type]
    np.testing.assert_allclose(solution.params, best, atol=1e-3)


def test_a_stagnated_strategy_is_replaced() -> None:
    """Long after the optimum is found, and the best is kept."""
    solution = CmaEs().run(Quadratic(Budget("episodes", 12000)), Context(1))  # type: ignore[arg-type]
    assert solution.facts["strategies"] > 1
    np.testing.assert_allclose(solution.params, OPTIMUM, atol=1e-5)


def test_a_run_loads_no_plots_and_no_statistics() -> None:
    """cma takes them where they are there, in more than a second; whoever asks for them later has them."""
    program = """
import sys
from tests.methods.toy import Context, Quadratic
from zoobench.methods.cmaes import CmaEs
from zoobench.spec import Budget
CmaEs().run(Quadratic(Budget("episodes", 20)), Context())
assert "cma" in sys.modules
assert not {"matplotlib", "scipy.stats"} & set(sys.modules)
from scipy.stats import chi2
"""
    subprocess.run([sys.executable, "-c", program], cwd=Path(__file__).parents[2], check=True, timeout=120)
