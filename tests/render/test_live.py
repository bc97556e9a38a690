"""Pictures of an episode while it is simulated."""

import numpy as np
import pytest

from tests.conformance.cells import POND, TANK, cell
from zoobench.cell.problem import Problem
from zoobench.render.actors import TARGET
from zoobench.render.canvas import Image
from zoobench.render.live import LivePicture
from zoobench.render.present import Present
from zoobench.render.viewpoint import View
from zoobench.testing import DOUBLE


def _count(image: Image) -> int:
    """Pixels in the target's colour."""
    colour = [int(TARGET[place : place + 2], 16) for place in (1, 3, 5)]
    return int((np.abs(image.astype(int) - colour).sum(axis=2) < 100).sum())


def test_target_and_robot_are_where_they_are_now() -> None:
    """The target's ball leaves the robot's; the robot and its path go with the particles."""
    problem = Problem(cell(task="waypoint-following[path=straight,speed=0.04]", frames=200))
    start = problem.scene.robot.positions
    picture = LivePicture(problem, start, problem.task)
    still = np.zeros(problem.body.muscle_count)
    first = picture.at(Present(0.0, start, still))
    later = picture.at(Present(1.6, start, still))
    moved = picture.at(Present(1.6, start + np.array([0.02, 0.0, 0.0]), still))
    again = picture.at(Present(1.6, start, still))
    picture.close()
    assert _count(later) > _count(first) + 20
    assert (moved != later).any(axis=2).mean() > 0.01
    np.testing.assert_array_equal(again, later)


def test_the_camera_goes_with_the_arena() -> None:
    """A robot that is metres away from its start is seen as large as there; without the arena's way it is not seen."""
    problem = Problem(cell())
    start, muscles = problem.scene.robot.positions, np.ones(problem.body.muscle_count)
    picture = LivePicture(problem, start, problem.task)
    far = np.array([3.0, 0.0, -2.0])
    here, there, lost = (
        _red(picture.at(Present(0.0, start + way, muscles, offset=offset)))
        for way, offset in ((0.0 * far, 0.0 * far), (far, far), (far, 0.0 * far))
    )
    picture.close()
    assert here > lost + 500
    assert abs(there - here) < 0.1 * (here - lost)


def _red(image: Image) -> int:
    """Pixels of muscles that contract."""
    colours = image.astype(int)
    return int((colours[..., 0] > colours[..., 1] + 80).sum())


def test_water_is_drawn_as_it_flows_now() -> None:
    """A shear in it is seen, and its end, too."""
    problem = Problem(cell(environment=POND, fidelity=DOUBLE))
    start, muscles = problem.scene.robot.positions, np.zeros(problem.body.muscle_count)
    cells = problem.scene.cells(problem.fidelity.grid_spacing)
    flow = np.zeros((*cells, 3))
    flow[:, :, : cells[2] // 2, 0] = 1.0
    picture = LivePicture(problem, start, problem.task)
    rest, shear, end = (picture.at(Present(0.0, start, muscles, speed * flow)) for speed in (0.0, 1.0, 0.0))
    picture.close()
    assert (shear != rest).any(axis=2).mean() > 0.01
    np.testing.assert_array_equal(end, rest)


@pytest.mark.slow
def test_a_camera_that_follows_goes_with_the_robot() -> None:
    """The robot stays where it is in the picture, though it is elsewhere; by the camera of films it has moved."""
    problem = Problem(cell())
    start, muscles = problem.scene.robot.positions, np.ones(problem.body.muscle_count)
    moved = start + np.array([0.05, 0.0, 0.0])
    ways = {}
    for camera in ("film", "follow", "side", "top"):
        picture = LivePicture(problem, start, problem.task, View(camera=camera))
        moments = (Present(0.0, start, muscles), Present(0.008, moved, muscles))
        before, after = (_column(picture.at(present)) for present in moments)
        picture.close()
        ways[camera] = after - before
    assert abs(ways.pop("follow")) < 5
    assert min(ways.values()) > 40


def _column(image: Image) -> float:
    """Mean column of the pixels of muscles that contract."""
    colours = image.astype(int)
    return float(np.nonzero(colours[..., 0] > colours[..., 1] + 80)[1].mean())


def test_a_robot_in_water_is_seen_from_above() -> None:
    """Water of particles that hides it is drawn below it."""
    problem = Problem(cell(environment=TANK))
    start = problem.scene.robot.positions
    places = np.vstack([start, problem.scene.medium.positions])  # type: ignore[union-attr]
    picture = LivePicture(problem, places, problem.task, View(camera="top"))
    image = picture.at(Present(0.0, places, np.ones(problem.body.muscle_count)))
    picture.close()
    assert _red(image) > 500
