"""Requirements on every task."""

import dataclasses

import pytest
import torch

from tests.tasks.motions import block, disc, mapped, rigid, roll, scattered, yaw
from tests.tasks.motions import motion as still
from zoobench import registry
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.spec import Ref

SMALL = disc(rings=1, spokes=3)

FORMED = ("jump", "flip", "balance", "height", "span", "area", "shape[height=1.2]")
"""Tasks without a way over the ground."""


@pytest.mark.parametrize(
    ("task", "points", "by_positions", "by_velocities"),
    [
        ("movement-speed[heading=40]", SMALL, False, True),
        ("turning", SMALL, True, True),
        ("velocity-tracking", block(count=1), True, True),
        ("waypoint-following", block(count=1), True, False),
        ("final-position", block(count=1), True, False),
        ("mix[turning=0.2,velocity-tracking=-1,final-position=3]", block(count=1), True, True),
        ("mix[sideways=-1,heading=40]", SMALL, False, True),
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


@pytest.mark.parametrize("task", FORMED)
def test_the_gradient_is_that_of_the_score_of_a_deforming_body(task: str) -> None:
    """By all states, the first too, and by the occupancy of the particles."""
    made = registry.create(Kind.TASK, Ref.parse(task))
    squeeze = torch.diag(torch.tensor([1.1, 0.9, 1.2], dtype=torch.float64))
    moved = mapped(scattered(9), [squeeze, yaw(0.3) @ squeeze, roll(0.4) @ squeeze])
    moved = dataclasses.replace(moved, positions=moved.positions + 0.01 * torch.arange(4)[:, None, None, None])

    def objective(positions: torch.Tensor, occupancy: torch.Tensor) -> torch.Tensor:
        score: torch.Tensor = made.objective(
            dataclasses.replace(moved, positions=positions, occupancy=occupancy, masses=occupancy)
        )
        return score

    occupancy = torch.linspace(0.6, 1.0, 9, dtype=torch.float64)[None]
    assert torch.autograd.gradcheck(
        objective,
        (moved.positions.clone().requires_grad_(), occupancy.requires_grad_()),
        eps=1e-8,
        atol=1e-6,
        fast_mode=True,
    )


@pytest.mark.parametrize("task", FORMED)
def test_a_body_that_does_nothing_scores_nothing(task: str) -> None:
    """Exactly, in rewards and the objective too, and with a finite gradient."""
    made, rest = registry.create(Kind.TASK, Ref.parse(task)), block()
    idle = still(rest, rest.expand(6, -1, -1).clone())
    for value in (made.score(idle), made.objective(idle), made.reward(idle)):
        torch.testing.assert_close(value, torch.zeros_like(value), rtol=0.0, atol=1e-15)
    idle.positions.requires_grad_()
    (gradient,) = torch.autograd.grad(made.objective(idle).sum(), idle.positions)
    assert torch.isfinite(gradient).all()


@pytest.mark.parametrize("task", FORMED)
def test_a_score_has_the_same_bits_after_a_gradient(task: str) -> None:
    """What the objective has computed is shared, and a solution is simulated once more without a gradient."""
    made = registry.create(Kind.TASK, Ref.parse(task))
    alone = mapped(scattered(50), [roll(0.2 * n) @ yaw(0.3) for n in range(1, 5)])
    shared = dataclasses.replace(alone, positions=alone.positions.clone().requires_grad_())
    made.objective(shared)
    with torch.no_grad():
        assert torch.equal(made.score(alone), made.score(shared))
        assert torch.equal(made.reward(alone), made.reward(shared))


@pytest.mark.parametrize("task", FORMED)
def test_it_does_not_matter_where_a_body_starts(task: str) -> None:
    """All that counts is relative to the first state."""
    made = registry.create(Kind.TASK, Ref.parse(task))
    here = mapped(scattered(), [roll(0.2), yaw(0.3) @ roll(-0.5)])
    there = dataclasses.replace(here, positions=here.positions + torch.tensor([0.7, 0.2, -1.3]))
    torch.testing.assert_close(made.score(there), made.score(here), rtol=1e-9, atol=1e-14)
    torch.testing.assert_close(made.reward(there), made.reward(here), rtol=1e-9, atol=1e-14)


@pytest.mark.parametrize(
    "task",
    [
        "movement-speed",
        "turning",
        "velocity-tracking",
        "waypoint-following[path=random]",
        "final-position",
        *FORMED,
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
        ("shape[width=0]", "no body"),
        ("shape[length=1,height=1]", "starts with"),
        ("waypoint-following[path_seed=-1]", "is not possible"),
        ("push-to[x=0]", "begins at x = 0 and z = 0"),
        ("reach[x=0,y=0]", "begins at x, y and z = 0"),
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
