"""Every method on problems with known solutions, chosen by the tags of the method."""

import numpy as np
import pytest
from scipy.stats import ncx2

from tests.methods.toy import OPTIMUM, OWN, Context, Quadratic, Rosenbrock
from tests.methods.toy_bodies import Sculpture
from zoobench import registry
from zoobench.methods.base import Solution
from zoobench.registry import Kind
from zoobench.spec import Budget, Ref

pytestmark = pytest.mark.usefixtures("no_checkpoints")
TAGS = {name: registry.get(Kind.METHOD, name).tags for name in OWN}
POLICIES = [name for name, tags in TAGS.items() if "policy" in tags]
"""They do not look for parameters on a parabola: `test_ppo.py` has a toy with a known best policy."""
DRAWING = [name for name, tags in TAGS.items() if tags & {"baseline", "study"}]
SEEKING = [name for name in TAGS if name not in DRAWING + POLICIES]
CONVERGING = [name for name, tags in TAGS.items() if "gradient" in tags or name == "cmaes"]

# where the default would not do, or would take longer than it must
SETTINGS = {
    # a hundredth is too much in a valley as steep as Rosenbrock's: it circles about the optimum, by the rounding
    "diffphysics": "diffphysics[lr=0.005,restarts=2]",
    # a hundred times as many kinds of points would each keep one that is best of its kind alone
    "quality-diversity": "quality-diversity[cells=5]",
}


def solve(name: str, problem: Quadratic, seed: int = 1) -> Solution:
    """The solution of the method."""
    method = registry.create(Kind.METHOD, Ref.parse(SETTINGS.get(name, name)))
    solution: Solution = method.run(problem, Context(seed))
    return solution


def puzzle(name: str) -> Quadratic:
    """A problem for the method: a body for painters of bodies, else a parabola. The best is 1."""
    return Sculpture(Budget("episodes", 300)) if "sites" in TAGS[name] else Quadratic(Budget("episodes", 1000))


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.slow if name in ("evolution", "neat") else ())
        for name in SEEKING
        if name not in CONVERGING
    ],
)
def test_a_method_finds_the_optimum(name: str) -> None:
    """Within 0.05 of the best possible score."""
    assert 0.95 < solve(name, puzzle(name)).evaluation.score <= 1.0


@pytest.mark.parametrize("name", CONVERGING)
@pytest.mark.parametrize(
    ("toy", "best", "episodes"),
    [(Quadratic, OPTIMUM, 1000), pytest.param(Rosenbrock, np.ones(4), 4000, marks=pytest.mark.slow)],
)
def test_a_method_for_continuous_parameters_converges(
    name: str, toy: type[Quadratic], best: np.ndarray, episodes: int
) -> None:
    """A sphere and Rosenbrock's function in four dimensions: every parameter to 0.01."""
    np.testing.assert_allclose(solve(name, toy(Budget("episodes", episodes))).params, best, atol=1e-2)


@pytest.mark.parametrize("name", DRAWING)
def test_random_draws_come_as_near_as_chance_has_it(name: str) -> None:
    """The nearest of n normal draws: its squared distance is the least of n noncentral chi-squares, in each of 5 runs.

    Its distribution is exact, 1 - (1 - F)^n; the bounds leave out one run in ten thousand.
    """
    count = 400
    for seed in range(5):
        problem = Quadratic(Budget("episodes", count))
        gap = float(((solve(name, problem, seed).params - OPTIMUM) ** 2).sum())
        chance = 1.0 - ncx2.sf(gap, len(OPTIMUM), float((OPTIMUM**2).sum())) ** count
        assert 5e-5 < chance < 1.0 - 5e-5
