"""Objects in recordings, pictures, films and live views: they are drawn, and nothing takes them for the bed."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from tests.conformance.cells import cell
from tests.render.filmed import needs_drawing
from zoobench.cell.problem import Problem
from zoobench.render.canvas import Image
from zoobench.render.colours import OBJECT
from zoobench.render.film import Film, film
from zoobench.render.film_files import write
from zoobench.render.formats import Destination, FilmFormat
from zoobench.render.live import LivePicture
from zoobench.render.present import LiveWorld, Present
from zoobench.render.recording import BodyPlaces, Snapshot, snapshots
from zoobench.render.skin import object_skin
from zoobench.render.stills import snapshot_image
from zoobench.render.viewpoint import region_of
from zoobench.testing import DOUBLE, WITH_OBJECT

SPEC = cell(environment="ground[object=box,object_count=2]", task="push", frames=4)
"""With two boxes, for what simulates nothing."""
NAMES = ["object", "object-1"]
ONE = cell(environment=WITH_OBJECT, task="push-to", frames=4, fidelity=DOUBLE)
"""As in the conformance suite, whose kernels it has."""


@cache
def _shot() -> Snapshot:
    (shot,) = snapshots([ONE.env], fidelity=ONE.fidelity)
    return shot


@cache
def _film() -> Film:
    params = np.random.default_rng(0).normal(0.0, 1.0, Problem(ONE).parameter_count)
    return film(ONE, tuple(params), moments=[0, 4])


def _green(image: Image) -> float:
    """Share of the picture in the objects' colour, lit from bright to dark."""
    pixels = image[..., :3].astype(float)
    shade = pixels / np.maximum(pixels.sum(axis=-1, keepdims=True), 1.0)
    wanted = np.array(OBJECT) / sum(OBJECT)
    return float((np.abs(shade - wanted).max(axis=-1) < 0.03).mean())


def test_particles_are_shared_out_by_body() -> None:
    """The robot's first, then every object's by its name, and the medium's."""
    scene = Problem(SPEC).scene
    places = np.arange(2 * scene.particle_count * 3, dtype=np.float32).reshape(2, scene.particle_count, 3)
    found = BodyPlaces.of(scene, places)
    assert list(found.objects) == NAMES
    parts = [found.robot, *found.objects.values(), found.medium]
    np.testing.assert_array_equal(np.concatenate(parts, axis=1), places)
    assert found.robot.shape[1] == scene.robot.particle_count
    assert found.medium.shape[1] == 0


def test_a_recording_has_its_objects_apart() -> None:
    """No bed on bare ground, and the region reaches round all of them."""
    shot = _shot()
    assert shot.medium.shape[1] == 0
    assert [places.shape[1] for places in shot.objects.values()] == [64]
    region = region_of(shot)
    furthest = max(float(places[..., 0].max()) for places in shot.objects.values())
    assert region.high[0] > furthest > float(shot.robot[..., 0].max())


def test_a_skin_encloses_its_object() -> None:
    """Of a box of four particles to an edge its corners, to a particle's edge."""
    thing = Problem(SPEC).scene.objects[0]
    cover = object_skin(thing, 1 / 64)
    vertices = cover.places @ thing.body.positions
    np.testing.assert_allclose(np.ptp(vertices, axis=0), np.full(3, 0.0625), atol=1 / 64)


def test_a_still_shows_the_objects() -> None:
    """In their own colour, which nothing else has."""
    needs_drawing()
    shot = _shot()
    bare = replace(shot, objects={}, scene=replace(shot.scene, objects=()))
    assert _green(snapshot_image(shot, (480, 270))) > 0.01
    assert _green(snapshot_image(bare, (480, 270))) < 0.001


def test_a_film_has_the_objects_at_every_moment(tmp_path: Path) -> None:
    """As the motion of the episode, and as arrays in a file."""
    shown = _film()
    assert [(name, places.shape) for name, places in shown.objects.items()] == [("object", (2, 64, 3))]
    assert shown.medium.shape[1] == 0
    path = tmp_path / "film.npz"
    write(shown, Destination(path, FilmFormat.NPZ), title="a title")
    with np.load(path) as arrays:
        np.testing.assert_array_equal(arrays["object"], shown.objects["object"])


def test_a_series_of_files_has_the_objects(tmp_path: Path) -> None:
    """A body of its own at every moment, behind the robot and without activation."""
    pyvista = pytest.importorskip("pyvista")
    shown, path = _film(), tmp_path / "film.pvd"
    write(shown, Destination(path, FilmFormat.VTK), title="a title")
    index = pyvista.get_reader(path)
    for moment in range(len(shown.times)):
        index.set_active_time_point(moment)
        (cloud,) = index.read()
        thing = cloud["body"] == 1
        np.testing.assert_allclose(cloud.points[thing], shown.objects["object"][moment], atol=1e-6)
        assert not cloud["is_robot"][thing].any()
        assert not cloud["activation"][thing].any()


def test_a_live_view_shows_the_objects_where_they_are() -> None:
    """They move with what is told of the present, in the picture, too."""
    problem = Problem(SPEC)
    start, still = problem.scene.elastic.positions, np.zeros(problem.body.muscle_count)
    positions, own = start.copy(), problem.scene.slice_of("object-1")
    positions[own] += [0.0, 0.0, 0.1]
    world = LiveWorld(problem, start, problem.task)
    world.take(Present(0.008, positions, still))
    for name, places in world.recording.objects.items():
        np.testing.assert_allclose(places[0], positions[problem.scene.slice_of(name)], atol=1e-6)
    needs_drawing()
    picture = LivePicture(problem, start, problem.task)
    images = [picture.at(Present(0.008, places, still)) for places in (start, positions)]
    picture.close()
    assert all(_green(image) > 0.005 for image in images)
    assert (images[0] != images[1]).any(axis=2).mean() > 0.005
