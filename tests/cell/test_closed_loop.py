"""Closed loops: observations change the motion."""

import numpy as np

from tests.conformance.cells import cell
from zoobench.cell.problem import Problem


def test_feedback_changes_what_the_robot_does() -> None:
    """The same basis gives different episodes with the network and without it."""
    problem = Problem(cell(controller="sine-feedback", frames=10))
    params = problem.initial(np.random.default_rng(0))
    blind = params.copy()
    basis = Problem(cell(frames=10)).parameter_count
    blind[basis:] = 0.0
    assert problem.evaluate(params).score != problem.evaluate(blind).score
    assert problem.evaluate(blind).score == Problem(cell(frames=10)).evaluate(blind[:basis]).score
