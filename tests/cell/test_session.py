"""Sessions: the same numbers as in a whole episode, metering, and budgets."""

import numpy as np
import pytest
import torch

from tests.conformance.cells import cell
from zoobench import registry
from zoobench.cell.problem import Problem
from zoobench.cell.session import Session, Step, new_session
from zoobench.errors import BudgetExhaustedError, UsageError
from zoobench.registry import Kind
from zoobench.spec import Budget
from zoobench.testing import DOUBLE

FRAMES = 6


def _act(problem: Problem, params: np.ndarray, session: Session, observations: np.ndarray) -> np.ndarray:
    """The activity by the problem's closed loop with these parameters in every world."""
    controller, weights = problem.robot.controller, torch.as_tensor(params)
    felt = zip(session.times.tolist(), torch.as_tensor(observations), strict=True)
    return np.stack([controller.response(weights, time, seen, session.muscle_count).numpy() for time, seen in felt])


TASKS = [registry.get(Kind.TASK, name) for name in registry.names(Kind.TASK)]
ALONE = [task.name for task in TASKS if not (task.needs_settings or task.needs_object)]
POWER = "mix[movement-speed=1,power=-0.1]"


@pytest.mark.parametrize("task", [*ALONE, POWER, "push-to"])  # which sees what every task with an object does, and more
def test_an_episode_is_the_same_as_in_one_piece(task: str) -> None:
    """Rewards, cost and end, of a complete episode and of one that is begun again after two frames."""
    problem = Problem(cell(task=task, controller="sine-feedback", frames=FRAMES, fidelity=DOUBLE))
    params = problem.initial(np.random.default_rng(1))
    expected = problem.evaluate(params).reward
    cost = problem.meter.forward
    session = new_session(problem, 2)
    observations = session.begin()
    steps: list[Step] = []
    for frame in range(FRAMES):
        if frame == 2:
            observations = session.begin([1])
        steps.append(session.step(_act(problem, params, session, observations)))
        observations = steps[-1].observations
    rewards = np.array([step.rewards for step in steps])
    np.testing.assert_allclose(rewards[:, 0], expected, rtol=1e-12)
    np.testing.assert_allclose(rewards[2:, 1], expected[:-2], rtol=1e-12)
    assert [step.truncated.tolist() for step in steps[-2:]] == [[False, False], [True, False]]
    assert not any(step.terminated.any() for step in steps)
    assert problem.meter.episodes == 1 + 3
    assert 2 * cost < problem.meter.forward <= 3 * cost


def test_muscles_of_a_session_come_in_as_in_one_piece() -> None:
    """In water by forces on the surface, where they come to full activity after some frames; a session has the same."""
    problem = Problem(cell(environment="ocean", controller="sine-feedback", frames=FRAMES, fidelity=DOUBLE))
    params = problem.initial(np.random.default_rng(1))
    expected = problem.episode(params).record.actuation
    session = new_session(problem, 1)
    observations, found = session.begin(), []
    for _ in range(FRAMES):
        observations = session.step(_act(problem, params, session, observations)).observations
        found.append(session.activity(0))
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    assert 0.0 == np.abs(expected[0]).max() < np.abs(expected[1]).max() < 0.1


def test_an_episode_that_is_over_must_be_begun() -> None:
    """Before the first step, and after the last."""
    session = new_session(Problem(cell(frames=1)), 1)
    still = np.zeros((1, session.muscle_count))
    with pytest.raises(UsageError, match="world 0 is over"):
        session.step(still)
    session.begin()
    session.step(still)
    with pytest.raises(UsageError, match="world 0 is over"):
        session.step(still)


