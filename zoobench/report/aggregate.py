"""A table's methods over all its rows: interquartile means, performance profiles, probabilities of improvement.

After Agarwal et al. 2021, Deep reinforcement learning at the edge of the statistical precipice, NeurIPS. The seeds are
resampled for an interval within each row and method (a stratified bootstrap); the rows are given by the benchmark and
are no sample of anything.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np

from zoobench.arrays import Array
from zoobench.report.entries import Entry, entry_labels
from zoobench.report.listing import Listing, Measured
from zoobench.report.statistics import CONFIDENCE
from zoobench.report.table_cell import TableCell
from zoobench.report.tables import Table

RESAMPLES = 2_000
HOW = (
    f"Over rows (Agarwal et al. 2021). IQM: the mean of the middle half of all runs' normalised scores, in the rows in "
    "which every method has a score from every seed; 0 is the better of a robot at rest and the mean random "
    "controller, 1 the best mean of the row. Probability of improvement: that a run of one method scores higher than "
    "one of the other in the same row (a tie counts half), mean over the rows that both have. In brackets: "
    f"{CONFIDENCE:.0%} intervals, from {RESAMPLES:,} percentile bootstraps over the seeds within each row and method."
)
_THRESHOLDS = np.linspace(0.0, 1.25, 51)
_AT_ONCE = 2_000_000  # numbers that a bootstrap holds at a time

Statistic = Callable[..., Array]


@dataclass(frozen=True)
class PerformanceProfile:
    """The performance profile of an entry.

    Attributes:
        thresholds: normalised scores.
        shares: of the runs, those whose normalised score is above each threshold.
    """

    entry: Entry
    thresholds: tuple[float, ...]
    shares: tuple[Measured, ...]


@dataclass(frozen=True)
class Aggregates:
    """The methods of a table over its rows.

    Attributes:
        table: that they compare.
        rows: number of rows in which every method has a normalised score from every seed.
        entries: the table's columns but agents from outside, whose cost is not known.
        means: interquartile means of normalised scores, by entry; empty without such a row.
        profiles: performance profiles by entry; empty without such a row.
        improvements: probabilities by entry and the other entry; without those that share no row.
    """

    table: Table
    rows: int
    entries: tuple[Entry, ...]
    means: dict[Entry, Measured]
    profiles: tuple[PerformanceProfile, ...]
    improvements: dict[tuple[Entry, Entry], Measured]


def aggregate(table: Table) -> Aggregates:
    """The methods of a table over its rows."""
    columns = {
        entry: [row.cells[place] for row in table.rows]
        for place, entry in enumerate(table.entries)
        if not entry.is_external
    }
    places = range(len(table.rows))
    common = [number for number in places if all(_is_complete(cells[number]) for cells in columns.values())]
    shares = {
        entry: [np.array(cell.shares) for number in common if (cell := cells[number]) is not None]
        for entry, cells in columns.items()
    }
    improvements = {}
    for one, other in permutations(columns, 2):
        if estimate := _improvement(columns[one], columns[other]):
            improvements[one, other] = estimate
    return Aggregates(
        table=table,
        rows=len(common),
        entries=tuple(columns),
        means={entry: _estimate(found, _interquartile_mean) for entry, found in shares.items() if found},
        profiles=tuple(_profile(entry, found) for entry, found in shares.items() if found),
        improvements=improvements,
    )


def aggregate_listing(found: Aggregates) -> Listing:
    """A row for each method: its interquartile mean, and the probability that it is better than each other one."""
    names = entry_labels(found.entries)
    rows = [
        (
            names[entry],
            found.rows,
            found.means.get(entry),
            *(found.improvements.get((entry, other)) for other in found.entries),
        )
        for entry in found.entries
    ]
    over = (f"better than {names[other]}" for other in found.entries)
    return Listing(("method", "rows", "IQM", *over), tuple(rows))


def aggregate_records(found: Aggregates) -> Listing:
    """The same for programs, a row for each figure: `IQM`, or `improvement`, the probability of it over `other`."""
    means = [((entry, None), mean) for entry, mean in found.means.items()]
    rows = [
        (
            str(entry.controller), str(entry.method), "IQM" if other is None else "improvement",
            other and str(other.controller), other and str(other.method),
            value.value, value.low, value.high, found.rows,
        )
        for (entry, other), value in [*means, *found.improvements.items()]
    ]  # fmt: skip
    columns = ("controller", "method", "statistic", "other_controller", "other", "value", "low", "high", "rows")
    return Listing(columns, tuple(rows))


def _is_complete(cell: TableCell | None) -> bool:
    return cell is not None and _is_whole(cell) and len(cell.shares) > 0


def _is_whole(cell: TableCell) -> bool:
    """Whether every seed has a score: a method must not gain by failing where it is bad."""
    return cell.count == cell.asked and cell.count > 0


def _improvement(cells: Sequence[TableCell | None], others: Sequence[TableCell | None]) -> Measured | None:
    """The probability of improvement; None where no row has both methods."""
    pairs = [
        (np.array(one.scores), np.array(other.scores))
        for one, other in zip(cells, others, strict=True)
        if one is not None and other is not None and _is_whole(one) and _is_whole(other)
    ]
    return _estimate([scores for pair in pairs for scores in pair], _probability) if pairs else None


def _profile(entry: Entry, rows: Sequence[Array]) -> PerformanceProfile:
    above = [(row > _THRESHOLDS[:, None]).astype(float) for row in rows]
    value = _mean(*above)
    low, high = _interval(above, _mean) or (None, None)
    ends = [(None, None)] * len(value) if low is None or high is None else zip(low, high, strict=True)
    shares = (Measured(share, *end, by_ends=True) for share, end in zip(value, ends, strict=True))
    return PerformanceProfile(entry, tuple(_THRESHOLDS), tuple(shares))


def _estimate(samples: Sequence[Array], statistic: Statistic) -> Measured:
    """A figure with its interval, which it does not have where the seeds say nothing about the spread."""
    found, value = _interval(samples, statistic), float(statistic(*samples))
    if found is None or found[0] == found[1]:  # equal scores say nothing about the spread
        return Measured(value)
    return Measured(value, float(found[0]), float(found[1]), by_ends=True)


def _interval(samples: Sequence[Array], statistic: Statistic) -> tuple[Array, Array] | None:
    """The ends of the bootstrap's interval, each sample resampled by itself; None where one has a single seed."""
    from scipy.stats import bootstrap

    if min(sample.shape[-1] for sample in samples) < 2:
        return None
    size = sum(sample.size for sample in samples)
    found = bootstrap(
        samples, statistic, n_resamples=RESAMPLES, confidence_level=CONFIDENCE, method="percentile", vectorized=True,
        axis=-1, batch=max(1, _AT_ONCE // size), rng=np.random.default_rng(0),
    ).confidence_interval  # fmt: skip
    return found.low, found.high


def _interquartile_mean(*samples: Array, axis: int = -1) -> Array:
    from scipy.stats import trim_mean

    mean: Array = trim_mean(np.concatenate(samples, axis=axis), 0.25, axis=axis)
    return mean


def _mean(*samples: Array, axis: int = -1) -> Array:
    mean: Array = np.concatenate(samples, axis=axis).mean(axis=axis)
    return mean


def _probability(*samples: Array, axis: int = -1) -> Array:
    """Mann-Whitney's U by its largest value, mean over pairs of samples."""
    found = []
    for one, other in zip(samples[::2], samples[1::2], strict=True):
        difference = one[..., :, None] - other[..., None, :]
        found.append(((difference > 0) + 0.5 * (difference == 0)).mean(axis=(-2, -1)))
    mean: Array = np.mean(found, axis=0)
    return mean
