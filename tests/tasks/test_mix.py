"""Weighted sums of tasks."""

from dataclasses import replace

import pytest
import torch

from tests.tasks.motions import block, rigid
from zoobench import registry
from zoobench.registry import Kind
from zoobench.spec import Ref
from zoobench.tasks.base import Task
from zoobench.tasks.penalties import MusclePower, SidewaysSpeed

MOTION = replace(
    rigid(block(), spin=0.7, velocity=(0.06, 0.0, 0.01), frames=60),
    muscle_work=torch.linspace(-1e-4, 3e-4, 120, dtype=torch.float64).reshape(60, 1, 2),
)


def _task(text: str) -> Task:
    made: Task = registry.create(Kind.TASK, Ref.parse(text))
    return made


def test_a_mixture_is_the_weighted_sum_of_its_tasks() -> None:
    """Reward, score and objective, with the parameters of the tasks; the metrics hold the score of each."""
    whole = _task(
        "mix[movement-speed=1,heading=20,turning=-0.2,velocity-tracking=0.5,direction_weight=0.3,"
        "waypoint_following=2,path=random,path_seed=3,speed=0.1,final-position=4,x=0.03,z=-0.01,power=-3,sideways=-0.7]"
    )
    parts: dict[str, tuple[float, Task]] = {
        "movement_speed": (1.0, _task("movement-speed[heading=20]")),
        "turning": (-0.2, _task("turning")),
        "velocity_tracking": (
            0.5,
            _task("velocity-tracking[direction_weight=0.3,path=random,path_seed=3,speed=0.1]"),
        ),
        "waypoint_following": (2.0, _task("waypoint-following[path=random,path_seed=3,speed=0.1]")),
        "final_position": (4.0, _task("final-position[x=0.03,z=-0.01]")),
        "power": (-3.0, MusclePower()),
        "sideways": (-0.7, SidewaysSpeed(heading=20.0)),
    }
    for name in ("reward", "score", "objective"):
        wanted = sum(weight * getattr(task, name)(MOTION) for weight, task in parts.values())
        torch.testing.assert_close(getattr(whole, name)(MOTION), wanted, rtol=1e-14, atol=0.0)
    metrics = whole.metrics(MOTION)
    for name, (_, task) in parts.items():
        assert metrics[name][1] == task.unit
        assert torch.equal(metrics[name][0], task.score(MOTION))


def test_a_task_without_weight_is_not_in_it() -> None:
    """Neither in the score nor in the metrics."""
    only = _task("mix[turning=1]")
    assert torch.equal(only.score(MOTION), _task("turning").score(MOTION))
    assert set(only.metrics(MOTION)) & {"movement_speed", "waypoint_following"} == set()
    assert only.metrics(MOTION)["turning"][1] == "m/s"


def test_both_spellings_are_one_mixture() -> None:
    """Tasks are written as their names are, and as parameters are."""
    one, other = (registry.resolve(Kind.TASK, Ref.parse(f"mix[movement{sign}speed=1]")) for sign in "-_")
    assert one == other


@pytest.mark.parametrize(
    ("x", "z", "wanted"), [(0.0288, 0.0048, 0.0), (0.0288, -0.0252, -0.03), (0.0, 0.0048, -0.0288)]
)
def test_the_final_position_is_judged_at_the_end(x: float, z: float, wanted: float) -> None:
    """60 frames at 0.06 m/s ahead and 0.01 m/s to the right end at (0.0288, 0.0048)."""
    task = _task(f"final-position[x={x},z={z}]")
    rewards = task.reward(MOTION)
    assert task.score(MOTION).item() == rewards[-1].item() == pytest.approx(wanted, abs=1e-12)
    assert rewards.shape == (60, 1)
    assert task.metrics(MOTION)["nearest_distance"][0].item() == -rewards.max().item()
