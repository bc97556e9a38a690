"""Closed loops: observations change the motion, and gradients flow through both."""

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


def test_worlds_have_independent_feedback() -> None:
    """Scores and gradients of robots side by side are those of each robot alone, bit for bit."""
    problem = Problem(cell(controller="sine-feedback", frames=6))
    draws = [problem.initial(np.random.default_rng(seed)) for seed in range(3)]
    together = problem.loss_and_grad_batch(draws)
    for draw, (evaluation, gradient) in zip(draws, together, strict=True):
        alone, alone_gradient = problem.loss_and_grad(draw)
        assert alone.score == evaluation.score
        np.testing.assert_array_equal(alone_gradient, gradient)
