"""Checks of components in a cell, through the simulator."""

from collections.abc import Callable

import numpy as np

from zoobench import registry
from zoobench.arrays import Array
from zoobench.cell.problem import Problem
from zoobench.methods.base import Method, Solution
from zoobench.registry import Kind
from zoobench.spec import FRAME_SECONDS, Budget, RunSpec
from zoobench.testing.memory_context import MemoryContext
from zoobench.testing.small_cells import small_cell

_READINGS = {"score", "distance", "distance_travelled", "mean_speed", "actuation_energy", "cost_of_transport"}


def mean_reward(rewards: Array) -> float:
    """The score of a task that does not grow with the episode."""
    return float(rewards.mean())


def check_cell(spec: RunSpec, score_of: Callable[[Array], float] | None = mean_reward) -> None:
    """Check that an episode is finite, repeatable to the bit and differentiable.

    Score, rewards, metrics and gradient are finite and metrics have units; a second problem gives the same bits; and
    the derivative along a random direction is that of central differences to 1e-4, for which the fidelity should be
    `DOUBLE`.

    Args:
        spec: the cell, as `small_cell` makes it.
        score_of: the score that follows from the rewards `[frames]`; None if it does not.

    Raises:
        AssertionError: one of these does not hold.
    """
    problem = Problem(spec)
    params = problem.initial(np.random.default_rng(1))
    evaluation, gradient = problem.loss_and_grad(params)
    assert evaluation.failure is None, f"The episode failed: {evaluation.failure}"
    assert evaluation.reward.shape == (spec.frames,), f"{evaluation.reward.shape} rewards for {spec.frames} frames."
    if score_of is not None:
        wanted = score_of(evaluation.reward)
        agrees = abs(evaluation.score - wanted) <= 1e-12 * max(abs(wanted), 1.0)
        assert agrees, f"The score is {evaluation.score:g}, and by its rewards {wanted:g}."
    missing = _READINGS - set(evaluation.metrics)
    assert not missing, f"The task does not report {', '.join(sorted(missing))}. Add `common_readings(motion)`."
    for name, metric in evaluation.metrics.items():
        assert np.isfinite(metric.value), f"The reading {name} is {metric.value}."
        assert metric.unit, f"The reading {name} has no unit. Give '1' if it is a number."
    assert np.isfinite(gradient).all(), "The gradient is not finite."
    assert gradient.any(), "The gradient is zero: the score does not depend on the parameters."
    again, same_gradient = Problem(spec).loss_and_grad(params)
    np.testing.assert_array_equal(gradient, same_gradient)
    np.testing.assert_array_equal(evaluation.reward, again.reward)
    assert evaluation.metrics == again.metrics, "A second simulation of the same parameters has other metrics."
    _check_gradient(problem, params, gradient)


def check_rest(spec: RunSpec, fastest: float = 1e-6) -> None:
    """Check that a body with all muscles at rest stays where it is: else its score is not its own.

    Args:
        spec: the cell.
        fastest: mean speed that is allowed [m/s].

    Raises:
        AssertionError: the episode failed, or the body moved faster.
    """
    problem = Problem(spec)
    params = problem.initial(np.random.default_rng(3))
    params[: problem.robot.control_count] = 0.0
    evaluation = problem.evaluate(params)
    assert evaluation.failure is None, f"The episode failed: {evaluation.failure}"
    speed = abs(evaluation.metrics["distance"].value) / (spec.frames * FRAME_SECONDS)
    assert speed < fastest, f"It moves at {speed:g} m/s without muscle activity; {fastest:g} m/s are allowed."


