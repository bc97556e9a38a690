"""Normalised scores: where a mean lies between the references of its row and the row's best."""

import math
from collections.abc import Iterable, Sequence

REFERENCES = ("idle_score", "random_score")


def floor_of(floors: Iterable[float | None]) -> float | None:
    """The score that asks for no method, from the better reference score of each run of a row.

    The mean, as the runs agree in it unless their scene depends on the seed; None if no run knows it.
    """
    known = [floor for floor in floors if floor is not None]
    return math.fsum(known) / len(known) if known else None


def shares(means: Sequence[float | None], floor: float | None) -> list[float | None]:
    """Each mean score as a share in [0, 1] of the way from the floor to the best of them.

    0 for whatever does not exceed the floor. None where a mean or the floor is missing.
    """
    known = [mean for mean in means if mean is not None]
    if floor is None or not known:
        return [None] * len(means)
    span = max(known) - floor
    return [None if mean is None else max(mean - floor, 0.0) / span if span > 0 else 0.0 for mean in means]


def run_shares(scores: Sequence[float], floor: float | None, best: float | None) -> tuple[float, ...]:
    """The score of each run as a share of the way from the floor to the best mean, and below 0 where it is worse.

    Empty where either is missing, or the best is no better than the floor.
    """
    if floor is None or best is None or best <= floor:
        return ()
    return tuple((score - floor) / (best - floor) for score in scores)
