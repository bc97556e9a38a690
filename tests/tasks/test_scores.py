"""Ratios of scores."""

import math

import pytest

from zoobench.tasks.scores import score_ratio


@pytest.mark.parametrize(
    ("better", "worse", "ratio"),
    [(3.0, 2.0, 1.5), (-2.0, -3.0, 1.5), (1.0, -1.0, math.inf), (1.0, 0.0, math.inf), (0.0, -1.0, math.inf)],
)
def test_the_better_is_so_many_times_better(better: float, worse: float, ratio: float) -> None:
    """Of gains the larger by the smaller, of errors the smaller; of unlike ones, no number of times."""
    assert score_ratio(better, worse) == ratio
