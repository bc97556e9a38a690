"""What the readings of one motion share."""

from collections.abc import Callable

import pytest
import torch

from tests.tasks import motions
from zoobench import registry
from zoobench.registry import Kind
from zoobench.spec import Ref
from zoobench.tasks import turning
from zoobench.tasks.base import Motion, Task
from zoobench.tasks.turning import Turning


def _spinning(leaf: bool = False) -> Motion:
    rest = motions.disc()
    path = torch.stack([rest, rest + 0.01])
    found = motions.motion(rest, path, torch.flip(path, [2]))
    found.positions.requires_grad_(leaf)
    return found


def test_readings_share_the_reward(monkeypatch: pytest.MonkeyPatch) -> None:
    """Score, reward and metrics of an episode compute it once, and not at all where the objective was asked for."""
    calls: list[bool] = []
    compute: Callable[[Motion], torch.Tensor] = turning._tangential_velocity

    def counted(motion: Motion) -> torch.Tensor:
        calls.append(torch.is_grad_enabled())
        return compute(motion)

    monkeypatch.setattr(turning, "_tangential_velocity", counted)
    task, plain, differentiated = Turning(), _spinning(), _spinning(leaf=True)
    objective = task.objective(differentiated)
    for motion in (plain, differentiated):
        with torch.no_grad():
            readings = [task.score(motion), task.reward(motion)[-1], task.metrics(motion)["tangential_velocity"][0]]
        assert all(torch.equal(reading, objective.detach()) for reading in readings)
        assert not any(reading.requires_grad for reading in readings)
    assert calls == [True, False]


def test_every_gradient_has_a_graph_of_its_own() -> None:
    """Though the number is known already, and one gradient was taken."""
    motion, gradients = _spinning(leaf=True), []
    with torch.no_grad():
        Turning().score(motion)
    for _ in range(2):
        gradients += torch.autograd.grad(Turning().objective(motion).sum(), motion.positions)
    assert torch.equal(*gradients)
    assert gradients[0].abs().max() > 0.0


@pytest.mark.parametrize("task", ["movement-speed", "turning", "velocity-tracking", "waypoint-following"])
def test_a_motion_in_memory_that_is_written_anew_has_the_rewards_of_a_new_one(task: str) -> None:
    """Bit for bit, once it was told to forget; what was computed of the bodies alone is kept."""
    first, second = _spinning(), _spinning()
    second.positions[1] += torch.linspace(0.0, 0.02, second.positions[1].numel()).view_as(second.positions[1]) ** 2
    second.velocities[1] *= -1.5
    made: Task = registry.create(Kind.TASK, Ref(task))
    with torch.no_grad():
        before, expected = made.reward(first), made.reward(second)
        first.positions[:], first.velocities[:] = second.positions, second.velocities
        kept = dict(first._of_bodies)
        first.forget()
        again = made.reward(first)
    assert torch.equal(again, expected)
    assert not torch.equal(again, before)
    assert kept
    assert all(first._of_bodies[name] is value for name, value in kept.items())
