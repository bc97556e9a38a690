"""Repair of meshes."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.designs.meshes import fish
from zoobench.designs.mesh_file import FileMesh, load
from zoobench.errors import UsageError

trimesh = pytest.importorskip("trimesh")


def sphere() -> Any:
    """Of radius 50."""
    return trimesh.creation.icosphere(subdivisions=3, radius=50.0)


def loaded(mesh: Any, path: Path) -> FileMesh:
    """The mesh of a file of it."""
    mesh.export(path)
    return load(str(path))


def test_inward_normals_are_turned_without_a_word(tmp_path: Path) -> None:
    """The volume is positive."""
    mesh = sphere()
    mesh.invert()
    found = loaded(mesh, tmp_path / "a.stl")
    assert (found.mesh.volume(), found.notes) == (pytest.approx(sphere().volume), ())


def test_a_small_hole_is_closed_with_a_word(tmp_path: Path) -> None:
    """A missing triangle."""
    mesh = sphere()
    mesh.update_faces(np.arange(len(mesh.faces)) > 0)
    found = loaded(mesh, tmp_path / "a.stl")
    assert found.mesh.volume() == pytest.approx(sphere().volume, rel=1e-3)
    assert "a hole with 3 edges" in found.notes[0]


def test_a_large_hole_is_closed_flat(tmp_path: Path) -> None:
    """Half a sphere becomes half a ball; open ends of a fish are closed, too."""
    half = sphere()
    half.update_faces(half.triangles_center[:, 2] < 0.0)
    found = loaded(half, tmp_path / "a.ply")
    assert found.mesh.volume() == pytest.approx(sphere().volume / 2, rel=0.08)
    assert "up to 100 %" in found.notes[0]
    whole, opened = loaded(fish(), tmp_path / "b.stl"), loaded(fish(open_ends=True), tmp_path / "c.stl")
    assert opened.mesh.volume() == pytest.approx(whole.mesh.volume(), rel=1e-6)
    assert "2 holes with 48 edges" in opened.notes[0]


def walled() -> tuple[Any, Any]:
    """A cylinder, and the same with a wall inside, whose rim has three faces at each edge."""
    mesh = trimesh.creation.cylinder(radius=30.0, height=80.0, sections=24)
    rim = np.flatnonzero(np.isclose(mesh.vertices[:, 2], 40.0) & (np.hypot(*mesh.vertices[:, :2].T) > 1.0))
    centre = len(mesh.vertices)
    order = rim[np.argsort(np.arctan2(*mesh.vertices[rim, :2].T))]
    wall = [(centre, first, second) for first, second in zip(order, np.roll(order, -1), strict=True)]
    return mesh, trimesh.Trimesh(np.vstack([mesh.vertices, [(0.0, 0.0, 10.0)]]), np.vstack([mesh.faces, wall]))


def test_a_wall_inside_does_not_open_a_surface(tmp_path: Path) -> None:
    """The fan that closes the wall's rim has the volume of a cone, which is counted once."""
    mesh, inner = walled()
    assert loaded(inner, tmp_path / "a.ply").mesh.volume() == pytest.approx(mesh.volume, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("gap", [0.05, 0.5])
def test_patches_that_do_not_meet_are_filled_with_voxels(gap: float, tmp_path: Path) -> None:
    """The six sides of a box of 100 x 50 x 50, each for itself and a little apart: the volume is right within 2 %."""
    pytest.importorskip("skimage")
    box = trimesh.creation.box(extents=(100.0, 50.0, 50.0)).subdivide()
    sides = [
        box.submesh([np.flatnonzero(box.face_normals @ normal > 0.9)])[0]
        for normal in np.vstack([np.eye(3), -np.eye(3)])
    ]
    for side, normal in zip(sides, np.vstack([np.eye(3), -np.eye(3)]), strict=True):
        side.apply_translation(gap / 2 * normal)
    found = loaded(trimesh.util.concatenate(sides), tmp_path / "a.ply")
    assert found.mesh.volume() == pytest.approx(box.volume, rel=0.02)
    assert "filled with voxels" in found.notes[0]
    points = np.random.default_rng(0).uniform(-60.0, 60.0, size=(2000, 3))
    inside = (np.abs(points) < (50.0, 25.0, 25.0)).all(axis=1)
    assert (found.mesh.inside(points) != inside).mean() < 0.01


def test_solids_that_touch_in_an_edge_are_closed(tmp_path: Path) -> None:
    """Two boxes with a common edge of four faces need no repair."""
    boxes = [trimesh.creation.box(bounds=[(n, n, 0), (n + 1, n + 1, 1)]) for n in range(2)]
    found = loaded(trimesh.util.concatenate(boxes), tmp_path / "a.stl")
    assert found.mesh.volume() == pytest.approx(2.0)
    assert found.notes == ()


@pytest.mark.parametrize("place", [(1e-12, 0.0), (1.0, 1e12)])
def test_corners_that_cannot_be_told_apart_are_refused(place: tuple[float, float], tmp_path: Path) -> None:
    """A body far from the origin, or of no size, in the unit of the file."""
    scale, shift = place
    mesh = sphere()
    mesh.vertices = scale * mesh.vertices + shift
    with pytest.raises(UsageError, match="another unit, near the origin"):
        loaded(mesh, tmp_path / "a.obj")


@pytest.mark.parametrize("kind", ["triangle", pytest.param("fan", marks=pytest.mark.slow), "square"])
def test_what_encloses_nothing_is_refused(kind: str, tmp_path: Path) -> None:
    """One triangle, three on one edge, a flat square."""
    corners, faces = {
        "triangle": ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]),
        "fan": ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], [[0, 1, 2], [0, 1, 3], [0, 1, 4]]),
        "square": ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]]),
    }[kind]
    with pytest.raises(UsageError, match="encloses no volume"):
        loaded(trimesh.Trimesh(corners, faces), tmp_path / "a.ply")


