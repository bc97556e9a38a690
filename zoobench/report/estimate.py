"""Estimated times of runs, from finished runs of the same kind in the database."""

from collections.abc import Sequence
from statistics import median

from zoobench.db.rows import RunState
from zoobench.report.run_results import RunResult
from zoobench.spec import RunSpec

_SUBSTEPS = ("forward_substeps", "recomputed_substeps", "backward_substeps")


def estimate_seconds(spec: RunSpec, past: Sequence[RunResult]) -> float | None:
    """The expected wall time of a run [s], None if no run in the database is comparable.

    The median time of finished runs that differ by the seed only. Without any, for a budget in substeps: the amount
    times the median time per substep of runs with the same environment, design and fidelity, those of the same
    method before others.
    """
    if spec.budget.kind == "seconds":
        return spec.budget.amount
    done = [result for result in past if result.run.state is RunState.DONE and result.run.seconds > 0]
    same_cell = [result.run.seconds for result in done if result.run.spec.cell() == spec.cell()]
    if same_cell:
        return median(same_cell)
    if spec.budget.kind != "substeps":
        return None  # an iteration of another method or with other parameters is another amount of work
    alike = [result for result in done if _place(result.run.spec) == _place(spec) and _substeps(result)]
    same_method = [result for result in alike if result.run.spec.method.name == spec.method.name]
    paces = [result.run.seconds / _substeps(result) for result in same_method or alike]
    return spec.budget.amount * median(paces) if paces else None


def total_seconds(estimates: Sequence[float | None], jobs: int) -> float | None:
    """Wall time [s] of all runs on this many workers that each take the next one; None if one is unknown."""
    busy = [0.0] * jobs
    for seconds in estimates:
        if seconds is None:
            return None
        busy[busy.index(min(busy))] += seconds
    return max(busy)


def _place(spec: RunSpec) -> tuple[object, ...]:
    return spec.env, spec.design, spec.fidelity


def _substeps(result: RunResult) -> float:
    return sum(result.finals[name].value for name in _SUBSTEPS if name in result.finals)
