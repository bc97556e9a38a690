"""Velocity tracking of robots that follow, lag, or have another heading."""

import math

import numpy as np
import pytest
import torch

from tests.tasks.motions import SECONDS, block, motion, yaw
from zoobench.tasks.base import Motion
from zoobench.tasks.paths import Path
from zoobench.tasks.velocity_tracking import VelocityTracking


def _follower(path: Path, share: float = 1.0, aside: float = 0.0, frames: int = 150) -> Motion:
    """A rigid robot with a heading `aside` [rad] left of the target's direction and `share` of its speed."""
    rest, times = block(), np.arange(frames + 1) * SECONDS
    velocities = path.velocities(times)
    velocities[0] = [1.0, 0.0, 0.0]  # at rest it looks ahead
    angles = np.arctan2(-velocities[:, 2], velocities[:, 0]) + aside
    velocities[0] = 0.0
    turned = torch.stack([rest @ yaw(angle).T for angle in angles])
    looks = np.stack([np.cos(angles), np.zeros(len(angles)), -np.sin(angles)], axis=1)
    speeds = share * np.linalg.norm(velocities, axis=1, keepdims=True) * looks
    return motion(rest, turned, torch.from_numpy(speeds)[:, None].expand(-1, len(rest), -1))


@pytest.mark.parametrize("shape", ["straight", "arc", "s-curve", "random"])
def test_a_robot_that_moves_as_the_target_scores_zero(shape: str) -> None:
    """Along every path, with success."""
    task = VelocityTracking(path=shape)  # type: ignore[arg-type]
    follower = _follower(task.route)
    assert task.score(follower).item() == pytest.approx(0.0, abs=1e-9)
    metrics = task.metrics(follower)
    assert metrics["success"][0].item() == 1.0
    assert metrics["heading_error"][0].item() == pytest.approx(0.0, abs=1e-6)
    assert metrics["speed_error"][0].item() == pytest.approx(0.0, abs=1e-9)


def test_magnitude_and_direction_are_weighed_apart() -> None:
    """Half the speed costs 0.1 of half the target's speed, 0.6 rad aside 0.9 of it times 1 - cos 0.6."""
    task = VelocityTracking()
    speed = np.linalg.norm(task.route.velocities(np.arange(1, 151) * SECONDS), axis=1).mean()
    slow, aside = _follower(task.route, share=0.5), _follower(task.route, aside=0.6)
    assert task.score(slow).item() == pytest.approx(-0.1 * 0.5 * speed)
    assert task.score(aside).item() == pytest.approx(-0.9 * (1 - math.cos(0.6)) * speed)
    assert task.metrics(slow)["success"][0].item() == 0.0
    assert task.metrics(aside)["success"][0].item() == 0.0
    assert task.metrics(aside)["heading_error"][0].item() == pytest.approx(0.6)
    even = VelocityTracking(direction_weight=0.5)
    assert even.score(slow).item() == pytest.approx(-0.5 * 0.5 * speed)


def test_moving_backwards_is_worse_than_standing() -> None:
    """The velocity along the heading has a sign."""
    task = VelocityTracking()
    scores = [task.score(_follower(task.route, share)).item() for share in (-1.0, 0.0, 1.0)]
    assert scores == sorted(scores)
    assert scores[0] == pytest.approx(2 * scores[1])


def test_targets_follow_the_clock() -> None:
    """After 10000 frames the target is that of the path at 80 s, bit for bit."""
    task = VelocityTracking(path="s-curve")
    rest = block(count=1)
    long = motion(rest, rest.expand(10001, -1, -1))
    np.testing.assert_array_equal(long.clock().numpy(), np.arange(10001) * SECONDS)
    assert long.clock()[-1].item() == 80.0
    expected = task.route.velocities(np.array([0.0, 80.0]))[1]
    np.testing.assert_array_equal(task.targets(long)[-1].numpy(), expected)
