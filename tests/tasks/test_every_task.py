"""Requirements on every task."""

import dataclasses

import pytest
import torch

from tests.tasks.motions import block, disc, rigid
from zoobench import registry
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.spec import Ref

SMALL = disc(rings=1, spokes=3)


@pytest.mark.parametrize(
    ("task", "points", "by_positions", "by_velocities"),
    [
        ("movement-speed[heading=40]", SMALL, False, True),
        ("turning", SMALL, True, True),
        ("velocity-tracking", block(count=1), True, True),
        ("waypoint-following", block(count=1), True, False),
        ("final-position", block(count=1), True, False),
        ("mix[turning=0.2,velocity-tracking=-1,final-position=3]", block(count=1), True, True),
    ],
)
def test_the_gradient_is_that_of_the_score(
    task: str, points: torch.Tensor, by_positions: bool, by_velocities: bool
) -> None:
    """Against finite differences in the positions and velocities on which the score depends."""
    made = registry.create(Kind.TASK, Ref.parse(task))
    motion = rigid(points, spin=7.0, velocity=(0.1, 0.0, 0.02), frames=3)
    names = [name for name, free in (("positions", by_positions), ("velocities", by_velocities)) if free]

    def objective(*leaves: torch.Tensor) -> torch.Tensor:
        score: torch.Tensor = made.objective(dataclasses.replace(motion, **dict(zip(names, leaves, strict=True))))
        return score

    leaves = tuple(getattr(motion, name).clone().requires_grad_() for name in names)
    assert torch.autograd.gradcheck(objective, leaves)


@pytest.mark.parametrize(
    "task",
    [
        "movement-speed",
        "turning",
        "velocity-tracking",
        "waypoint-following[path=random]",
        "final-position",
        "mix[movement-speed=1,velocity-tracking=2,waypoint-following=3,final-position=4]",
    ],
)
def test_a_reward_does_not_depend_on_what_comes_after(task: str) -> None:
    """The rewards of a shorter episode are the first rewards of a longer one."""
    whole = rigid(block(), spin=1.0, velocity=(0.02, 0.0, 0.01), frames=150)
    part = dataclasses.replace(whole, positions=whole.positions[:71], velocities=whole.velocities[:71])
    reward = registry.create(Kind.TASK, Ref.parse(task)).reward
    torch.testing.assert_close(reward(part), reward(whole)[:70], rtol=1e-12, atol=0.0)


@pytest.mark.parametrize(
    ("task", "message"),
    [
        ("velocity-tracking[direction_weight=1.5]", "out of range"),
        ("velocity-tracking[speed=0]", "is not possible"),
        ("waypoint-following[tolerance=0]", "positive tolerance"),
        ("waypoint-following[path_seed=-1]", "is not possible"),
        ("mix", "without weights"),
        ("mix[speed=2]", "without weights"),
        ("mix[waypoint_following=1,speed=0]", "is not possible"),
        ("mix[hopping=1]", "hopping"),
    ],
)
def test_settings_that_mean_nothing_are_refused(task: str, message: str) -> None:
    """A weight out of range, no tolerance, and impossible paths."""
    with pytest.raises(UsageError, match=message):
        registry.create(Kind.TASK, Ref.parse(task))
