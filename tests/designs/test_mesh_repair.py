"""Repair of meshes."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.designs.meshes import fish
from zoobench.designs.solid_mesh import Mesh, load
from zoobench.errors import UsageError

trimesh = pytest.importorskip("trimesh")


def sphere() -> Any:
    """Of radius 50."""
    return trimesh.creation.icosphere(subdivisions=3, radius=50.0)


def loaded(mesh: Any, path: Path) -> Mesh:
    """The mesh of a file of it."""
    mesh.export(path)
    return load(str(path))


def test_inward_normals_are_turned_without_a_word(tmp_path: Path) -> None:
    """The volume is positive."""
    mesh = sphere()
    mesh.invert()
    found = loaded(mesh, tmp_path / "a.stl")
    assert (found.volume(), found.repairs) == (pytest.approx(sphere().volume), ())


def test_a_small_hole_is_closed_with_a_word(tmp_path: Path) -> None:
    """A missing triangle."""
    mesh = sphere()
    mesh.update_faces(np.arange(len(mesh.faces)) > 0)
    found = loaded(mesh, tmp_path / "a.stl")
    assert found.volume() == pytest.approx(sphere().volume, rel=1e-3)
    assert "a hole with 3 edges" in found.repairs[0]


def test_a_large_hole_is_closed_flat(tmp_path: Path) -> None:
    """Half a sphere becomes half a ball; open ends of a fish are closed, too."""
    half = sphere()
    half.update_faces(half.triangles_center[:, 2] < 0.0)
    found = loaded(half, tmp_path / "a.ply")
    assert found.volume() == pytest.approx(sphere().volume / 2, rel=0.08)
    assert "up to 100 %" in found.repairs[0]
    whole, opened = loaded(fish(), tmp_path / "b.stl"), loaded(fish(open_ends=True), tmp_path / "c.stl")
    assert opened.volume() == pytest.approx(whole.volume(), rel=1e-6)
    assert "2 holes with 48 edges" in opened.repairs[0]


def test_what_cannot_be_closed_is_filled_with_voxels(tmp_path: Path) -> None:
    """A ball with an inner wall, whose rim has three faces at each edge; outside it is as before."""
    pytest.importorskip("skimage")
    mesh = trimesh.creation.cylinder(radius=30.0, height=80.0, sections=24)
    rim = np.flatnonzero(np.isclose(mesh.vertices[:, 2], 40.0) & (np.hypot(*mesh.vertices[:, :2].T) > 1.0))
    centre = len(mesh.vertices)
    order = rim[np.argsort(np.arctan2(*mesh.vertices[rim, :2].T))]
    wall = [(centre, first, second) for first, second in zip(order, np.roll(order, -1), strict=True)]
    walled = trimesh.Trimesh(np.vstack([mesh.vertices, [(0.0, 0.0, 10.0)]]), np.vstack([mesh.faces, wall]))
    found = loaded(walled, tmp_path / "a.ply")
    assert found.volume() == pytest.approx(mesh.volume, rel=0.1)
    assert "filled with voxels" in found.repairs[0]
    points = np.random.default_rng(0).uniform(-50.0, 50.0, size=(2000, 3))
    inside = (np.hypot(points[:, 0], points[:, 1]) < 30.0) & (abs(points[:, 2]) < 40.0)
    assert (found.inside(points) != inside).mean() < 0.03


def test_solids_that_touch_in_an_edge_are_closed(tmp_path: Path) -> None:
    """Two boxes with a common edge of four faces need no repair."""
    boxes = [trimesh.creation.box(bounds=[(n, n, 0), (n + 1, n + 1, 1)]) for n in range(2)]
    found = loaded(trimesh.util.concatenate(boxes), tmp_path / "a.stl")
    assert found.volume() == pytest.approx(2.0)
    assert found.repairs == ()


@pytest.mark.parametrize("place", [(1e-12, 0.0), (1.0, 1e12)])
def test_corners_that_cannot_be_told_apart_are_refused(place: tuple[float, float], tmp_path: Path) -> None:
    """A body far from the origin, or of no size, in the unit of the file."""
    scale, shift = place
    mesh = sphere()
    mesh.vertices = scale * mesh.vertices + shift
    with pytest.raises(UsageError, match="another unit, near the origin"):
        loaded(mesh, tmp_path / "a.obj")


@pytest.mark.parametrize("kind", ["triangle", "fan", "square"])
def test_what_encloses_nothing_is_refused(kind: str, tmp_path: Path) -> None:
    """One triangle, three on one edge, a flat square."""
    corners, faces = {
        "triangle": ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]),
        "fan": ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], [[0, 1, 2], [0, 1, 3], [0, 1, 4]]),
        "square": ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]]),
    }[kind]
    with pytest.raises(UsageError, match="encloses no volume"):
        loaded(trimesh.Trimesh(corners, faces), tmp_path / "a.ply")
