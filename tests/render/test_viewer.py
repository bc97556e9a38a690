"""A page in the browser shows what is simulated."""

import socket
import sys
import urllib.request
from collections.abc import Iterator

import numpy as np
import pytest

from tests.conformance.cells import POND, cell
from tests.render.browser import Page, node, skin_centres
from zoobench.cell.problem import Problem
from zoobench.errors import UsageError
from zoobench.render.nodes import muscle_faces
from zoobench.render.present import Present
from zoobench.render.recording import target_path
from zoobench.render.viewer import PORT, Viewer
from zoobench.testing import DOUBLE


@pytest.fixture
def viewer() -> Iterator[Viewer]:
    """A page that nobody has open."""
    made = Viewer(port=0)
    yield made
    made.close()


def _begin(viewer: Viewer, problem: Problem) -> Present:
    """Show a problem's robot where it is put; that moment."""
    start = Present(0.0, _positions(problem), np.zeros(problem.body.muscle_count))
    viewer.begin(problem, start, problem.task)
    return start


def _positions(problem: Problem) -> np.ndarray:
    medium = problem.scene.medium
    return np.vstack([problem.scene.robot.positions, *([] if medium is None else [medium.positions])])


def test_the_page_is_served(viewer: Viewer) -> None:
    """At its address, by this process; somebody who opens it is noticed, and that they leave."""
    with urllib.request.urlopen(viewer.address) as page:
        assert b"<html" in page.read()
    assert not viewer.is_watched
    with Page(viewer):
        assert viewer.is_watched
    assert not viewer.is_watched


def test_the_robot_is_where_its_particles_are(viewer: Viewer) -> None:
    """Its skin goes with them, and the world in the other direction: the camera follows."""
    problem = Problem(cell(frames=1000))
    start, way = _begin(viewer, problem), np.array([0.4, 0.0, -0.1])
    before = skin_centres(viewer)
    assert len(before) >= 2
    np.testing.assert_array_equal(node(viewer, "").position, np.zeros(3))
    for seconds in (4.0, 8.0):
        viewer.show(start._replace(seconds=seconds, positions=start.positions + way))
    np.testing.assert_allclose(np.array(skin_centres(viewer)) - before, np.tile(way, (len(before), 1)), atol=1e-6)
    np.testing.assert_allclose(node(viewer, "").position, -way, atol=1e-3)
    assert viewer.moved == pytest.approx(np.hypot(0.4, 0.1))


def test_a_stroke_does_not_shake_the_picture(viewer: Viewer) -> None:
    """What the robot does within a frame moves the world by a twentieth of it."""
    problem = Problem(cell())
    start = _begin(viewer, problem)
    viewer.show(start._replace(seconds=0.008, positions=start.positions + np.array([0.03, 0.0, 0.0])))
    assert 0.0 < -node(viewer, "").position[0] < 0.0017


def test_muscles_have_the_colour_of_what_they_do(viewer: Viewer) -> None:
    """Red where they contract, blue where they extend, grey at rest."""
    problem = Problem(cell())
    start = _begin(viewer, problem)

    def colours(activity: np.ndarray) -> set[tuple[int, ...]]:
        viewer.show(start._replace(activity=activity))
        return {tuple(node(viewer, f"robot/{number}").color) for number in range(len(skin_centres(viewer)))}

    muscles = problem.body.muscle_count
    (rest,) = colours(np.zeros(muscles))
    assert max(rest) - min(rest) == 0
    assert all(red > 2 * blue for red, _, blue in colours(np.ones(muscles)))
    assert all(blue > 2 * red for red, _, blue in colours(-np.ones(muscles)))
    one = colours(np.eye(muscles)[0])
    assert len(one) >= 2, "the others rest"


def test_every_face_is_in_one_piece() -> None:
    """With those whose corners belong to the same muscles, in any order; no muscle counts as one."""
    faces = np.array([[0, 1, 2], [2, 3, 4], [3, 4, 2], [4, 2, 3], [4, 5, 5]])
    shares = np.array([[0.0, 0.1], [0.2, 0.0], [0.0, 0.0], [0.9, 0.1], [0.2, 0.8], [0.0, 1.0]])
    pieces = [piece.tolist() for piece in muscle_faces(faces, shares)]
    assert sorted(pieces) == [[[0, 1, 2]], [[2, 3, 4], [3, 4, 2], [4, 2, 3]], [[4, 5, 5]]]


