"""Mesh files that are cut off, or that count their corners backwards."""

from pathlib import Path

import numpy as np
import pytest

from zoobench.designs.mesh_file import load
from zoobench.errors import UsageError

trimesh = pytest.importorskip("trimesh")
BOX = trimesh.creation.box(bounds=((0.0, 0.0, 0.0), (40.0, 50.0, 50.0)))


def text(mesh: "trimesh.Trimesh") -> bytes:
    """The mesh as an STL file in ASCII."""
    return bytes(trimesh.exchange.stl.export_stl_ascii(mesh).encode())


@pytest.mark.parametrize(
    ("content", "fault"),
    [
        (BOX.export(file_type="stl")[:-70], "promises 12 triangles in 684 bytes, and it has 614"),
        (BOX.export(file_type="stl") + b"trailing", "promises 12 triangles in 684 bytes, and it has 692"),
        (BOX.export(file_type="stl")[:40], "has 40 bytes, and its header alone takes 84"),
        (text(BOX)[: text(BOX).rindex(b"endsolid")], "last line is no endsolid"),
        (text(BOX)[: len(text(BOX)) // 2], "ends within a triangle, its number 7"),
    ],
)
def test_an_stl_file_that_is_not_whole_is_refused(content: bytes, fault: str, tmp_path: Path) -> None:
    """With the reason: binary ones that are too short or too long, text that breaks off."""
    (tmp_path / "a.stl").write_bytes(content)
    with pytest.raises(UsageError, match=fault):
        load(str(tmp_path / "a.stl"))


@pytest.mark.parametrize("name", ["solid box", "", "Solid"])
def test_a_whole_stl_file_in_ascii_is_read(name: str, tmp_path: Path) -> None:
    """Whatever the case of its words and with or without a name."""
    (tmp_path / "a.stl").write_bytes(text(BOX).replace(b"solid \n", b"solid " + name.encode() + b"\n", 1))
    assert load(str(tmp_path / "a.stl")).mesh.volume() == pytest.approx(BOX.volume)


def test_a_binary_file_may_begin_with_the_word_solid(tmp_path: Path) -> None:
    """As some CAD tools write it into the header."""
    content = b"solid part".ljust(80) + BOX.export(file_type="stl")[80:]
    (tmp_path / "a.stl").write_bytes(content)
    assert load(str(tmp_path / "a.stl")).mesh.volume() == pytest.approx(BOX.volume)


def obj(*, negative: bool) -> str:
    """Two boxes 20 mm apart, each with its corners before its faces."""
    lines: list[str] = []
    for number, shift in enumerate((0.0, 60.0)):
        lines += [f"v {x + shift} {y} {z}" for x, y, z in BOX.vertices]
        first = -8 if negative else 8 * number + 1
        lines += ["f " + " ".join(f"{first + corner}" for corner in face) for face in BOX.faces.tolist()]
    return "\n".join(lines) + "\n"


def test_corners_may_be_counted_backwards(tmp_path: Path) -> None:
    """Negative numbers count from the line on which they stand: both bodies are there."""
    found = []
    for negative in (False, True):
        (tmp_path / "a.obj").write_text(obj(negative=negative))
        found.append(load(str(tmp_path / "a.obj")).mesh)
    assert found[1].volume() == pytest.approx(2 * BOX.volume)
    np.testing.assert_array_equal(np.ptp(found[0].vertices, axis=0), np.ptp(found[1].vertices, axis=0))


@pytest.mark.parametrize("face", ["f -1 -2 -99", "f 0 -1 -2", "f -1 -2 x"])
def test_a_corner_that_is_not_there_is_refused(face: str, tmp_path: Path) -> None:
    """With the line."""
    (tmp_path / "a.obj").write_text(obj(negative=True) + face + "\n")
    with pytest.raises(UsageError, match=r"Line 41 of 'a\.obj' names a corner that is not there"):
        load(str(tmp_path / "a.obj"))


@pytest.mark.parametrize("place", ["nan 0 0", "0 -inf 0"])
def test_a_corner_without_a_place_is_refused(place: str, tmp_path: Path) -> None:
    """Its faces would be left out, and the rest be an open mesh of nothing."""
    corners = [f"v {place}", "v 1 0 0", "v 0 1 0", "v 0 0 1"]
    path = tmp_path / "odd.obj"
    path.write_text("\n".join([*corners, "f 1 3 2", "f 1 2 4", "f 1 4 3", "f 2 3 4", ""]))
    with pytest.raises(UsageError, match="not finite"):
        load(str(path))


def test_stray_corners_of_no_triangle_do_not_count(tmp_path: Path) -> None:
    """Of the size, where one at 400 mm had stretched the body."""
    (tmp_path / "a.obj").write_text("v 400 0 0\n" + obj(negative=True))
    assert np.ptp(load(str(tmp_path / "a.obj")).mesh.vertices, axis=0) == pytest.approx([100.0, 50.0, 50.0])