def check_method(name: str) -> None:
    """Check a method on a small cell: it honours its budget, and interrupted it comes to the end of a whole run.

    Its solution gives its score again. A run stopped after two of four iterations and resumed from its checkpoint has
    the solution, facts, curve and cost of an uninterrupted run, bit for bit. A method that trains a policy begins its
    episodes anew, so that it need not.

    Raises:
        AssertionError: one of these does not hold.
    """
    component = registry.get(Kind.METHOD, name)
    tags, text = component.tags, f"{name}[population=4]" if "population" in component.parameters else name
    controller, text = ("policy-network", f"{name}[buffer=64]") if "policy" in tags else ("sine-basis", text)
    design = "voxel[edge=0.025]" if {"space", "sites"} & tags else "caterpillar"
    spec = small_cell(budget=Budget("iterations", 4), design=design, controller=controller, method=text)
    whole = _Trial(spec)
    solution = whole.run()
    counted = whole.problem.meter.iterations
    assert counted == 4, f"It counted {counted} iterations of 4. Add one to `problem.meter.iterations` after each."
    again = Problem(spec).evaluate(solution.params).score
    assert again == solution.evaluation.score, f"Its solution scores {again}, not {solution.evaluation.score}."
    assert whole.context.stored, "It kept no checkpoint. Call `keep(problem, context, incumbent)` after each iteration."
    if "policy" not in tags:
        _check_resumption(spec, whole, solution)


class _Trial:
    """A method with a problem and a context of its own; it may go on from a checkpoint, or stop early."""

    def __init__(self, spec: RunSpec, stored: bytes | None = None, stop_after: int | None = None) -> None:
        self._method: Method = registry.create(Kind.METHOD, spec.method)
        self.problem, self.context = Problem(spec), MemoryContext(stored=stored, stop_after=stop_after)

    def run(self) -> Solution:
        return self._method.run(self.problem, self.context)


def _check_resumption(spec: RunSpec, whole: _Trial, expected: Solution) -> None:
    """A run that is interrupted and goes on ends as the whole one did."""
    first = _Trial(spec, stop_after=2)
    first.run()
    stopped_at = first.problem.meter.iterations
    assert stopped_at == 2, f"It did {stopped_at} iterations, asked to stop after 2. Ask `context.should_stop()`."
    second = _Trial(spec, stored=first.context.stored)
    solution = second.run()
    cost, whole_cost = second.problem.meter.state(), whole.problem.meter.state()
    for state in (cost, whole_cost):
        del state["earlier_seconds"]
    agreements = {
        "score": solution.evaluation.score == expected.evaluation.score,
        "parameters": np.array_equal(solution.params, expected.params),
        "facts": dict(solution.facts) == dict(expected.facts),
        "curve": first.context.curve + second.context.curve == whole.context.curve,
        "cost": cost == whole_cost,
    }
    differing = [what for what, agrees in agreements.items() if not agrees]
    assert not differing, (
        f"Stopped after 2 iterations and resumed, it ends with another {', '.join(differing)}: score "
        f"{solution.evaluation.score}, not {expected.evaluation.score}. Give all state that the method has to "
        "`keep(problem, context, incumbent, name=...)`, and take it up from `context.restore()` when it begins."
    )


def _objective(problem: Problem, params: Array) -> float:
    """The task's objective, which may be a smooth substitute of the score."""
    recorded = problem.relaxed(params).recorded
    assert recorded is not None, "The body cannot be built."
    return float(problem.task.objective(recorded.motion))


def _check_gradient(problem: Problem, params: Array, gradient: Array) -> None:
    """Along a random direction it is the best of the central differences of four widths."""
    direction = np.random.default_rng(2).normal(size=params.shape)
    direction /= np.linalg.norm(direction)
    along = -float(gradient @ direction)
    errors = []
    for width in (1e-5, 1e-4, 1e-6, 1e-3):
        up, down = (_objective(problem, params + sign * width * direction) for sign in (1.0, -1.0))
        errors.append(abs((up - down) / (2 * width) - along))
        if errors[-1] <= 1e-4 * abs(along):
            return
    raise AssertionError(f"The derivative is {along}; central differences are off by {errors}.")
