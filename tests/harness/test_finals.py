"""What a child process gives: results, and points of curves."""

import math

import numpy as np
import pytest

from tests.methods.toy import Quadratic
from zoobench.cell.episode import Evaluation
from zoobench.errors import UsageError
from zoobench.harness.child import ChildContext, Orders
from zoobench.harness.finals import finals_of
from zoobench.methods.base import Solution
from zoobench.spec import Budget
from zoobench.tasks.base import Metric
from zoobench.testing import small_cell


@pytest.mark.parametrize(
    ("score", "error", "parameter", "wrong"),
    [
        (math.nan, 0.0, 0.0, "score = nan"),
        (-math.inf, 0.0, 0.0, "score = -inf"),
        (1.0, math.inf, 0.0, "heading_error = inf"),
        (1.0, 0.0, math.nan, "parameter 1 = nan"),
    ],
)
def test_a_result_that_is_no_number_is_none(score: float, error: float, parameter: float, wrong: str) -> None:
    """The run has failed, and the reason names what is wrong; with finite numbers it has a result."""
    problem = Quadratic(Budget("episodes", 1))

    def results(score: float, error: float, parameter: float) -> list[tuple[str, float, str]]:
        evaluation = Evaluation(score, {"heading_error": Metric(error, "rad")}, np.zeros(1))
        return finals_of(problem, Solution(np.array([0.0, parameter]), evaluation), {})  # type: ignore[arg-type]

    assert ("score", 1.0, "") in results(1.0, 0.0, 0.0)
    with pytest.raises(UsageError, match=wrong):
        results(score, error, parameter)


def test_a_curve_of_a_million_points_is_thinned() -> None:
    """What is left has round steps, so that a resumed run has the same; what is no step is left to be refused."""
    steps: list[int] = []

    class Wire:
        def send(self, kind: str, *, step: int, values: object) -> None:
            steps.append(step)

    context = ChildContext(small_cell(), Wire(), None, Orders())  # type: ignore[arg-type]
    for step in (*range(99_000, 101_000), *range(999_900, 1_000_200), 2**70):
        context.report(step, position=1.0)
    wanted = (
        range(99_000, 100_000),
        range(100_000, 101_000, 10),
        range(999_900, 10**6, 10),
        range(10**6, 1_000_200, 100),
    )
    assert steps == [*(step for each in wanted for step in each), 2**70]
