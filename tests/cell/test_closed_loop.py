"""Closed loops: what is felt decides what is done, and gradients go through both."""

import numpy as np

from tests.conformance.cells import cell
from zoobench.cell.problem import Problem


def test_feedback_changes_what_the_robot_does() -> None:
    """The same basis, with the network and without it, gives different episodes."""
    problem = Problem(cell(controller="sine-feedback", frames=10))
    params = problem.initial(np.random.default_rng(0))
    blind = params.copy()
    basis = Problem(cell(frames=10)).parameter_count
    blind[basis:] = 0.0
    assert problem.evaluate(params).score != problem.evaluate(blind).score
    assert problem.evaluate(blind).score == Problem(cell(frames=10)).evaluate(blind[:basis]).score


def test_every_robot_feels_itself_alone() -> None:
    """Robots side by side give what each gives alone, gradients too."""
    problem = Problem(cell(controller="sine-feedback", frames=6))
    draws = [problem.initial(np.random.default_rng(seed)) for seed in range(3)]
    together = problem.loss_and_grad_batch(draws)
    for draw, (evaluation, slope) in zip(draws, together, strict=True):
        alone, alone_slope = problem.loss_and_grad(draw)
        assert alone.score == evaluation.score
        np.testing.assert_array_equal(alone_slope, slope)
