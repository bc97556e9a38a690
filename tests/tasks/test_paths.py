"""Target paths against the curves of their names."""

import math
from typing import get_args

import numpy as np
import pytest

from zoobench import registry
from zoobench.envs.base import Environment
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.spec import Ref
from zoobench.tasks.paths import INTERVAL, Path, PathShape
from zoobench.tasks.velocity_tracking import VelocityTracking
from zoobench.tasks.waypoint_following import WaypointFollowing

SHAPES = get_args(PathShape)
TIMES = np.arange(201) * 0.008
RUNNING = TIMES >= INTERVAL
TURNING = TIMES >= 2 * INTERVAL


@pytest.mark.parametrize("shape", SHAPES)
def test_a_path_starts_at_rest_and_is_level(shape: PathShape) -> None:
    """From the origin, ahead at first, with the velocity as the derivative of the position."""
    path = Path(shape, 0.05)
    positions, velocities = path.positions(TIMES), path.velocities(TIMES)
    assert (positions[0] == 0.0).all()
    assert (velocities[0] == 0.0).all()
    assert np.isfinite(positions).all()
    assert (positions[:, 1] == 0.0).all()
    assert (positions[~RUNNING, 2] == 0.0).all()
    assert (np.diff(velocities[~RUNNING, 0]) > 0.0).all()
    width = 1e-5
    gradient = (path.positions(TIMES[1:-1] + width) - path.positions(TIMES[1:-1] - width)) / (2 * width)
    np.testing.assert_allclose(velocities[1:-1], gradient, atol=1e-9)


@pytest.mark.parametrize("shape", SHAPES)
def test_a_path_does_not_depend_on_its_length(shape: PathShape) -> None:
    """A longer episode begins as a shorter one."""
    path = Path(shape, 0.05, seed=3)
    whole = path.positions(np.arange(1001) * 0.008)
    assert np.isfinite(whole).all()
    for frames in (1, 49, 50, 51, 150, 1000):
        np.testing.assert_array_equal(path.positions(np.arange(frames + 1) * 0.008), whole[: frames + 1])


@pytest.mark.parametrize("shape", SHAPES)
def test_a_faster_path_is_a_larger_one(shape: PathShape) -> None:
    """With the same dependence on time."""
    np.testing.assert_allclose(Path(shape, 0.2).positions(TIMES), 4 * Path(shape, 0.05).positions(TIMES), rtol=1e-12)


def test_the_straight_path_runs_ahead_at_its_speed() -> None:
    """After the start the velocity is constant."""
    velocities = Path("straight", 0.05).velocities(TIMES)
    np.testing.assert_allclose(velocities[RUNNING], np.tile([0.05, 0.0, 0.0], (RUNNING.sum(), 1)), atol=1e-14)


def test_the_arc_is_a_circle_to_the_left() -> None:
    """At 0.05 m/s and 0.5 rad/s: a radius of 0.1 m and a uniform rotation, with an error below 1e-8 m."""
    path = Path("arc", 0.05)
    positions, velocities = path.positions(TIMES)[TURNING], path.velocities(TIMES)[TURNING]
    ahead = 0.05 * INTERVAL / 2  # the run-up
    np.testing.assert_allclose(np.hypot(positions[:, 0] - ahead, positions[:, 2] + 0.1), 0.1, atol=1e-8)
    np.testing.assert_allclose(np.hypot(velocities[:, 0], velocities[:, 2]), 0.05, rtol=1e-5)
    turned = np.arctan2(-velocities[:, 2], velocities[:, 0])
    np.testing.assert_allclose(turned, 0.5 * (TIMES[TURNING] - INTERVAL), atol=1e-5)


def test_the_s_curve_swings_to_both_sides() -> None:
    """In a period its direction deviates by 38 degrees to the left and to the right, and returns."""
    times = np.linspace(2 * INTERVAL, 2 * INTERVAL + 1.6, 200)
    positions, velocities = Path("s-curve", 0.05).positions(times), Path("s-curve", 0.05).velocities(times)
    headings = np.degrees(np.arctan2(-velocities[:, 2], velocities[:, 0]))
    steepest = math.degrees(math.atan(math.pi / 4))
    assert headings.max() == pytest.approx(steepest, rel=1e-2)
    assert headings.min() == pytest.approx(-steepest, rel=1e-2)
    np.testing.assert_allclose(positions[-1] - positions[0], [0.05 * 1.6, 0.0, 0.0], atol=1e-12)


def test_the_random_path_is_that_of_its_seed() -> None:
    """Equal seeds give equal paths; a path never turns back within a second and never stops."""
    paths = [Path("random", 0.05, seed).positions(TIMES) for seed in (1, 1, 2)]
    np.testing.assert_array_equal(paths[0], paths[1])
    assert np.abs(paths[0] - paths[2]).max() > 0.005
    for seed in range(20):
        velocities = Path("random", 0.05, seed).velocities(TIMES[RUNNING])
        assert np.hypot(velocities[:, 0], velocities[:, 2]).min() > 0.02


@pytest.mark.parametrize("env", registry.names(Kind.ENV))
@pytest.mark.parametrize("task", [VelocityTracking(), WaypointFollowing()])
def test_the_default_path_fits_into_every_environment(env: str, task: VelocityTracking | WaypointFollowing) -> None:
    """A robot of 0.1 m x 0.05 m that follows it for 200 frames stays 1 cm away from the walls."""
    environment: Environment = registry.create(Kind.ENV, Ref(env))
    length, _, width = environment.arena
    start = np.array([environment.start[0] * length, 0.0, environment.start[1] * width])
    way = start + task.route.positions(TIMES)
    reach = math.hypot(0.05, 0.025) + 0.01
    assert reach < way[:, 0].min() < way[:, 0].max() < length - reach
    assert reach < way[:, 2].min() < way[:, 2].max() < width - reach


@pytest.mark.parametrize("parameters", [{"speed": 0.0}, {"speed": math.nan}, {"speed": 0.1, "seed": -1}])
def test_an_impossible_path_is_refused(parameters: dict[str, float]) -> None:
    """No speed, or a negative seed."""
    with pytest.raises(UsageError, match="is not possible"):
        Path("random", **parameters)  # type: ignore[arg-type]
