"""Budgets that do not suffice for the first iteration of a method, before anything is simulated."""

from dataclasses import replace
from functools import cache
from typing import NamedTuple

from zoobench import registry
from zoobench.cell.problem import Problem
from zoobench.errors import UsageError
from zoobench.methods.base import First
from zoobench.registry import Kind
from zoobench.spec import FRAME_SECONDS, Budget, Ref, RunSpec

_FAST = 90.0
"""Speed of waves [m/s]. A budget that covers the substeps of waves as fast as this is not examined, which saves
sampling the body; most scenes declare substeps for 10 to 55 m/s, and some with stiff objects for more."""

_ANY = Ref("random")
"""In place of the method, which the cost of an episode does not depend on."""

_MOST_PASSES = 3
"""A gradient counts as so many episodes at most."""


def budget_fault(spec: RunSpec) -> str:
    """Why a run's budget does not suffice for the first iteration of its method; empty if it does or is not examined.

    Budgets of seconds and iterations always do, and what a method without `first` takes is not known.
    """
    method, budget = registry.create(Kind.METHOD, spec.method), spec.budget
    if budget.kind not in ("episodes", "substeps") or not hasattr(method, "first"):
        return ""
    first: First = method.first(spec.frames)
    level = registry.create(Kind.FIDELITY, spec.fidelity)
    ample = FRAME_SECONDS / (level.step or level.courant * level.grid_spacing / _FAST)
    most = ample * (first.frames + _MOST_PASSES * first.gradient_frames)
    if budget.amount >= (first.episodes if budget.kind == "episodes" else most):
        return ""
    try:
        costs = _costs(replace(spec, method=_ANY, seed=0, budget=Budget("episodes", 1)))
    except UsageError as error:
        return str(error)
    if not costs.parameter_count:
        first = First(1, min(first.frames, spec.frames), min(first.gradient_frames, spec.frames))
    substeps = (first.frames * costs.episode + first.gradient_frames * costs.gradient) // spec.frames
    needed = first.episodes if budget.kind == "episodes" else substeps
    if budget.amount >= needed:
        return ""
    return (
        f"The first iteration of the method {spec.method.name!r} takes {needed:,} {budget.kind}, and the budget is "
        f"{budget}. Give --budget '{needed} {budget.kind}' or more, or a method with smaller iterations."
    )


class _Costs(NamedTuple):
    """What the cost of an iteration depends on, beside the method.

    Attributes:
        parameter_count: without any parameter, methods evaluate once.
        episode, gradient: declared substeps of an episode without and with a gradient.
    """

    parameter_count: int
    episode: int
    gradient: int


@cache
def _costs(spec: RunSpec) -> _Costs:
    problem = Problem(spec)
    return _Costs(problem.parameter_count, problem.cost(1, gradient=False), problem.cost(1, gradient=True))
