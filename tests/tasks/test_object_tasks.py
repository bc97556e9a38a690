"""Tasks with an object, on motions of which their scores are known."""

import dataclasses
import math

import pytest
import torch

from tests.tasks.motions import carried, disc, motion, yaw
from zoobench import registry
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.spec import Ref
from zoobench.tasks.base import Motion, Task

TASKS = ["push", "push-to", "kick", "carry", "lift", "topple", "spin", "catch"]
STILL = [[0.0, 0.0, 0.0]] * 4
WAYS = [[0.0, 0.0, 0.0], [0.02, 0.01, 0.0], [0.05, -0.02, -0.01], [0.04, -0.03, -0.02]]
"""Of the object: ahead and to the left, up and then down [m]."""

AWAY = math.hypot(0.05, 0.01)
"""How far it goes to where it is in the last but one state [m]."""


def _task(text: str) -> Task:
    task: Task = registry.create(Kind.TASK, Ref.parse(text))
    return task


def _pitch(angle: float) -> torch.Tensor:
    """The matrix of a rotation about z."""
    c, s = math.cos(angle), math.sin(angle)
    return torch.tensor([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]], dtype=torch.float64)


@pytest.mark.parametrize(
    ("task", "rewards"),
    [
        ("push", [0.02, 0.05, 0.04]),
        ("push[heading=90]", [0.0, 0.01, 0.02]),
        ("push[heading=180]", [-0.02, -0.05, -0.04]),
        ("push-to[x=0.05,z=-0.01]", [AWAY - math.hypot(0.03, 0.01), AWAY, AWAY - math.hypot(0.01, 0.01)]),
        ("kick", [0.02, 0.05, 0.04]),
        ("lift", [0.01, -0.02, -0.03]),
        ("catch", [0.01, -0.02, -0.03]),
        ("carry", [0.02, 0.05 - 10 * (0.02 - 0.005), 0.04 - 10 * (0.03 - 0.005)]),
        ("carry[allowed_fall=0,drop_penalty=2]", [0.02, 0.05 - 0.04, 0.04 - 0.06]),
        ("topple", [0.0, 0.0, 0.0]),
    ],
)  # fmt: skip
def test_a_reward_follows_from_the_way_of_the_object(task: str, rewards: list[float]) -> None:
    """In the direction, whatever the object's turn about the vertical."""
    made = _task(task)
    for turns in (None, [yaw(0.7 * frame) for frame in range(4)]):
        found = made.reward(carried(WAYS, turns))[:, 0].tolist()
        assert found == pytest.approx(rewards, abs=1e-9)


def test_scores_follow_from_the_rewards() -> None:
    """The last one; of lift the mean, of catch in the last quarter; of carry the way less the largest fall."""
    made = carried(WAYS)
    for name in ("push", "push-to", "kick", "topple"):
        task = _task(name)
        assert task.score(made).item() == task.reward(made)[-1].item()
    assert _task("lift").score(made).item() == pytest.approx((0.01 - 0.02 - 0.03) / 3)
    assert _task("catch").score(made).item() == pytest.approx(-0.03)
    assert _task("carry").score(made).item() == pytest.approx(0.04 - 10.0 * (0.03 - 0.005))


@pytest.mark.parametrize("ahead", [0.03, -0.03])
def test_a_kick_counts_what_the_robot_does_not_go(ahead: float) -> None:
    """Neither what is pushed along counts, nor that a robot withdraws."""
    robot = torch.tensor([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [ahead, 0.0, 0.0], [0.0, 0.02, ahead]], dtype=torch.float64)
    rewards = _task("kick").reward(carried(WAYS, robot=robot))[:, 0]
    assert rewards.tolist() == pytest.approx([0.02, 0.05 - 0.03, 0.04 - 0.03], abs=2e-6)


@pytest.mark.parametrize("about", [_pitch, lambda angle: yaw(0.9) @ _pitch(angle)])
def test_a_toppled_object_has_turned_by_its_tilt(about: object) -> None:
    """Up to half a turn, in any direction; what only sways does not count at the end."""
    turns = [about(angle) for angle in (0.1, 0.6, math.pi - 0.2, 0.1)]  # type: ignore[operator]
    rewards = _task("topple").reward(carried(STILL, turns))[:, 0]
    assert rewards.tolist() == pytest.approx([0.5, math.pi - 0.3, 0.0], abs=1e-9)


