"""Bodies and controllers in one population."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.methods.toy import OPTIMUM, Context, OneSite, Quadratic
from zoobench.methods.evolution import Evolution
from zoobench.methods.hyperneat import HyperNeat
from zoobench.spec import Budget


@pytest.mark.slow  # test_known_answers.py has the optimum of one species
@pytest.mark.usefixtures("no_checkpoints")
def test_it_finds_body_and_controller() -> None:
    """Of the quadratic problem, within 0.3 of the optimum in the median of three runs of 300 generations.

    Not in each of them: a controller is judged by the body that it happened to be paired with, and the other way round.
    Three species of ten bodies keep a champion each, so that it takes longer than one species would.
    """
    method = Evolution(generations=300)
    runs = [method.run(Quadratic(Budget("episodes", 3000)), Context(seed)) for seed in range(3)]  # type: ignore[arg-type]
    gaps = [float(np.linalg.norm(solution.params - OPTIMUM)) for solution in runs]
    assert np.median(gaps) < 0.3


@pytest.mark.usefixtures("no_checkpoints")
def test_it_ends_after_a_hundred_generations_of_ten() -> None:
    """As in the specification, with any budget; the facts are those of both parts."""
    problem = Quadratic(Budget("episodes", 5000))
    solution = Evolution().run(problem, Context())  # type: ignore[arg-type]
    assert len(problem.seen) == 1000
    assert {"iterations", "species", "nodes", "connections", "strategies"} <= solution.facts.keys()


def test_controllers_are_drawn_around_one_start() -> None:
    """In the first generation controllers have a deviation of 0.1, bodies a larger one."""
    problem = Quadratic(Budget("episodes", 40))
    Evolution(population=40).run(problem, Context())  # type: ignore[arg-type]
    deviations = np.std(problem.seen, axis=0)
    assert 0.07 < deviations[0] < 0.13
    assert (deviations[1:] > 0.3).all()


def test_with_a_controller_without_parameters_it_is_neat() -> None:
    """The same bodies, bit for bit."""
    seen = []
    for method in (Evolution(generations=0), HyperNeat()):
        problem = Quadratic(Budget("iterations", 6))
        problem.robot = SimpleNamespace(control_count=0, space=OneSite(), site_space=OneSite())
        problem.body = SimpleNamespace(muscle_count=2, volumes=np.ones(1))
        method.run(problem, Context(4))  # type: ignore[arg-type]
        seen.append(problem.seen)
    np.testing.assert_array_equal(*seen)
