"""Closed loops: observations change the motion."""

from types import SimpleNamespace

import numpy as np
import pytest
import torch

from tests.conformance.cells import SEA, cell
from zoobench.cell.closed_loop import FeedbackLoops
from zoobench.cell.observation import ObservationModel
from zoobench.cell.problem import Problem
from zoobench.cell.robot import Robot
from zoobench.sim.model.fidelity import Fidelity
from zoobench.spec import Ref
from zoobench.tasks.waypoint_following import WaypointFollowing

TARGET = "waypoint-following[speed=0.3]"


def test_feedback_changes_what_the_robot_does() -> None:
    """The same basis gives different episodes with the network and without it."""
    problem = Problem(cell(controller="sine-feedback", frames=10))
    params = problem.initial(np.random.default_rng(0))
    blind = params.copy()
    basis = Problem(cell(frames=10)).parameter_count
    blind[basis:] = 0.0
    assert problem.evaluate(params).score != problem.evaluate(blind).score
    assert problem.evaluate(blind).score == Problem(cell(frames=10)).evaluate(blind[:basis]).score


@pytest.mark.parametrize("controller", ["sine-feedback", "policy-network[hidden=8]"])
def test_another_target_changes_what_the_robot_does(controller: str) -> None:
    """The same parameters drive it elsewhere if the target moves elsewhere, and not if they see the body only."""
    name, bracket, rest = controller.partition("[")
    for sees in ("all", "body"):
        ref = f"{name}[sees={sees}{',' if bracket else ']'}{rest}"
        problems = [
            Problem(cell(task=f"waypoint-following[path={path},speed=0.3]", controller=ref, frames=60))
            for path in ("straight", "s-curve")
        ]
        params = problems[0].initial(np.random.default_rng(1))
        runs = [problem.episode(params).record.motion for problem in problems]
        assert all(run is not None for run in runs)
        assert torch.equal(runs[0].positions, runs[1].positions) == (sees == "body")  # type: ignore[union-attr]


def test_a_controller_that_sees_its_body_has_the_inputs_of_its_body() -> None:
    """Eight numbers of the whole and six of each muscle, whatever the task."""
    counts = {
        task: Problem(cell(task=task, controller="sine-feedback[sees=body]")).parameter_count
        for task in ("turning", "waypoint-following")
    }
    muscles = Problem(cell()).body.muscle_count
    assert set(counts.values()) == {9 * muscles * (1 + 8) + 8 * (8 + 6 * muscles) + 8}


