"""Checkpoints and the incumbent."""

import math

import numpy as np
import pytest
import torch

from zoobench.cell.episode import Evaluation
from zoobench.errors import UsageError
from zoobench.methods.base import Incumbent, is_milestone, pack, unpack


def _evaluation(score: float) -> Evaluation:
    return Evaluation(score, {}, np.zeros(1))


def test_a_checkpoint_keeps_every_bit() -> None:
    """Doubles, infinities, the 128-bit state of a generator and tensors are restored exactly."""
    state = {
        "third": 1 / 3,
        "worst": -math.inf,
        "rng": np.random.default_rng(7).bit_generator.state,
        "tensor": torch.rand(3, dtype=torch.float64),
        "list": [None, "text", 2**127],
    }
    back = unpack(pack(state))
    assert torch.equal(back.pop("tensor"), state.pop("tensor"))
    assert back == state


def test_a_checkpoint_of_something_else_is_not_loaded() -> None:
    """Only plain data is read: a stored object cannot run code."""
    with pytest.raises(Exception, match=r"Unsupported|weights_only"):
        unpack(pack({"object": Incumbent()}))


def test_the_first_of_two_equals_stays() -> None:
    """A tie does not change the solution."""
    incumbent = Incumbent()
    incumbent.offer(np.array([1.0]), _evaluation(0.5))
    incumbent.offer(np.array([2.0]), _evaluation(0.5))
    assert incumbent.solution().params == [1.0]
    incumbent.offer(np.array([3.0]), _evaluation(0.6))
    assert incumbent.solution().params == [3.0]


@pytest.mark.parametrize("score", [math.nan, math.inf, -math.inf])
def test_a_score_that_is_no_number_never_wins(score: float) -> None:
    """NaN is never taken, since no score compares greater."""
    incumbent = Incumbent()
    incumbent.offer(np.array([1.0]), _evaluation(score))
    assert incumbent.score is None
    incumbent.offer(np.array([2.0]), _evaluation(0.5))
    incumbent.offer(np.array([3.0]), _evaluation(score))
    assert incumbent.solution().params == [2.0]


def test_few_iterations_are_milestones_however_many_there_are() -> None:
    """1, 2, 4, 8: eighteen in a hundred thousand."""
    assert [step for step in range(20) if is_milestone(step)] == [1, 2, 4, 8, 16]
    assert sum(map(is_milestone, range(200_000))) == 18


def test_scores_that_are_all_nan_are_told_of() -> None:
    """Evaluations that ended well without one finite score are the task's fault, after a restart as well."""
    incumbent = Incumbent()
    for score in (math.nan, math.inf):
        incumbent.offer(np.array([1.0]), _evaluation(score))
    with pytest.raises(UsageError, match="2 evaluations ended well with a score that is NaN or infinite"):
        Incumbent.from_state(incumbent.state()).solution()
