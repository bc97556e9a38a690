"""A result is what the harness has seen: a method's solution is simulated once more, and must give its score again.

This finds forgeries and honest mistakes alike, such as a solution that was changed in place after its evaluation.
"""

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import TYPE_CHECKING

import numpy as np

from zoobench.errors import UsageError
from zoobench.spec import Budget, on_gpu

if TYPE_CHECKING:
    from zoobench.cell.meter import BudgetMeter
    from zoobench.cell.problem import Problem
    from zoobench.methods.base import Solution


def repeated(problem: "Problem", solution: "Solution") -> "Solution":
    """The solution with the evaluation that another simulation of its parameters gives; no budget pays for that.

    On a GPU, where last digits differ from run to run, the evaluation stays the method's.

    Raises:
        UsageError: the parameters are not `[parameter_count]` or not finite, give another score than the solution's or
            none, a fact has the name of a reading, or the meter holds what it cannot have counted.
    """
    from zoobench.cell.problem import Problem

    check_parameters(solution.params, problem.parameter_count)
    _check_meter(problem.meter)
    _check_facts(solution.facts, solution.evaluation.metrics)
    if on_gpu(problem.spec):
        return solution
    again = Problem(replace(problem.spec, budget=Budget("episodes", 1)), worlds=1).evaluate(solution.params)
    if again.score != solution.evaluation.score:
        outcome = f"score {again.score!r}" if again.failure is None else f"no score: {again.failure}"
        raise UsageError(
            f"The solution was given with the score {solution.evaluation.score!r}, and simulated once more its "
            f"parameters give {outcome}. Correct the method: a solution is parameters and the evaluation that they had."
        )
    return replace(solution, evaluation=again)


def check_parameters(params: object, count: int) -> None:
    """Refuse what is no vector of so many finite numbers.

    Raises:
        UsageError: it is none.
    """
    given = np.asarray(params)
    if given.shape != (count,) or given.dtype.kind not in "fiu":
        raise UsageError(
            f"The method gave parameters of shape {given.shape}; ({count},) was expected. Correct the method."
        )
    if wrong := [f"parameter {place} = {given[place]:g}" for place in np.flatnonzero(~np.isfinite(given))[:3]]:
        raise UsageError(f"The method gave {', '.join(wrong)}. Only finite numbers can be kept. Correct the method.")


def _check_meter(meter: "BudgetMeter") -> None:
    """Refuse counts that nothing can have counted."""
    for item in fields(meter):
        value = getattr(meter, item.name)
        if item.type is int and not (isinstance(value, int) and value >= 0):
            raise UsageError(
                f"The meter holds {value!r} {item.name}. A method adds whole numbers to `iterations`, and leaves the "
                "other counts to the problem."
            )


def _check_facts(facts: Mapping[str, float], metrics: Mapping[str, object]) -> None:
    """Refuse facts that would take the place of readings."""
    if both := sorted(facts.keys() & metrics.keys()):
        raise UsageError(f"The fact {both[0]!r} of the solution has the name of a reading. Give it another name.")
