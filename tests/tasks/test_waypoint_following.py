"""Waypoint following of robots that follow, stand, and lag."""

import math

import numpy as np
import pytest
import torch

from tests.tasks.motions import SECONDS, block, motion
from zoobench.tasks.base import Motion
from zoobench.tasks.paths import Path
from zoobench.tasks.waypoint_following import WaypointFollowing


def _carried(path: Path, off: tuple[float, float, float] = (0.0, 0.0, 0.0), frames: int = 150) -> Motion:
    """A robot carried along the path from any start, with an offset `off` [m] after the start."""
    rest = block()
    way = torch.from_numpy(path.positions(np.arange(frames + 1) * SECONDS))
    way[1:] += torch.tensor(off)
    return motion(rest, rest + 0.4 + way[:, None])


@pytest.mark.parametrize("shape", ["straight", "arc", "s-curve", "random"])
def test_a_robot_that_is_carried_along_scores_zero(shape: str) -> None:
    """Along every path, from any start."""
    task = WaypointFollowing(path=shape)  # type: ignore[arg-type]
    carried = _carried(task.route)
    assert task.score(carried).item() == pytest.approx(0.0, abs=1e-12)
    assert task.metrics(carried)["success"][0].item() == 1.0


def test_the_score_is_the_level_distance() -> None:
    """3 cm ahead and 4 cm aside are 5 cm at any height; the root mean square is the same."""
    task = WaypointFollowing()
    off = _carried(task.route, (0.03, 0.7, -0.04))
    assert task.score(off).item() == pytest.approx(-0.05)
    metrics = task.metrics(off)
    assert metrics["rms_error"][0].item() == pytest.approx(0.05)
    assert metrics["final_error"][0].item() == pytest.approx(0.05)
    assert metrics["success"][0].item() == 0.0
    assert WaypointFollowing(tolerance=0.06).metrics(off)["success"][0].item() == 1.0


def test_a_robot_that_stands_is_left_behind() -> None:
    """The errors are the distances along the path, with different mean and root mean square."""
    task = WaypointFollowing(path="straight")
    rest = block()
    still = motion(rest, rest.expand(151, -1, -1))
    way = task.route.positions(np.arange(1, 151) * SECONDS)[:, 0]
    assert task.score(still).item() == pytest.approx(-way.mean())
    metrics = task.metrics(still)
    assert metrics["rms_error"][0].item() == pytest.approx(math.sqrt((way**2).mean()))
    assert metrics["final_error"][0].item() == pytest.approx(way[-1])
    assert metrics["heading_error"][0].item() == pytest.approx(0.0, abs=1e-12)


def test_targets_follow_the_clock() -> None:
    """After 10000 frames the waypoint is that of 80 s, bit for bit, from the centre of mass."""
    task = WaypointFollowing(path="s-curve")
    rest = block(count=1)
    long = motion(rest, rest.expand(10001, -1, -1))
    expected = long.centre_of_mass()[0, 0] + torch.from_numpy(task.route.positions(np.array([0.0, 80.0]))[1])
    assert torch.equal(task.targets(long)[-1, 0], expected)


def test_meeting_the_waypoint_passes_a_finite_gradient() -> None:
    """At distance zero the root has no derivative: it counts as zero."""
    task = WaypointFollowing()
    rest = block(count=1)
    way = torch.from_numpy(task.route.positions(np.arange(4) * SECONDS))
    centred = rest - rest.mean(dim=0)
    positions = (centred + way[:, None]).requires_grad_()
    (gradient,) = torch.autograd.grad(task.objective(motion(centred, positions)).sum(), positions)
    assert torch.isfinite(gradient).all()
