"""The door to physics: counting, refusing, and the same numbers however many worlds run side by side."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.conformance.cells import cell
from zoobench.cell.episode import Evaluation
from zoobench.cell.problem import Problem
from zoobench.envs.base import LAND_ROBOT
from zoobench.errors import BudgetExhaustedError, UsageError
from zoobench.spec import Budget


def _draws(problem: Problem, count: int) -> list[np.ndarray]:
    rng = np.random.default_rng(0)
    return [problem.initial(rng) for _ in range(count)]


def test_every_substep_is_counted() -> None:
    """Forward alone costs an episode, at most the declared one; with a gradient it costs three times that."""
    problem = Problem(cell())
    meter = problem.meter
    problem.evaluate_batch(_draws(problem, 2))
    forward = meter.forward
    assert 0 < forward <= 2 * problem.substeps_per_episode
    assert (meter.recomputed, meter.backward) == (0, 0)
    problem.loss_and_grad_batch(_draws(problem, 2))
    assert (meter.forward, meter.recomputed, meter.backward) == (2 * forward, forward, forward)
    assert meter.episodes == 4
    assert meter.seconds > 0.0


@pytest.mark.parametrize("gradient", [False, True])
def test_what_the_budget_does_not_hold_is_not_started(gradient: bool) -> None:
    """What the declared step would cost must fit, before anything was learnt; what is refused costs nothing."""
    free = Problem(cell())
    cost = free.substeps_per_episode * (3 if gradient else 1)
    problem = Problem(cell(budget=Budget("substeps", 2 * cost)))
    work = problem.loss_and_grad_batch if gradient else problem.evaluate_batch
    assert problem.affords(2, gradient=gradient)
    assert not problem.affords(3, gradient=gradient)
    work(_draws(problem, 2))
    spent = problem.meter.substeps
    assert 0 < spent <= 2 * cost
    with pytest.raises(BudgetExhaustedError, match="substeps"):
        work(_draws(problem, 2))
    assert problem.meter.substeps == spent


def test_what_episodes_cost_is_learnt_from_them() -> None:
    """Declared before the first; then a quarter more than the costliest, but no more than declared unless it was."""
    problem = Problem(cell())
    declared = problem.substeps_per_episode
    assert problem.expected_substeps == declared
    for costliest, expected in ((declared // 2, math.ceil(1.25 * (declared // 2))), (declared - 1, declared)):
        problem.meter.costliest = costliest
        assert problem.expected_substeps == expected
    problem.meter.costliest = declared + 7
    assert problem.expected_substeps == declared + 7


def test_the_costliest_episode_is_that_of_one_world() -> None:
    """However many run side by side, and whatever a gradient adds."""
    problem = Problem(cell(), worlds=4)
    draws = _draws(problem, 4)
    costs = []
    for draw in draws:
        before = problem.meter.forward
        problem.evaluate(draw)
        costs.append(problem.meter.forward - before)
    assert problem.meter.costliest == max(costs)
    beside = Problem(cell(), worlds=4)
    beside.loss_and_grad_batch(draws)
    assert beside.meter.costliest == max(costs)


def test_nothing_is_learnt_from_an_episode_that_blew_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """It was cheap because it was short."""
    monkeypatch.setattr("zoobench.sim.model.diagnostics.LARGEST_COURANT", 0.002)
    problem = Problem(cell(frames=20))
    evaluation = problem.evaluate(40.0 * _draws(problem, 1)[0])
    assert evaluation.failure is not None
    assert problem.meter.forward > 0
    assert problem.expected_substeps == problem.substeps_per_episode


def test_it_is_known_whether_the_budget_ended() -> None:
    """Once something that was asked for did not fit, and when nothing is left of what is counted."""
    problem = Problem(cell(budget=Budget("episodes", 2)))
    assert problem.affords(2)
    assert not problem.meter.has_ended(problem.spec.budget)
    assert not problem.affords(3)
    assert problem.meter.has_ended(problem.spec.budget)
    whole = Problem(cell(budget=Budget("iterations", 3)))
    whole.meter.iterations = 3
    assert whole.meter.has_ended(whole.spec.budget)


def test_a_checkpoint_of_an_earlier_version_restores() -> None:
    """It knows nothing of what the costliest episode took, which is then learnt anew."""
    meter = Problem(cell()).meter
    state = {**meter.state(), "forward": 7}
    del state["costliest"]
    meter.restore(state)
    assert (meter.forward, meter.costliest) == (7, 0)


def test_episodes_are_a_budget_too() -> None:
    """An evaluation is an episode, with a gradient or without."""
    problem = Problem(cell(budget=Budget("episodes", 2)))
    problem.loss_and_grad(_draws(problem, 1)[0])
    assert problem.affords(1)
    assert not problem.affords(2)
    problem.evaluate(_draws(problem, 1)[0])
    assert not problem.affords(1)


def test_wall_time_is_a_budget_whose_promises_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """What the clock allowed is done although time runs out before it begins; what comes after it is refused."""
    now = [0.0]
    monkeypatch.setattr("zoobench.cell.meter.time", SimpleNamespace(perf_counter=lambda: now[0]))
    problem = Problem(cell(budget=Budget("seconds", 1.0)))
    (draw,) = _draws(problem, 1)
    for now[0] in (0.0, 0.5):
        problem.evaluate(draw)
    assert problem.affords(3)
    now[0] = 1.5
    problem.evaluate(draw)
    assert not problem.affords(1)
    with pytest.raises(BudgetExhaustedError, match="seconds"):
        problem.evaluate(draw)
    assert problem.meter.episodes == 3


def test_results_do_not_depend_on_how_many_run_side_by_side() -> None:
    """Score and gradient of each are the same bits in one world, in threes, and all at once."""
    results = []
    for worlds in (1, 3, 8):
        problem = Problem(cell(environment="desert"), worlds=worlds)
        results.append(problem.loss_and_grad_batch(_draws(problem, 4)))
    for other in results[1:]:
        for (evaluation, slope), (expected, expected_slope) in zip(other, results[0], strict=True):
            assert evaluation.score == expected.score
            np.testing.assert_array_equal(slope, expected_slope)


def test_evaluating_and_differentiating_agree() -> None:
    """The score does not depend on whether a gradient was asked for."""
    problem = Problem(cell())
    params = _draws(problem, 1)[0]
    assert problem.evaluate(params).score == problem.loss_and_grad(params)[0].score


def test_muscles_move_the_robot() -> None:
    """Without activity nothing moves but the settling body, at no cost; with it the score responds."""
    problem = Problem(cell(frames=20))
    still = problem.evaluate(np.zeros(problem.parameter_count))
    moved = problem.evaluate(3.0 * _draws(problem, 1)[0])
    assert still.metrics["mean_speed"].value < 0.01
    assert moved.metrics["mean_speed"].value > 3.0 * still.metrics["mean_speed"].value
    assert still.metrics["actuation_energy"].value == 0.0 < moved.metrics["actuation_energy"].value


def test_parameters_that_cannot_be_used_are_refused() -> None:
    """Another length, or a NaN, is named before anything is simulated."""
    problem = Problem(cell())
    with pytest.raises(UsageError, match="was expected"):
        problem.evaluate(np.zeros(3))
    with pytest.raises(UsageError, match="not finite"):
        problem.evaluate(np.full(problem.parameter_count, math.nan))
    assert problem.meter.substeps == 0


def test_what_is_watched_is_what_is_simulated() -> None:
    """The robot's particles pass by where the motion has them, the medium's after them; the numbers do not change."""
    problem = Problem(cell(environment="desert"))
    (draw,) = _draws(problem, 1)
    seen: list[np.ndarray] = []
    for _ in range(2):  # an episode that follows another begins at its own start
        seen.clear()
        episode = problem.observe(draw, watch=seen.append)
    count = problem.scene.robot.particle_count
    assert [len(places) for places in seen] == [problem.scene.particle_count] * (problem.spec.frames + 1)
    np.testing.assert_allclose([places[:count] for places in seen], episode.motion.positions[:, 0], atol=1e-6)
    assert np.abs(seen[-1][count:] - seen[0][count:]).max() > 0.0
    assert episode.evaluation.score == problem.evaluate(draw).score
    assert episode.actuation.shape == (problem.spec.frames, problem.body.muscle_count)
    np.testing.assert_array_equal(episode.body["muscle_membership"], problem.body.muscle_membership)


def test_a_divergence_is_an_evaluation_without_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    """A gait too fast for the step is recorded, with a NaN gradient; the world beside it is unharmed."""
    monkeypatch.setattr("zoobench.sim.model.diagnostics.LARGEST_COURANT", 0.002)
    problem = Problem(cell(frames=20))
    wild, calm = 40.0 * _draws(problem, 1)[0], np.zeros(problem.parameter_count)
    (bad, bad_slope), (good, good_slope) = problem.loss_and_grad_batch([wild, calm])
    alone, alone_slope = Problem(cell(frames=20)).loss_and_grad(calm)
    assert bad.failure is not None
    assert bad.score == -math.inf
    assert not bad.metrics
    assert np.isnan(bad_slope).all()
    assert good.score == alone.score
    np.testing.assert_array_equal(good_slope, alone_slope)
    assert problem.meter.retries > 0


def test_an_evaluation_survives_its_checkpoint() -> None:
    """State and back: the same numbers to the last bit."""
    problem = Problem(cell())
    evaluation = problem.evaluate(_draws(problem, 1)[0])
    back = Evaluation.from_state(evaluation.state())
    assert back.score == evaluation.score
    assert back.metrics == evaluation.metrics
    np.testing.assert_array_equal(back.reward, evaluation.reward)


def test_the_meter_goes_on_where_it_stopped() -> None:
    """Counts and earlier seconds are carried over; the clock adds to them."""
    problem = Problem(cell())
    problem.evaluate(_draws(problem, 1)[0])
    state = problem.meter.state()
    resumed = Problem(cell())
    resumed.meter.restore(state)
    assert resumed.meter.substeps == problem.meter.substeps
    assert resumed.meter.seconds == state["earlier_seconds"] > 0.0


def test_a_robot_that_is_torn_apart_has_no_score(monkeypatch: pytest.MonkeyPatch) -> None:
    """Throwing a piece of itself ahead must not be a way to win: the episode counts as diverged, and says why."""
    robot = replace(LAND_ROBOT, muscle_strength=4e3, viscosity=0.0)
    monkeypatch.setattr("zoobench.envs.base.LAND_ROBOT", robot)
    problem = Problem(cell(frames=60))
    evaluation, slope = problem.loss_and_grad(20.0 * _draws(problem, 1)[0])
    assert evaluation.failure is not None
    assert evaluation.failure.quantity == "distance of neighbours by that at rest"
    assert evaluation.score == -math.inf
    assert np.isnan(slope).all()
