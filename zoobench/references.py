"""Reference scores: what doing nothing and what random controllers give in a cell, for scores to be compared with."""

import math
from dataclasses import replace

import numpy as np

from zoobench.problem import Problem
from zoobench.seeding import generator
from zoobench.spec import Budget, RunSpec
from zoobench.tasks.base import Metric

DRAWS = 8
"""Random controllers that the second reference is the mean of."""

# Not the method or its seed: all runs of a cell are compared with the same references.
_AXES = ("env", "task", "design", "controller")


def reference_scores(spec: RunSpec) -> dict[str, Metric]:
    """The references of a run's cell, at its fidelity and episode length; no budget is charged for them.

    * `idle_score`: all parameters zero, which leaves every muscle at rest.
    * `random_score`: mean over `DRAWS` draws from the controller's prior; those that diverged have no score.

    One that has no finite score is left out.
    """
    # on one thread, one world at a time takes no longer than many and least memory
    problem = Problem(replace(spec, budget=Budget("episodes", 1 + DRAWS)), worlds=1)
    rng = generator(spec, "reference", _AXES)
    draws = [problem.initial(rng) for _ in range(DRAWS)]
    idle, *random = (item.score for item in problem.evaluate_batch([np.zeros(problem.parameter_count), *draws]))
    finite = [score for score in random if math.isfinite(score)]
    scores = {"idle_score": idle, "random_score": math.fsum(finite) / len(finite) if finite else math.nan}
    return {name: Metric(score, problem.task.unit) for name, score in scores.items() if math.isfinite(score)}
