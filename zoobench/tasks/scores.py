"""How much better one score is than another."""

import math


def score_ratio(better: float, worse: float) -> float:
    """The better score by the worse, at least 1; infinite where one is positive and the other is not.

    Scores below zero are errors, as of the tasks with a path, where zero is perfect: the larger error by the smaller.
    """
    if worse > 0.0:
        return better / worse
    return worse / better if better < 0.0 else math.inf
