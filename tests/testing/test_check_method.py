"""The check of methods finds what one that follows the tutorial may forget."""

from dataclasses import dataclass

import numpy as np
import pytest

from zoobench import registry
from zoobench.cell.problem import Problem
from zoobench.methods.base import RunContext, Solution, keep, report, resume, unpack
from zoobench.registry import Kind, register
from zoobench.testing import check_method


@pytest.fixture(autouse=True)
def _momentum(monkeypatch: pytest.MonkeyPatch) -> None:
    """A method that climbs the gradient with momentum, and forgets what `FORGETS` says."""
    registry.names(Kind.METHOD)  # finds those that there are
    monkeypatch.setitem(registry._components, Kind.METHOD, dict(registry._components[Kind.METHOD]))

    @register(Kind.METHOD, "momentum", tags=("gradient",))
    @dataclass(frozen=True, kw_only=True)
    class Momentum:
        """Climb the gradient with momentum."""

        def run(self, problem: Problem, context: RunContext) -> Solution:
            """Climb until the budget is spent."""
            incumbent, stored = resume(problem, context), context.restore()
            state = unpack(stored) if stored else {}
            point = state.get("point") or problem.initial(context.rng).tolist()
            velocity = state.get("velocity") or [0.0] * len(point)
            steps = int(state.get("steps", 0))
            while problem.affords(gradient=True):
                evaluation, gradient = problem.loss_and_grad(np.array(point))
                incumbent.offer(np.array(point), evaluation)
                velocity = (0.9 * np.array(velocity) - 30.0 * gradient).tolist()
                point, steps = (np.array(point) + velocity).tolist(), steps + 1
                problem.meter.iterations += 1
                report(problem, context, incumbent, {"speed": float(np.linalg.norm(velocity))})
                whole = {"point": point, "velocity": velocity, "steps": steps}
                keep(problem, context, incumbent, **{key: whole[key] for key in whole if key != FORGETS[0]})
                if context.should_stop() and FORGETS[0] != "to stop":
                    break
            return incumbent.solution(steps=steps)


FORGETS = [""]


def _check(forgets: str) -> None:
    FORGETS[0] = forgets
    check_method("momentum")


def test_a_method_that_keeps_its_state_passes() -> None:
    """Momentum and gradient included."""
    _check("nothing")


@pytest.mark.parametrize(
    ("forgets", "words"),
    [
        ("velocity", "resumed, it ends with another .*curve"),
        ("point", "resumed, it ends with another"),
        ("steps", "resumed, it ends with another facts:"),
        ("to stop", "asked to stop after 2"),
    ],
)
def test_a_method_that_forgets_is_told(forgets: str, words: str) -> None:
    """What is left out of `keep` shows when the run is interrupted."""
    with pytest.raises(AssertionError, match=words):
        _check(forgets)