@pytest.mark.parametrize("kind", ["substeps", "episodes"])
def test_the_budget_holds_to_the_frame(kind: str) -> None:
    """What is affordable can be simulated; what is refused costs nothing."""
    free = Problem(cell(frames=2))
    amount = {"substeps": 2 * 5 * free.substeps_per_episode // 2, "episodes": 6}[kind]
    problem = Problem(cell(budget=Budget(kind, amount), frames=2))
    session = new_session(problem, 2)
    session.begin()
    assert session.affords(5)
    assert session.affords(6) is (kind == "episodes")
    assert not session.affords(5 if kind == "substeps" else 6, evaluations=1)
    still = np.zeros((2, session.muscle_count))
    done = 0
    while session.affords(1):
        if session.step(still).truncated.any():
            session.begin()
        done += 1
    spent = problem.meter.spent(kind)
    assert done == 6 if kind == "episodes" else done >= 5
    assert spent <= amount
    with pytest.raises(BudgetExhaustedError, match="budget"):
        session.step(still)
    assert problem.meter.spent(kind) == spent


@pytest.mark.parametrize("task", ["movement-speed", "waypoint-following"])
def test_a_world_that_blows_up_ends_its_episode(monkeypatch: pytest.MonkeyPatch, task: str) -> None:
    """It terminates and says why; the world beside it goes on, and it can be begun again.

    It is no gain: where rewards are negative, it has the last one for all frames that it has not done.
    """
    monkeypatch.setattr("zoobench.sim.model.diagnostics.LARGEST_COURANT", 0.002)
    problem = Problem(cell(task=task, frames=40))
    session = new_session(problem, 2)
    session.begin()
    wild = np.zeros((2, session.muscle_count))
    before = 0.0
    for frame in range(20):
        wild[1] = (-1.0) ** (frame // 3)
        step = session.step(wild)
        if step.terminated.any():
            break
        before = step.rewards[1]
    assert step.terminated.tolist() == [False, True]
    assert not step.truncated.any()
    assert step.rewards[1] == pytest.approx((40 - frame) * min(0.0, before))
    assert step.rewards[1] < 0.0 or task == "movement-speed"
    assert step.failures[1].frame == frame
    assert session.failures == 1
    assert np.isfinite(step.observations).all()
    assert problem.meter.retries > 0
    session.begin([1])
    assert not session.step(0.0 * wild).terminated.any()


def test_a_lead_in_moves_no_other_world() -> None:
    """The world beside it goes on as if alone, and is scored so; what is led in begins elsewhere and is metered."""
    problem = Problem(cell(task="waypoint-following", frames=4))
    session = new_session(problem, 2, keeps_history=True)
    rng = np.random.default_rng(0)
    activity = rng.uniform(-1.0, 1.0, (4, 2, session.muscle_count))
    lead_in = rng.uniform(-1.0, 1.0, (3, session.muscle_count))
    told = []
    for disturbed in (False, True):
        first = session.begin()
        steps = [session.step(row) for row in activity[:2]]
        if disturbed:
            spent = problem.meter.forward
            led = session.begin([1], lead_ins={1: lead_in})
            assert problem.meter.forward > spent
            assert (led[1] != first[1]).any()
            np.testing.assert_array_equal(led[0], steps[-1].observations[0])
        steps += [session.step(row) for row in activity[2:]]
        told.append(([step.observations[0] for step in steps], steps[-1].evaluations[0].metrics))
    np.testing.assert_array_equal(told[0][0], told[1][0])
    assert told[0][1] == told[1][1]


@pytest.mark.slow
def test_an_episode_is_as_near_to_a_wall_as_the_problem_says() -> None:
    """The reading of an episode that reached its length is that of a whole one, where the tank has walls."""
    problem = Problem(cell(environment="shallow-water[length=0.25,width=0.15]", frames=3))
    actuation = np.random.default_rng(1).uniform(-1.0, 1.0, problem.parameter_count)
    episode = problem.episode(actuation)
    session = new_session(problem, 1, keeps_history=True)
    session.begin()
    for row in episode.record.actuation:
        step = session.step(row[None])
    assert step.evaluations[0].metrics["wall_gap"] == episode.evaluation.metrics["wall_gap"]
    assert step.evaluations[0].metrics["wall_gap"].value < 3.0


def test_a_world_that_begins_elsewhere_observes_from_there() -> None:
    """After a lead-in the displacement is nothing, as in the world beside it that begins at rest."""
    session = new_session(Problem(cell(task="waypoint-following", frames=4)), 2)
    session.begin()
    session.step(np.ones((2, session.muscle_count)))
    assert session.step(np.ones((2, session.muscle_count))).observations[:, 3:6].any()
    lead_in = np.random.default_rng(0).uniform(-1.0, 1.0, (3, session.muscle_count))
    seen = session.begin(lead_ins={1: lead_in})
    np.testing.assert_array_equal(seen[:, 3:6], 0.0)
    assert seen[1, :3].any()


def test_a_design_space_is_refused() -> None:
    """A policy needs a fixed body."""
    with pytest.raises(UsageError, match="is a design space"):
        new_session(Problem(cell(design="particle")), 1)


def test_observations_are_those_of_task_and_controller() -> None:
    """The time left falls from 1 to 0 and begins again; a controller that sees its body is given its body."""
    session = new_session(Problem(cell(task="turning", frames=2)), 1)
    still = np.zeros((1, session.muscle_count))
    left = [session.begin()[0, -1]] + [session.step(still).observations[0, -1] for _ in range(2)]
    assert [*left, session.begin()[0, -1]] == [1.0, 0.5, 0.0, 1.0]
    body = 8 + 6 * session.muscle_count
    for sees, added in (("all", 5), ("body", 0)):
        problem = Problem(cell(task="waypoint-following", controller=f"policy-network[sees={sees}]"))
        session = new_session(problem, 1)
        assert session.observation_count == session.begin().shape[1] == body + added
