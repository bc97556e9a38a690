"""Normalised scores: where a mean lies between the references of its row and the row's best."""

import math
from collections.abc import Iterable, Sequence

from zoobench.report.run_results import RunResult

REFERENCES = ("idle_score", "random_score")


def floor_of(results: Iterable[RunResult]) -> float | None:
    """The score that asks for no method: the better of doing nothing and the mean random controller.

    Averaged over the runs of a row, which agree in it unless their scene depends on the seed; None if no run has both.
    """
    floors = [
        max(result.finals[name].value for name in REFERENCES)
        for result in results
        if all(name in result.finals and math.isfinite(result.finals[name].value) for name in REFERENCES)
    ]
    return math.fsum(floors) / len(floors) if floors else None


def shares(means: Sequence[float | None], floor: float | None) -> list[float | None]:
    """Each mean score as a share in [0, 1] of the way from the floor to the best of them.

    0 for whatever does not exceed the floor. None where a mean or the floor is missing.
    """
    known = [mean for mean in means if mean is not None]
    if floor is None or not known:
        return [None] * len(means)
    span = max(known) - floor
    return [None if mean is None else max(mean - floor, 0.0) / span if span > 0 else 0.0 for mean in means]
