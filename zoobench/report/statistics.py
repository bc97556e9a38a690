"""The figures of a table's cell: mean and Student-t interval over seeds, and when a winner may be called one."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from statistics import fmean

CONFIDENCE = 0.95


@dataclass(frozen=True)
class Interval:
    """A mean over seeds with its confidence interval, all in the unit of the samples.

    Attributes:
        mean: arithmetic mean.
        half_width: half of the interval; None where the samples say nothing about the spread: there is one alone, or
            all are equal, as they are where nothing depends on the seed.
        count: how many samples stand behind it.
    """

    mean: float
    half_width: float | None
    count: int

    @property
    def low(self) -> float | None:
        """Lower end of the interval, None without one."""
        return None if self.half_width is None else self.mean - self.half_width

    @property
    def high(self) -> float | None:
        """Upper end of the interval, None without one."""
        return None if self.half_width is None else self.mean + self.half_width


def t_interval(samples: Sequence[float]) -> Interval | None:
    """Mean and two-sided Student-t interval: mean +- t(`CONFIDENCE`, n - 1) s / sqrt(n); None without samples.

    Equal samples have no interval: one of no width would claim that the mean is known exactly.

    A percentile bootstrap of three seeds covers about 75 %, so it is not used for so few samples.

    Raises:
        ValueError: a sample is not finite. A failed or diverged run has no score, so it must not reach this function.
    """
    if not all(math.isfinite(sample) for sample in samples):
        raise ValueError("A sample is not finite. Leave failed and diverged runs out before averaging.")
    count = len(samples)
    if count == 0:
        return None
    mean = fmean(samples)
    if min(samples) == max(samples):
        return Interval(samples[0], None, count)
    quantile = _quantile(count - 1)
    deviation = math.sqrt(math.fsum((sample - mean) ** 2 for sample in samples) / (count - 1))
    return Interval(mean, quantile * deviation / math.sqrt(count), count)


@cache
def _quantile(freedom: int) -> float:
    """The two-sided quantile of Student's t distribution; loads scipy once, for whole tables."""
    from scipy.special import stdtrit

    return float(stdtrit(freedom, 0.5 + CONFIDENCE / 2))


def clear_winner(intervals: Sequence[Interval | None]) -> int | None:
    """The index of the highest mean if its interval lies above every other one, else None.

    Non-overlapping intervals are a stricter demand than a test of the difference at the same level. Entries that
    are None (nothing finished) do not compete; without a rival, or without an interval on either side, nobody wins.
    """
    rivals = [(index, interval) for index, interval in enumerate(intervals) if interval is not None]
    if len(rivals) < 2:
        return None
    best, leader = max(rivals, key=lambda entry: entry[1].mean)
    if leader.low is None:
        return None
    for index, interval in rivals:
        if index != best and (interval.high is None or interval.high >= leader.low):
            return None
    return best
