"""Problems: metering, budgets, and results that do not depend on the number of worlds."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from tests.conformance.cells import cell
from zoobench.cell.episode import Evaluation
from zoobench.cell.problem import Problem
from zoobench.cell.robot import Robot
from zoobench.errors import BudgetExhaustedError, UsageError
from zoobench.spec import Budget
from zoobench.testing import DOUBLE


def _draws(problem: Problem, count: int) -> list[np.ndarray]:
    rng = np.random.default_rng(0)
    return [problem.initial(rng) for _ in range(count)]


def test_every_substep_is_counted() -> None:
    """A forward episode costs at most the declared substeps, and a gradient twice its forward substeps."""
    problem = Problem(cell())
    meter = problem.meter
    problem.evaluate_batch(_draws(problem, 2))
    forward = meter.forward
    assert 0 < forward <= 2 * problem.substeps_per_episode
    assert meter.backward == 0
    problem.loss_and_grad_batch(_draws(problem, 2))
    assert (meter.forward, meter.backward) == (2 * forward, forward)
    assert meter.substeps == 3 * forward
    assert meter.episodes == 4
    assert meter.seconds > 0.0


def test_controllers_are_computed_on_one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    """Before the simulator has started, too: the first gradient of a process had other last bits than the second."""
    problem, threads, seen = Problem(cell()), torch.get_num_threads(), list[int]()

    def draft(*_: object) -> None:
        seen.append(torch.get_num_threads())
        raise UsageError("seen")

    monkeypatch.setattr(Robot, "draft", draft)
    torch.set_num_threads(2)
    try:
        with pytest.raises(UsageError, match="seen"):
            problem.loss_and_grad(_draws(problem, 1)[0])
    finally:
        torch.set_num_threads(threads)
    assert seen == [1]


@pytest.mark.parametrize("gradient", [False, True])
def test_what_the_budget_does_not_hold_is_not_started(gradient: bool) -> None:
    """The declared cost must fit before anything is known; what is refused costs nothing."""
    free = Problem(cell())
    cost = free.substeps_per_episode * (2 if gradient else 1)
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
    """Declared before the first; then 1.25 times the costliest, up to the declared cost or the costliest."""
    problem = Problem(cell())
    declared = problem.substeps_per_episode
    assert problem.expected_substeps == declared
    for costliest, expected in ((declared // 2, math.ceil(1.25 * (declared // 2))), (declared - 1, declared)):
        problem.meter.costliest = costliest
        assert problem.expected_substeps == expected
    problem.meter.costliest = declared + 7
    assert problem.expected_substeps == declared + 7


def test_the_costliest_episode_is_that_of_one_world() -> None:
    """For any number of worlds, without the cost of gradients."""
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


def test_the_cost_of_a_diverged_episode_is_not_used(monkeypatch: pytest.MonkeyPatch) -> None:
    """A diverged episode is short."""
    monkeypatch.setattr("zoobench.sim.model.diagnostics.LARGEST_COURANT", 0.0005)
    problem = Problem(cell(frames=20))
    evaluation = problem.evaluate(40.0 * _draws(problem, 1)[0])
    assert evaluation.failure is not None
    assert problem.meter.forward > 0
    assert problem.expected_substeps == problem.substeps_per_episode


def test_it_is_known_whether_the_budget_ended() -> None:
    """After a refused request, and when nothing is left of a counted budget."""
    problem = Problem(cell(budget=Budget("episodes", 2)))
    assert problem.affords(2)
    assert not problem.meter.has_ended(problem.spec.budget)
    assert not problem.affords(3)
    assert problem.meter.has_ended(problem.spec.budget)
    whole = Problem(cell(budget=Budget("iterations", 3)))
    whole.meter.iterations = 3
    assert whole.meter.has_ended(whole.spec.budget)


def test_a_checkpoint_of_an_earlier_version_restores() -> None:
    """It has no costliest episode, which is then 0."""
    meter = Problem(cell()).meter
    state = {**meter.state(), "forward": 7}
    del state["costliest"]
    meter.restore(state)
    assert (meter.forward, meter.costliest) == (7, 0)


def test_episodes_are_a_budget_too() -> None:
    """An evaluation is an episode, with or without gradient."""
    problem = Problem(cell(budget=Budget("episodes", 2)))
    problem.loss_and_grad(_draws(problem, 1)[0])
    assert problem.affords(1)
    assert not problem.affords(2)
    problem.evaluate(_draws(problem, 1)[0])
    assert not problem.affords(1)


def test_wall_time_is_a_budget_whose_promises_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """A promised evaluation is simulated although time has run out; the next one is refused."""
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


@pytest.mark.parametrize("env", ["ground", pytest.param("desert", marks=pytest.mark.slow)])
def test_results_do_not_depend_on_how_many_run_side_by_side(env: str) -> None:
    """Score and gradient are equal bit for bit in one world and in three, whether all have an episode or only one."""
    # in the precision whose kernels other tests compile, too
    problems = [Problem(cell(environment=env, fidelity=DOUBLE), worlds=worlds) for worlds in (1, 3)]
    one, three = (problem.loss_and_grad_batch(_draws(problem, 4)) for problem in problems)
    for (evaluation, gradient), (expected, expected_gradient) in zip(three, one, strict=True):
        assert evaluation.score == expected.score
        np.testing.assert_array_equal(gradient, expected_gradient)


def test_evaluating_and_differentiating_agree() -> None:
    """The score is the same with and without gradient."""
    problem = Problem(cell())
    params = _draws(problem, 1)[0]
    assert problem.evaluate(params).score == problem.loss_and_grad(params)[0].score


def test_muscles_move_the_robot() -> None:
    """Without activity the robot hardly moves and spends no energy; with it the score responds."""
    problem = Problem(cell(frames=20))
    still = problem.evaluate(np.zeros(problem.parameter_count))
    moved = problem.evaluate(3.0 * _draws(problem, 1)[0])
    assert still.metrics["mean_speed"].value < 0.01
    assert moved.metrics["mean_speed"].value > 3.0 * still.metrics["mean_speed"].value
    assert still.metrics["actuation_energy"].value == 0.0 < moved.metrics["actuation_energy"].value


def test_parameters_that_cannot_be_used_are_refused() -> None:
    """Another length or a NaN is refused before anything is simulated."""
    problem = Problem(cell())
    with pytest.raises(UsageError, match="was expected"):
        problem.evaluate(np.zeros(3))
    with pytest.raises(UsageError, match="not finite"):
        problem.evaluate(np.full(problem.parameter_count, math.nan))
    assert problem.meter.substeps == 0


def test_what_is_watched_is_what_is_simulated() -> None:
    """The robot's particles come first, at the positions of the motion; watching changes no number."""
    problem = Problem(cell(environment="desert", fidelity=DOUBLE))
    (draw,) = _draws(problem, 1)
    seen: list[np.ndarray] = []

    def watch(places: np.ndarray, flow: np.ndarray | None) -> None:
        seen.append(places)
        assert flow is None, "there is no water on a grid"

    for _ in range(2):  # an episode that follows another begins at its own start
        seen.clear()
        episode = problem.episode(draw, watch=watch)
    count = problem.scene.robot.particle_count
    assert [len(places) for places in seen] == [problem.scene.particle_count] * (problem.spec.frames + 1)
    np.testing.assert_allclose([places[:count] for places in seen], episode.record.motion.positions[:, 0], atol=1e-6)
    assert np.abs(seen[-1][count:] - seen[0][count:]).max() > 0.0
    assert episode.evaluation.score == problem.evaluate(draw).score
    assert episode.record.actuation.shape == (problem.spec.frames, problem.body.muscle_count)
    assert episode.record.body is problem.body


