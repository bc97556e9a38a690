"""Gradient ascent on a problem with a known optimum, and its rules for unusable gradients."""

import numpy as np
import pytest

from tests.methods.toy import OPTIMUM, Context, Quadratic
from zoobench.methods.diffphysics import DiffPhysics
from zoobench.spec import Budget

PLENTY = Budget("substeps", 1e9)


def test_it_finds_the_optimum() -> None:
    """200 steps of Adam reach the maximum of a parabola."""
    solution = DiffPhysics(iterations=200, restarts=2).run(Quadratic(PLENTY), Context())
    assert solution.params == pytest.approx(OPTIMUM, abs=1e-2)
    assert solution.evaluation.score == pytest.approx(1.0, abs=1e-3)


def test_it_makes_the_iterations_asked_for() -> None:
    """`iterations` ends the run before the budget, and every restart is evaluated in each iteration."""
    problem, context = Quadratic(PLENTY), Context()
    DiffPhysics(iterations=5, restarts=3).run(problem, context)
    assert problem.meter.iterations == 5
    assert len(problem.seen) == 15
    assert context.fractions[-1] == 1.0
    assert {f"restart_{i}" for i in range(3)} <= set(context.curve[-1][1])


def test_the_best_score_of_every_restart_is_kept() -> None:
    """The maximum of its curve; the best of all restarts is the result."""
    context = Context(3)
    solution = DiffPhysics(lr=1.0, iterations=6, restarts=4).run(Quadratic(PLENTY), context)
    kept = [solution.facts[f"restart_{i}_best"] for i in range(4)]
    assert kept == [max(metrics[f"restart_{i}"] for _, metrics in context.curve) for i in range(4)]
    assert len(set(kept)) == 4
    assert max(kept) == solution.evaluation.score


def test_a_restart_that_never_had_a_score_has_none_kept() -> None:
    """It has no entry."""
    first = Quadratic(PLENTY).initial(np.random.default_rng(0))
    problem = Quadratic(PLENTY, diverges=lambda params: bool(np.array_equal(params, first)))
    facts = DiffPhysics(iterations=1, restarts=2).run(problem, Context(0)).facts
    assert "restart_0_best" not in facts
    assert "restart_1_best" in facts


def test_restarts_do_not_influence_each_other() -> None:
    """The first of four restarts has the points of a single one."""
    alone, together = Context(3), Context(3)
    DiffPhysics(iterations=10, restarts=1).run(Quadratic(PLENTY), alone)
    DiffPhysics(iterations=10, restarts=4).run(Quadratic(PLENTY), together)
    first = [metrics["restart_0"] for _, metrics in alone.curve]
    assert first == [metrics["restart_0"] for _, metrics in together.curve]


def test_the_first_step_is_adams() -> None:
    """Adam's first step is the learning rate against the sign of every derivative."""
    problem = Quadratic(PLENTY)
    DiffPhysics(lr=0.05, iterations=2, restarts=1).run(problem, Context())
    start, second = problem.seen
    assert second - start == pytest.approx(0.05 * np.sign(OPTIMUM - start), rel=1e-4)


def test_long_gradients_are_clipped_and_counted() -> None:
    """Every gradient at a distant start is longer than the clip."""
    solution = DiffPhysics(iterations=4, restarts=2, clip=1e-3).run(Quadratic(PLENTY), Context())
    assert solution.facts["clipped_gradients"] == 8


def test_a_broken_gradient_neither_ends_the_run_nor_passes_in_silence() -> None:
    """A restart with NaN gradients draws again each time and is counted; others ascend."""
    first = Quadratic(PLENTY).initial(np.random.default_rng(0))
    problem = Quadratic(PLENTY, breaks=lambda params: bool(np.array_equal(params, first)))
    solution = DiffPhysics(iterations=150, restarts=2).run(problem, Context(0))
    assert solution.facts["nonfinite_gradients"] == 1
    assert solution.params == pytest.approx(OPTIMUM, abs=5e-2)


def test_a_gradient_of_a_length_beyond_all_numbers_is_not_finite(monkeypatch: pytest.MonkeyPatch) -> None:
    """Scaled to the clip it would be zero in every step."""
    problem = Quadratic(PLENTY)
    scored = problem._one
    monkeypatch.setattr(problem, "_one", lambda params: (scored(params)[0], np.full(4, 1e200)))
    solution = DiffPhysics(iterations=3, restarts=1).run(problem, Context(0))
    assert solution.facts["nonfinite_gradients"] == 3
    assert solution.facts["clipped_gradients"] == 0


def test_a_restart_that_begins_anew_forgets_the_old_place() -> None:
    """Its next step is Adam's first: the learning rate against the sign of every derivative."""
    problem = Quadratic(PLENTY, breaks=lambda params: len(problem.seen) == 5)
    DiffPhysics(iterations=7, restarts=1).run(problem, Context(0))
    moved = problem.seen[6] - problem.seen[5]
    assert moved == pytest.approx(0.1 * np.sign(OPTIMUM - problem.seen[5]), abs=1e-6)


def test_a_diverged_restart_goes_back_towards_its_best() -> None:
    """A step into divergence is followed by one half way back to the best point."""
    problem = Quadratic(PLENTY, diverges=lambda params: bool(params[0] > 0.3))
    DiffPhysics(iterations=30, restarts=1).run(problem, Context(0))
    falls = [i for i, params in enumerate(problem.seen[:-1]) if params[0] > 0.3]
    best = max(problem.seen[: falls[0]], key=lambda params: -((params - OPTIMUM) ** 2).sum())
    assert problem.seen[falls[0] + 1] == pytest.approx((problem.seen[falls[0]] + best) / 2)


def test_restarts_from_one_point_are_one() -> None:
    """If a warm start replaces all parameters, there is one restart."""

    class Warm(Quadratic):
        def initial(self, rng: np.random.Generator) -> np.ndarray:
            super().initial(rng)
            return np.zeros(self.parameter_count)

    problem = Warm(Budget("substeps", 200))
    solution = DiffPhysics(restarts=8).run(problem, Context())
    assert len(problem.seen) == 10
    assert solution.facts["iterations"] == 10