def test_the_adjoint_goes_through_what_is_seen_of_the_target(monkeypatch: pytest.MonkeyPatch) -> None:
    """In double precision it is that of differences, and it is not without the target's terms."""
    problem = Problem(cell(task=TARGET, controller="sine-feedback", fidelity="smoke[precision=64]", frames=6))
    params = problem.initial(np.random.default_rng(1))
    basis = 9 * problem.body.muscle_count
    params[basis:] *= 20.0  # strong feedback
    direction = np.random.default_rng(2).normal(size=len(params))
    _, gradient = problem.loss_and_grad(params)
    ahead, behind = (problem.evaluate(params + sign * 1e-5 * direction).score for sign in (1.0, -1.0))
    assert -gradient @ direction == pytest.approx((ahead - behind) / 2e-5, rel=1e-6)

    observed = WaypointFollowing.observed
    monkeypatch.setattr(
        WaypointFollowing,
        "observed",
        lambda task, situation: {name: part.detach() for name, part in observed(task, situation).items()},
    )
    _, without = problem.loss_and_grad(params)
    assert -without @ direction != pytest.approx((ahead - behind) / 2e-5, rel=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("env", [pytest.param("ground", id="land"), pytest.param(SEA, id="water")])
def test_the_adjoint_of_the_muscles_power_goes_through_the_loop(env: str) -> None:
    """In double precision it is that of differences: the power in a frame is a function of what was seen before it."""
    spec = cell(
        environment=env, design="fish", task="mix[power=-1]", controller="policy-network[hidden=8]",
        fidelity="smoke[precision=64]", frames=8,
    )  # fmt: skip
    problem = Problem(spec)
    params = 3.0 * problem.initial(np.random.default_rng(1))
    direction = np.random.default_rng(2).normal(size=len(params))
    evaluation, gradient = problem.loss_and_grad(params)
    assert evaluation.score < -1e-3
    ahead, behind = (problem.evaluate(params + sign * 1e-6 * direction).score for sign in (1.0, -1.0))
    assert -gradient @ direction == pytest.approx((ahead - behind) / 2e-6, rel=1e-5)


@pytest.mark.parametrize("part", ["stiffness", "muscles"])
def test_the_gradient_of_what_is_done_goes_through_where_muscles_are(part: str) -> None:
    """A muscle's place is the mean over what it has of the body, which stiffness and shares of muscles change."""
    problem = Problem(cell(environment=SEA, design=f"voxel[optimise={part}]", controller="sine-feedback"))
    robot, rng = problem.robot, np.random.default_rng(3)
    params = rng.normal(-1.0, 0.5, robot.parameter_count)
    direction = torch.as_tensor(rng.normal(size=len(params)))
    direction[: robot.control_count] = 0.0
    places = torch.as_tensor(problem.body.positions)
    moving = torch.as_tensor(rng.normal(size=places.shape))

    def activity(row: torch.Tensor) -> torch.Tensor:
        built = robot.draft(row[None], torch.zeros(1, dtype=torch.float64)).relaxed()
        loops = FeedbackLoops.of(robot, [built], problem.task, 10)
        assert loops is not None
        return loops._respond(1, 0, places, moving, places).sum()

    row = torch.tensor(params, requires_grad=True)
    (gradient,) = torch.autograd.grad(activity(row), row)
    ahead, behind = (float(activity((row + sign * 1e-5 * direction).detach())) for sign in (1.0, -1.0))
    assert float(gradient @ direction) == pytest.approx((ahead - behind) / 2e-5, rel=1e-6)
    assert ahead != behind


@pytest.mark.slow  # through what is seen of the target it goes above
def test_the_adjoint_goes_through_what_is_seen_of_an_object() -> None:
    """In double precision it is that of differences, where a robot pushes a box that it sees."""
    spec = cell(
        environment="ground[object=box,object_gap=0]", task="push-to", controller="sine-feedback",
        fidelity="smoke[precision=64]", frames=6,
    )  # fmt: skip
    problem = Problem(spec)
    params = problem.initial(np.random.default_rng(1))
    params[9 * problem.body.muscle_count :] *= 20.0  # strong feedback
    direction = np.random.default_rng(2).normal(size=len(params))
    _, gradient = problem.loss_and_grad(params)
    ahead, behind = (problem.evaluate(params + sign * 1e-6 * direction).score for sign in (1.0, -1.0))
    assert -gradient @ direction == pytest.approx((ahead - behind) / 2e-6, rel=1e-5)
    assert gradient.any()


def test_the_time_left_falls_from_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Frame by frame over the episode, to the share of the last frame."""
    seen: list[float] = []
    observe = ObservationModel.observe

    def record(model: ObservationModel, *given: object) -> torch.Tensor:
        found = observe(model, *given)  # type: ignore[arg-type]
        seen.append(float(found[-1]))
        return found

    monkeypatch.setattr(ObservationModel, "observe", record)
    problem = Problem(cell(task="turning", controller="sine-feedback", frames=4))
    problem.evaluate(problem.initial(np.random.default_rng(0)))
    assert seen == [1.0, 0.75, 0.5, 0.25]


def test_the_adjoint_counts_the_start_in_every_frame() -> None:
    """Where the start of the episode moves, so do displacement and target of all frames."""
    robot = Robot.of(Ref("caterpillar"), Ref("sine-feedback"), Fidelity(1 / 32), Ref("waypoint-following"))
    rng, frames = np.random.default_rng(0), 3
    built = robot.draft(torch.tensor(robot.initial(rng)[None], requires_grad=True), torch.zeros(0)).solid()
    loops = FeedbackLoops.of(robot, [built], WaypointFollowing(), frames)
    assert loops is not None
    shape = (frames + 1, 1, robot.body.particle_count, 3)
    places, speeds = robot.body.positions + 0.003 * rng.normal(size=shape), 0.1 * rng.normal(size=shape)
    weights, way = rng.normal(size=(frames, 1, robot.body.muscle_count)), rng.normal(size=shape[1:])

    def value(step: float) -> float:
        moved = places.copy()
        moved[0] += step * way
        return float(sum((weights[frame] * loops.act(frame, moved[frame], speeds[frame])).sum() for frame in range(3)))

    adjoint = loops.adjoint(SimpleNamespace(positions=places, velocities=speeds))  # type: ignore[arg-type]
    found = [adjoint(frame, weights[frame])[0] for frame in reversed(range(frames))]
    assert (found[-1] * way).sum() == pytest.approx((value(1e-5) - value(-1e-5)) / 2e-5, rel=1e-6)
