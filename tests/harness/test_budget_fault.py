"""A budget that does not suffice for the first iteration of a method is refused before the run."""

from dataclasses import replace

import pytest

from tests.conformance.cells import cell
from zoobench import registry
from zoobench.cell.problem import Problem
from zoobench.errors import BudgetExhaustedError
from zoobench.harness.budget_fault import budget_fault
from zoobench.harness.grid import GridSpec, Skip, expand
from zoobench.registry import Kind
from zoobench.spec import Budget, RunSpec
from zoobench.testing import MemoryContext

EVOLUTION = {"method": "evolution[population=5]", "design": "voxel"}
PPO = {"method": "ppo[buffer=64,worlds=4,batch=2]", "controller": "policy-network"}
IN_SPACE = {"method": "diffphysics[restarts=2]", "design": "voxel"}
EPISODE = 42  # declared substeps of six frames at smoke


@pytest.mark.parametrize(
    ("names", "needed"),
    [
        ({"method": "random"}, Budget("episodes", 1)),
        ({"method": "random"}, Budget("substeps", EPISODE)),
        ({"method": "cmaes"}, Budget("episodes", 10)),
        ({"method": "cmaes[population=4]"}, Budget("substeps", 4 * EPISODE)),
        (EVOLUTION, Budget("episodes", 5)),
        (EVOLUTION, Budget("substeps", 5 * EPISODE)),
        (PPO, Budget("episodes", 4 * 3 + 1)),
        (PPO, Budget("substeps", 64 * EPISODE // 6 + EPISODE)),
        ({"method": "diffphysics"}, Budget("episodes", 8)),
        ({"method": "diffphysics"}, Budget("substeps", 2 * 8 * EPISODE)),
        (IN_SPACE, Budget("substeps", 3 * 2 * EPISODE)),
    ],
)
def test_the_smallest_budget_that_works_is_told(names: dict[str, str], needed: Budget) -> None:
    """One less is refused, and nothing else."""
    assert not budget_fault(cell(budget=needed, **names))
    told = budget_fault(cell(budget=Budget(needed.kind, needed.amount - 1 or 0.5), **names))
    assert f"Give --budget '{needed}' or more" in told


@pytest.mark.parametrize("names", [{"method": "cmaes"}, EVOLUTION, {"method": "diffphysics"}, {"method": "random"}])
def test_what_is_refused_fails_in_the_run(names: dict[str, str]) -> None:
    """By the method's own question to the problem, before anything is simulated."""
    spec = cell(budget=Budget("substeps", EPISODE - 1), **names)
    assert budget_fault(spec)
    with pytest.raises(BudgetExhaustedError):
        registry.create(Kind.METHOD, spec.method).run(Problem(spec), MemoryContext())


@pytest.mark.parametrize(
    ("budget", "names"),
    [
        (Budget("episodes", 1), {"method": "cmaes", "controller": "fixed-sine"}),
        (Budget("substeps", 2 * EPISODE), {"method": "diffphysics", "controller": "fixed-sine"}),
        (Budget("seconds", 0.1), {"method": "cmaes"}),
        (Budget("iterations", 1), {"method": "cmaes"}),
    ],
)
def test_what_begins_is_not_refused(budget: Budget, names: dict[str, str]) -> None:
    """A robot without parameters is evaluated once, and the first iteration fits any other kind of budget."""
    assert not budget_fault(cell(budget=budget, **names))


def test_the_plan_of_a_grid_skips_such_a_run() -> None:
    """With its reason; runs of other methods stay."""
    spec: RunSpec = replace(cell(method="cmaes"), budget=Budget("episodes", 1))
    methods = (spec.method, cell(method="random").method)
    axes = (spec.env,), (spec.task,), (spec.design,), (spec.controller,), methods
    skip, run = expand(GridSpec(*axes, (0,), spec.budget, spec.fidelity, spec.frames))
    assert isinstance(skip, Skip)
    assert "takes 10 episodes, and the budget is 1 episodes" in skip.reason
    assert isinstance(run, RunSpec)