def test_a_divergence_is_an_evaluation_without_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    """A diverged world has a NaN gradient; the world beside it is unaffected."""
    monkeypatch.setattr("zoobench.sim.model.diagnostics.LARGEST_COURANT", 0.0005)
    problem = Problem(cell(frames=20))
    wild, calm = 40.0 * _draws(problem, 1)[0], np.zeros(problem.parameter_count)
    (bad, bad_gradient), (good, good_gradient) = problem.loss_and_grad_batch([wild, calm])
    alone, alone_gradient = Problem(cell(frames=20)).loss_and_grad(calm)
    assert bad.failure is not None
    assert bad.score == -math.inf
    assert not bad.metrics
    assert np.isnan(bad_gradient).all()
    assert good.score == alone.score
    np.testing.assert_array_equal(good_gradient, alone_gradient)
    assert problem.meter.retries > 0


def test_an_evaluation_survives_its_checkpoint() -> None:
    """State and back, bit for bit."""
    problem = Problem(cell())
    evaluation = problem.evaluate(_draws(problem, 1)[0])
    back = Evaluation.from_state(evaluation.state())
    assert back.score == evaluation.score
    assert back.metrics == evaluation.metrics
    np.testing.assert_array_equal(back.reward, evaluation.reward)


def test_the_meter_goes_on_where_it_stopped() -> None:
    """Counts and earlier seconds are restored, and the clock adds to them."""
    problem = Problem(cell())
    problem.evaluate(_draws(problem, 1)[0])
    state = problem.meter.state()
    resumed = Problem(cell())
    resumed.meter.restore(state)
    assert resumed.meter.substeps == problem.meter.substeps
    assert resumed.meter.seconds == state["earlier_seconds"] > 0.0


def test_a_robot_that_is_torn_apart_has_no_score() -> None:
    """A torn robot counts as diverged, with the reason, so that it cannot win by throwing off a piece."""
    problem = Problem(cell(environment="ground[muscle_strength=4e3,damping=1e-6]", frames=60))
    evaluation, gradient = problem.loss_and_grad(20.0 * _draws(problem, 1)[0])
    assert evaluation.failure is not None
    assert evaluation.failure.quantity == "distance of neighbours by that at rest"
    assert evaluation.score == -math.inf
    assert np.isnan(gradient).all()


def test_an_episode_tells_how_near_it_came_to_a_wall() -> None:
    """The least gap over its frames, as a metric, from the sides of an arena that follows it."""
    problem = Problem(cell())
    episode = problem.episode(_draws(problem, 1)[0])
    gap = episode.evaluation.metrics["wall_gap"]
    places = episode.record.motion.positions[:, 0].numpy()
    sides = [places[..., axis].min() for axis in (0, 2)] + [0.5 - places[..., axis].max() for axis in (0, 2)]
    assert gap.value == pytest.approx(min(sides) / problem.fidelity.grid_spacing)
    assert gap.value == episode.record.wall_gaps.min() > 5.0
    assert gap.unit == "cells"


@pytest.mark.parametrize(("least", "word"), [(1000.0, "met a side of its arena"), (3.0, "is torn")])
def test_what_fails_at_a_wall_is_not_called_torn(monkeypatch: pytest.MonkeyPatch, least: float, word: str) -> None:
    """The reason says that the robot met it, and how to keep away."""
    monkeypatch.setattr("zoobench.cell.wall_gap.LEAST_WALL_GAP", least)
    problem = Problem(cell(environment="ground[muscle_strength=4e3,damping=1e-6]", frames=60))
    failure = problem.evaluate(20.0 * _draws(problem, 1)[0]).failure
    assert word in str(failure)
    assert ("torn" in str(failure)) == (word == "is torn")
