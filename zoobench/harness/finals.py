"""The final results of a run as they are stored."""

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from zoobench.errors import UsageError

if TYPE_CHECKING:
    from zoobench.cell.problem import Problem
    from zoobench.methods.base import Solution
    from zoobench.tasks.base import Metric

Final = tuple[str, float, str]
"""Name, value and unit of a final result."""


def finals_of(problem: "Problem", solution: "Solution", references: "Mapping[str, Metric]") -> list[Final]:
    """The final results as name, value and unit.

    Score, the task's metrics, the reference scores, what was spent, and the method's facts.

    Raises UsageError if one of them, or of the parameters, is NaN or infinite.

    No times, and nothing that depends on the machine's memory: two runs of one spec must agree in every number.
    """
    meter = problem.meter
    spent: Mapping[str, float] = {
        "forward_substeps": meter.forward,
        "backward_substeps": meter.backward,
        "equilibration_substeps": meter.equilibration,
        "repeated_frames": meter.retries,
        "episodes": meter.episodes,
        "iterations": meter.iterations,
        "budget_spent": meter.has_ended(problem.spec.budget),  # 0 where the method's own settings ask for no more
    }
    metrics = {**solution.evaluation.metrics, **references}
    rows = {name: (metric.value, metric.unit) for name, metric in metrics.items()}
    rows |= {name: (float(value), "") for name, value in {**solution.facts, **spent}.items()}
    rows["score"] = (solution.evaluation.score, rows.get("score", (0.0, ""))[1])
    _check_numbers({name: value for name, (value, _) in rows.items()}, solution.params.tolist())
    return [(name, float(value), unit) for name, (value, unit) in sorted(rows.items())]


def _check_numbers(finals: Mapping[str, float], params: Sequence[float]) -> None:
    """Raise UsageError if one of a run's results is NaN or infinite."""
    numbers = {**finals, **{f"parameter {number}": value for number, value in enumerate(params)}}
    wrong = [f"{name} = {value:g}" for name, value in numbers.items() if not math.isfinite(value)]
    if wrong:
        raise UsageError(
            f"The solution has {', '.join(wrong[:3])}, and only finite numbers are results. Correct what gives them: "
            "the task or the method."
        )