@pytest.mark.slow
def test_a_heap_of_triangles_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Triangles at random enclose cells between them, but most have nothing behind them."""
    pytest.importorskip("skimage")
    monkeypatch.setattr("zoobench.designs.voxel_fill._VOXELS", 50)  # half as many along each edge, for speed
    corners = np.random.default_rng(0).uniform(0.0, 100.0, size=(300, 3))
    with pytest.raises(UsageError, match="encloses no volume"):
        loaded(trimesh.Trimesh(corners, np.arange(300).reshape(-1, 3)), tmp_path / "a.ply")


BOX = ((0.0, 0.0, 0.0), (100.0, 50.0, 50.0))  # 250 ml, in mm


def boxes(*bounds: Any) -> Any:
    """Boxes from their corners [mm], all with normals outwards, in one mesh."""
    return trimesh.util.concatenate([trimesh.creation.box(bounds=each) for each in bounds])


def trunk_with_legs() -> Any:
    """A trunk of 120 ml with four legs of 5 ml each, pushed into it by two fifths."""
    legs = [((x, y, 0.0), (x + 10.0, y + 10.0, 50.0)) for x in (10.0, 80.0) for y in (0.5, 29.5)]
    return boxes(((0.0, 0.0, 30.0), (100.0, 40.0, 60.0)), *legs)


@pytest.mark.parametrize(
    ("make", "volume", "said"),
    [
        (lambda: boxes(((0, 0, 0), (65, 50, 50)), ((35, 0, 0), (100, 50, 50))), 250.0, "30 %"),
        (trunk_with_legs, 132.0, "6.1 %"),
        (lambda: boxes(BOX, ((20, 10, 10), (56, 40, 50))), 250.0, "17 %"),
        (lambda: boxes(BOX, BOX, BOX), 250.0, "200 %"),
        (lambda: boxes(((0, 0, 0), (100, 100, 100)), ((0, 0, 0), (55, 55, 55))), 1000.0, "17 %"),
    ],
)
def test_what_parts_share_counts_once(make: Any, volume: float, said: str, tmp_path: Path) -> None:
    """Overlapping, pushed in, inlaid, and in a corner: volumes in ml by hand."""
    found = loaded(make(), tmp_path / "a.obj")
    assert found.mesh.volume() / 1000.0 == pytest.approx(volume, rel=5e-4)
    assert found.notes == (f"{said} of the volume is enclosed by several parts at once: it counts once.",)


@pytest.mark.parametrize("turned", [(), (0,), (1,), (0, 1)])
def test_each_part_is_turned_outwards(turned: tuple[int, ...], tmp_path: Path) -> None:
    """Two separate boxes of 75 and 50 ml, whichever of them is inside out."""
    parts = [trimesh.creation.box(bounds=each) for each in (((0, 0, 0), (50, 30, 50)), ((60, 0, 0), (100, 25, 50)))]
    for part in turned:
        parts[part].invert()
    assert loaded(trimesh.util.concatenate(parts), tmp_path / "a.stl").mesh.volume() == pytest.approx(125_000.0)


@pytest.mark.parametrize("inside_out", [False, True])
def test_a_part_turned_inwards_is_a_cavity(inside_out: bool, tmp_path: Path) -> None:
    """A hollow box of 250 - 36 ml with a solid one of 1 ml in the hollow, also if all normals are the wrong way."""
    shell, hollow, core = (
        trimesh.creation.box(bounds=each) for each in (BOX, ((20, 10, 10), (60, 40, 40)), ((30, 20, 20), (40, 30, 30)))
    )
    hollow.invert()
    mesh = trimesh.util.concatenate([shell, hollow, core])
    if inside_out:
        mesh.invert()
    found = loaded(mesh, tmp_path / "a.stl")
    assert found.mesh.volume() / 1000.0 == pytest.approx(250.0 - 36.0 + 1.0, rel=5e-4)
    assert found.notes[0] == "A part lies within another and is turned inwards: a cavity."


def test_a_vertex_within_an_edge_is_no_hole(tmp_path: Path) -> None:
    """A box whose one side has a corner on an edge of the next: 250 ml, exactly."""
    box = trimesh.creation.box(bounds=BOX)
    corners, faces = np.vstack([box.vertices, [(50.0, 0.0, 0.0)]]), box.faces.tolist()
    split = next(n for n, face in enumerate(faces) if sum(np.allclose(box.vertices[c, 1:], 0) for c in face) == 2)
    a, b, c = faces.pop(split)
    while not (np.allclose(corners[a, 1:], 0.0) and np.allclose(corners[b, 1:], 0.0)):
        a, b, c = b, c, a
    found = loaded(trimesh.Trimesh(corners, [*faces, (a, 8, c), (8, b, c)], process=False), tmp_path / "a.ply")
    assert found.mesh.volume() == pytest.approx(250_000.0)


def test_many_holes_and_edges_of_three_faces_are_closed(tmp_path: Path) -> None:
    """A sphere with 70 holes and a fin of a single layer along its equator."""
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=50.0)
    centres = mesh.triangles_center
    poles = np.abs(centres[:, 2]) > 10.0
    mesh.update_faces(~(poles & (np.arange(len(centres)) % 71 == 0)))
    found = loaded(mesh, tmp_path / "a.stl")
    assert found.mesh.volume() == pytest.approx(sphere().volume, rel=0.02)
    assert "holes" in found.notes[0]


def test_a_crumb_is_left_out_with_a_word(tmp_path: Path) -> None:
    """One of 1 mm, 0.25 m from a box of 100 mm, which was shrunk to a third by it."""
    found = loaded(boxes(BOX, ((350, 25, 25), (351, 26, 26))), tmp_path / "a.stl")
    assert np.ptp(found.mesh.vertices, axis=0) == pytest.approx([100.0, 50.0, 50.0])
    assert found.notes == ("A piece that touches nothing, 0.0004 % of the volume, was left out.",)


def test_pieces_that_are_much_of_a_body_stay(tmp_path: Path) -> None:
    """A box of 2 % beside another."""
    found = loaded(boxes(BOX, ((120, 0, 0), (140, 10, 25))), tmp_path / "a.stl")
    assert found.mesh.volume() == pytest.approx(255_000.0)


def test_a_double_sided_surface_is_a_solid(tmp_path: Path) -> None:
    """Every triangle in both directions, as some programs draw them."""
    mesh = trimesh.creation.box(bounds=BOX)
    both = trimesh.Trimesh(mesh.vertices, np.vstack([mesh.faces, mesh.faces[:, ::-1]]), process=False)
    assert loaded(both, tmp_path / "a.ply").mesh.volume() == pytest.approx(250_000.0)