@pytest.mark.parametrize("lean", [0.0, 0.6])
def test_turns_add_up(lean: float) -> None:
    """Beyond a whole one, and back; also of an object that leans while it turns about the vertical."""
    angles = (0.4, 2.4, 5.0, 7.5)
    turns = [yaw(angle) @ _pitch(lean) for angle in angles]
    rewards = _task("spin").reward(carried(STILL, turns))[:, 0].tolist()
    backwards = _task("spin").reward(carried(STILL, turns[::-1]))[:, 0].tolist()
    assert rewards == pytest.approx([2.0, 4.6, 7.1], abs=1e-9)
    assert backwards == pytest.approx([-2.5, -5.1, -7.1], abs=1e-9)


@pytest.mark.parametrize("task", TASKS)
def test_an_object_at_rest_scores_zero(task: str) -> None:
    """To the last bit but of a root, also where it begins turned."""
    for turns in (None, [yaw(0.4)] * 4):
        assert _task(task).score(carried(STILL, turns)).item() == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("task", TASKS)
def test_the_gradient_is_that_of_the_score(task: str) -> None:
    """Against finite differences in the positions of the object and of the robot."""
    made, ways = carried(WAYS, [_pitch(0.1 + 0.2 * frame) for frame in range(4)]), torch.tensor(WAYS).double()
    start = carried(WAYS, [_pitch(0.1 + 0.2 * frame) for frame in range(4)], robot=0.4 * ways)
    thing = made.object

    def objective(places: torch.Tensor, robot: torch.Tensor) -> torch.Tensor:
        moved = dataclasses.replace(thing, positions=places)
        score: torch.Tensor = _task(task).objective(
            dataclasses.replace(start, positions=robot, objects={"object": moved})
        )
        return score

    leaves = (thing.positions.clone().requires_grad_(), start.positions.clone().requires_grad_())
    assert torch.autograd.gradcheck(objective, leaves)


@pytest.mark.parametrize("task", TASKS)
def test_a_robot_at_rest_has_a_gradient(task: str) -> None:
    """Every root has a derivative where the object has not moved, so that a method can begin there."""
    made = carried(STILL)
    places = made.object.positions.clone().requires_grad_()
    moved = dataclasses.replace(made, objects={"object": dataclasses.replace(made.object, positions=places)})
    (gradient,) = torch.autograd.grad(_task(task).objective(moved).sum(), places)
    assert gradient.isfinite().all()


@pytest.mark.parametrize("task", TASKS)
def test_a_reward_does_not_depend_on_what_comes_after(task: str) -> None:
    """The rewards of a shorter episode are the first rewards of a longer one."""
    whole, part = (carried(WAYS[:states], [_pitch(0.2 * frame) for frame in range(states)]) for states in (4, 3))
    torch.testing.assert_close(_task(task).reward(part), _task(task).reward(whole)[:2], rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("task", TASKS)
def test_readings_tell_of_the_object(task: str) -> None:
    """How far it went, rose, tilted and turned, each with a unit, and those of the robot."""
    readings = _task(task).metrics(carried(WAYS, [_pitch(0.3 * frame) for frame in range(4)]))
    wanted = {
        "object_distance": (math.hypot(0.04, 0.02), "m"), "object_rise": (-0.03, "m"), "object_highest": (0.01, "m"),
        "object_lowest": (-0.03, "m"), "object_tilt": (0.9, "rad"), "object_turn": (0.0, "rad"),
    }  # fmt: skip
    for name, (value, unit) in wanted.items():
        assert readings[name][0].item() == pytest.approx(value), name
        assert readings[name][1] == unit
    assert readings["distance"][0].item() == 0.0


def test_a_second_object_does_not_count() -> None:
    """The first one is the task's, in the order of the scene."""
    made, other = carried(WAYS), carried(STILL).object
    both: Motion = dataclasses.replace(made, objects={**made.objects, "object-1": other})
    assert _task("push").score(both).item() == _task("push").score(made).item()


def test_a_penalty_is_none_that_rewards_a_fall() -> None:
    """Nor one that is no number, nor an allowance for a rise."""
    for name, value in (
        ("drop_penalty", "-1"),
        ("drop_penalty", "nan"),
        ("allowed_fall", "-0.001"),
        ("allowed_fall", "nan"),
    ):
        with pytest.raises(UsageError, match=name):
            _task(f"carry[{name}={value}]")


def test_without_an_object_there_is_none_to_read() -> None:
    """The plan refuses such a cell, see `cell.task_fault`; here it is a plain error."""
    points = disc(rings=1, spokes=3)
    with pytest.raises(StopIteration):
        motion(points, points[None]).object  # noqa: B018
