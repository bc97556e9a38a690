"""The interval of a cell and the naming of winners, on data whose truth is known."""

import math

import numpy as np
import pytest
from scipy import stats

from zoobench.report.statistics import Interval, clear_winner, t_interval


@pytest.mark.parametrize("count", [2, 3, 5, 20])
def test_the_interval_covers_the_true_mean_in_95_of_100_experiments(count: int) -> None:
    """Over 4000 synthetic experiments the coverage is 95 % within four standard errors, at any number of seeds."""
    rng = np.random.default_rng(7)
    experiments = rng.normal(3.0, 2.0, size=(4000, count))
    hits = 0
    for samples in experiments:
        interval = t_interval(samples.tolist())
        assert interval is not None
        assert interval.low is not None
        assert interval.high is not None
        hits += interval.low <= 3.0 <= interval.high
    assert abs(hits / 4000 - 0.95) < 4 * math.sqrt(0.95 * 0.05 / 4000)


def test_the_interval_agrees_with_scipy() -> None:
    """Another implementation of Student's interval gives the same ends."""
    samples = [0.3, 0.1, 0.45, 0.2]
    interval = t_interval(samples)
    expected = stats.t.interval(0.95, df=3, loc=np.mean(samples), scale=stats.sem(samples))
    assert interval is not None
    np.testing.assert_allclose([interval.low, interval.high], expected, rtol=1e-12)


def test_two_seeds_have_the_wide_interval_that_they_deserve() -> None:
    """With n = 2 the quantile is 12.706, so half of the interval is 12.706 |a - b| / 2."""
    interval = t_interval([1.0, 2.0])
    assert interval is not None
    assert interval.half_width == pytest.approx(12.7062 / 2, rel=1e-5)


def test_one_seed_has_a_mean_but_no_interval() -> None:
    """A single sample says nothing about the spread."""
    assert t_interval([4.0]) == Interval(4.0, None, 1)
    assert t_interval([]) is None


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_score_that_is_not_finite_is_refused(bad: float) -> None:
    """A diverged run must not slip into a mean."""
    with pytest.raises(ValueError, match="not finite"):
        t_interval([1.0, bad])


def test_a_winner_needs_an_interval_above_all_others() -> None:
    """The highest mean wins only if its interval overlaps with none."""
    high, low, wide = Interval(2.0, 0.1, 3), Interval(1.0, 0.2, 3), Interval(1.5, 0.9, 3)
    assert clear_winner([low, high, None]) == 1
    assert clear_winner([low, high, wide]) is None


@pytest.mark.parametrize(
    "intervals",
    [
        [],
        [Interval(1.0, 0.1, 3)],
        [Interval(1.0, 0.1, 3), None],
        [Interval(5.0, None, 1), Interval(1.0, 0.1, 3)],
        [Interval(5.0, 0.1, 3), Interval(1.0, None, 1)],
    ],
)
def test_nobody_wins_without_a_rival_or_on_a_single_seed(intervals: list[Interval | None]) -> None:
    """A lone method, or a single seed on either side, supports no verdict."""
    assert clear_winner(intervals) is None


def test_equal_methods_are_rarely_called_different() -> None:
    """Two methods with the same true mean get a winner in fewer than 5 of 100 synthetic comparisons."""
    rng = np.random.default_rng(11)
    winners = 0
    for _ in range(1000):
        first, second = (t_interval(rng.normal(size=3).tolist()) for _ in range(2))
        winners += clear_winner([first, second]) is not None
    assert winners < 50


def test_equal_samples_have_no_interval() -> None:
    """One of no width would say that the mean is known exactly, of seven sevenths as of anything."""
    for value in (0.1, 1 / 7, -3e-9):
        interval = t_interval([value] * 7)
        assert interval == Interval(value, None, 7)