def test_the_bed_goes_with_its_particles_and_the_arena(viewer: Viewer) -> None:
    """To a quarter of a millimetre, wherever the robot has come to."""
    problem = Problem(cell(environment="desert", fidelity=DOUBLE))
    start, way = _begin(viewer, problem), np.array([3.0, 0.0, 0.5])
    bed = node(viewer, "medium")
    shift = np.array([0.0, 0.01, 0.0])
    viewer.show(start._replace(positions=start.positions + way + shift, offset=way))
    shown = bed.points.astype(float) + bed.position
    medium = start.positions[problem.body.particle_count :]
    np.testing.assert_allclose(shown, medium + way + shift, atol=2.5e-4)


def test_the_target_is_where_it_is_now(viewer: Viewer) -> None:
    """Its ball moves along its path; the robot's path ends at its centre of mass."""
    problem = Problem(cell(task="waypoint-following[path=straight,speed=0.04]", frames=200))
    start = _begin(viewer, problem)
    ball = node(viewer, "target-now")
    begun = np.array(ball.position)
    viewer.show(start._replace(seconds=1.6))
    expected = target_path(problem.task, begun, 200)
    assert expected is not None
    np.testing.assert_allclose(ball.position, expected[200], atol=1e-9)
    assert np.linalg.norm(ball.position - begun) > 0.05
    way = np.array([0.02, 0.0, 0.0])
    viewer.show(start._replace(seconds=0.8, positions=start.positions + way))
    path = node(viewer, "path").points
    np.testing.assert_allclose(path[-1, 1] - path[0, 0], way, atol=1e-6)


def test_hills_are_as_high_as_they_are(viewer: Viewer) -> None:
    """All over the arena; level ground is no mesh, and has no end."""
    problem = Problem(cell(environment="ground[relief=0.02,wavelength=0.1]"))
    _begin(viewer, problem)
    hills = node(viewer, "ground").vertices
    assert problem.scene.ground is not None
    assert problem.scene.ground.terrain is not None
    np.testing.assert_allclose(hills[:, 1], problem.scene.ground.terrain.heights_below(hills), atol=1e-6)
    assert 0.01 < np.ptp(hills[:, 1]) <= 0.02
    _begin(viewer, Problem(cell()))
    assert not hasattr(node(viewer, "ground"), "vertices")


def test_water_is_shown_as_it_flows_now(viewer: Viewer) -> None:
    """A shear is seen where it is: along the robot's way, on the line where the velocity changes."""
    problem = Problem(cell(environment=POND, fidelity=DOUBLE))
    start = _begin(viewer, problem)
    cells = problem.scene.cells(problem.fidelity.grid_spacing)
    flow = np.zeros((*cells, 3))
    flow[:, :, : cells[2] // 2, 0] = 1.0
    still = node(viewer, "water").image.copy()
    viewer.show(start._replace(flow=flow))
    changed = (node(viewer, "water").image != still).any(axis=2)
    assert changed.shape == (cells[2] + 1, cells[0] + 1)
    assert np.flatnonzero(changed.any(axis=1)).tolist() == [cells[2] // 2]


def test_another_problem_makes_the_page_anew(viewer: Viewer) -> None:
    """And the next episode of the same one does not."""
    problem = Problem(cell(environment="desert", fidelity=DOUBLE))
    _begin(viewer, problem)
    bed = node(viewer, "medium")
    _begin(viewer, problem)
    assert node(viewer, "medium") is bed
    _begin(viewer, Problem(cell()))
    assert viewer.server.scene.get_handle_by_name("/world/medium") is None


def test_ports_in_use_are_told() -> None:
    """One that is asked for is refused; else the next free one is taken. A host of another machine is refused."""
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(UsageError, match=rf"port {port}: Address already in use\. Give another --port"):
            Viewer(port=port)
    with pytest.raises(UsageError, match=r"192\.0\.2\.1.*Cannot assign"):
        Viewer("192.0.2.1", 0)
    for name, fault in (("nowhere.invalid", "[Nn]ame"), ("a..b", "not a host name")):
        with pytest.raises(UsageError, match=rf"No page can be served at '{name}': .*{fault}"):
            Viewer(name)
    first, second = Viewer(), Viewer()
    try:
        ports = [int(each.address.rpartition(":")[2]) for each in (first, second)]
        assert PORT <= ports[0] < ports[1]
    finally:
        first.close()
        second.close()


def test_nothing_is_said_on_standard_output(capfd: pytest.CaptureFixture[str]) -> None:
    """It is for data; viser greets there."""
    Viewer(port=0).close()
    assert capfd.readouterr().out == ""


def test_a_missing_library_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """With what installs it."""
    monkeypatch.setitem(sys.modules, "viser", None)
    with pytest.raises(UsageError, match=r"viser, which is not installed\. Try: pip install 'zoobench\[watch\]'"):
        Viewer(port=0)
