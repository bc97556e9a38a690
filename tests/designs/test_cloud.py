"""Bodies from point clouds: exported files, and refusals."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from zoobench import registry
from zoobench.designs.base import Body
from zoobench.designs.cloud import CloudDesign
from zoobench.designs.export import export
from zoobench.errors import UsageError
from zoobench.inputs import InputFile
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.spec import Ref

PAPER = Fidelity(1 / 128)


def columns(**changed: Any) -> dict[str, Any]:
    """A block of 5 x 4 x 4 points 8 mm apart, its front half a muscle, with changes."""
    positions = 0.008 * np.indices((5, 4, 4)).reshape(3, -1).T
    muscle = np.where(positions[:, 0] > 0.01, 0, -1)
    return {"positions": positions, "muscle": muscle, "fibres": np.tile([0.0, 2.0, 0.0], (80, 1)), **changed}


def cloud(path: Path, **changed: Any) -> CloudDesign:
    """The design from an NPZ file."""
    np.savez(path, **columns(**changed))
    return CloudDesign(path=InputFile(path))


@pytest.mark.parametrize(
    ("name", "library"),
    [
        ("a.ply", "trimesh"),
        pytest.param("a.pcd", "pypcd4", marks=pytest.mark.slow),
        pytest.param("a.npz", "numpy", marks=pytest.mark.slow),
    ],
)
def test_an_exported_animal_comes_back(name: str, library: str, tmp_path: Path) -> None:
    """At the same fidelity: cubes, fibres, stiffness, mass, names, and the muscle of the largest share."""
    pytest.importorskip(library)
    panda = registry.create(Kind.DESIGN, Ref("panda")).body(PAPER)
    export(panda, tmp_path / name)
    again = registry.create(Kind.DESIGN, Ref("cloud", params=(("path", str(tmp_path / name)),))).body(PAPER)
    assert isinstance(again, Body)
    shift = again.sites.mean(axis=0) - panda.sites.mean(axis=0)
    assert again.particle_count == panda.particle_count
    np.testing.assert_allclose(again.sites - shift, panda.sites, atol=1e-6)
    np.testing.assert_allclose(again.fibres, panda.fibres, atol=1e-6)
    np.testing.assert_allclose(again.stiffness, panda.stiffness, rtol=1e-6)
    assert again.masses(1000.0).sum() == pytest.approx(panda.masses(1000.0).sum(), rel=1e-3)
    assert again.muscles == panda.muscles
    if name == "a.npz":  # the other two have one muscle for each particle
        np.testing.assert_allclose(again.muscle_membership, panda.muscle_membership, atol=1e-6)
        return
    active = panda.muscle_membership.sum(axis=1) > 0.5
    np.testing.assert_array_equal(again.muscle_membership.sum(axis=1) > 0, active)
    np.testing.assert_array_equal(
        again.muscle_membership[active].argmax(axis=1), panda.muscle_membership[active].argmax(axis=1)
    )


def test_cubes_have_their_volume_and_stand_on_the_ground(tmp_path: Path) -> None:
    """80 cubes of 8 mm; fibres are normalised; passive points have no muscle."""
    body = cloud(tmp_path / "a.npz").body(Fidelity(1 / 250))
    assert body.volumes.sum() == pytest.approx(80 * 0.008**3, rel=0.02)
    assert body.positions[:, 1].min() == pytest.approx(0.001)
    assert body.fibres[:, 1] == pytest.approx(1.0)
    assert body.muscles == ("muscle-1",)
    assert body.muscle_membership.sum() / body.particle_count == pytest.approx(3 / 5)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"fibres": np.zeros((3, 3))}, "fibres"),
        ({"positions": np.full((80, 3), np.nan)}, "positions"),
        ({"positions": columns()["positions"].repeat(3, axis=0)[:80]}, "lie on each other"),
        ({"positions": columns()["positions"] * (1, 0, 0)}, "lie on each other"),
        ({name: column[:1] for name, column in columns().items()}, "two at least"),
        ({"muscle": np.full(80, 2)}, "numbered"),
        ({"muscle": np.arange(80) * 10**16}, "numbered"),
        ({"muscle": np.full(80, 0.5)}, "not whole"),
        ({"muscle": np.full(80, np.nan)}, "not whole"),
        ({"muscle": np.full(80, -1)}, "no muscle"),
        ({"stiffness": np.zeros(80)}, "positive"),
        ({"positions": 1000.0 * columns()["positions"]}, "unit"),
    ],
)
def test_columns_without_sense_are_refused(changed: dict[str, Any], message: str, tmp_path: Path) -> None:
    """The message names the column."""
    with pytest.raises(UsageError, match=message):
        cloud(tmp_path / "a.npz", **changed)


@pytest.mark.parametrize("name", ["a.npz", "a.ply", "a.pcd", "a.txt"])
def test_what_is_no_cloud_is_refused(name: str, tmp_path: Path) -> None:
    """Other contents and suffixes, without a traceback."""
    pytest.importorskip("trimesh")
    pytest.importorskip("pypcd4")
    (tmp_path / name).write_bytes(b"nothing")
    with pytest.raises(UsageError, match=r"no point cloud|\.ply, \.pcd or \.npz"):
        CloudDesign(path=InputFile(tmp_path / name))


def pcd(path: Path, encoding: str, **changed: Any) -> InputFile:
    """`columns` in a file of another library, all of one type, without columns that are None."""
    pypcd4 = pytest.importorskip("pypcd4")
    given = columns(**changed)
    vectors = {"xyz": given.pop("positions"), "f": given.pop("fibres")}
    table = {name: vectors["xyz"][:, number] for number, name in enumerate("xyz")}
    table |= {f"f{name}": vectors["f"][:, number] for number, name in enumerate("xyz")} | given
    table = {name: values for name, values in table.items() if values is not None}
    points = pypcd4.PointCloud.from_points(list(table.values()), list(table), [np.float64] * len(table))
    points.save(path, pypcd4.Encoding(encoding))
    return InputFile(path)


@pytest.mark.parametrize(
    "encoding", ["ascii", *(pytest.param(name, marks=pytest.mark.slow) for name in ("binary", "binary_compressed"))]
)
def test_a_pcd_file_is_the_same_body_in_each_encoding(encoding: str, tmp_path: Path) -> None:
    """As the same columns in an NPZ file."""
    expected = cloud(tmp_path / "a.npz").body(PAPER)
    found = CloudDesign(path=pcd(tmp_path / "a.pcd", encoding)).body(PAPER)
    np.testing.assert_allclose(found.positions, expected.positions, atol=1e-12)
    np.testing.assert_array_equal(found.muscle_membership, expected.muscle_membership)
    np.testing.assert_allclose(found.fibres, expected.fibres)


@pytest.mark.parametrize("encoding", ["ascii", "binary", "binary_compressed"])
@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"muscle": None}, "muscle"),
        ({"positions": np.zeros((0, 3)), "fibres": np.zeros((0, 3)), "muscle": np.zeros(0)}, "positions"),
        ({"positions": 1000.0 * columns()["positions"]}, "unit"),
        ({"fibres": np.full((80, 3), np.nan)}, "fibres"),
        ({"muscle": np.full(80, 0.5)}, "not whole"),
    ],
)
def test_pcd_columns_without_sense_are_refused(
    encoding: str, changed: dict[str, Any], message: str, tmp_path: Path
) -> None:
    """A missing column, NaN, another unit, a fractional muscle: the message names it."""
    with pytest.raises(UsageError, match=message):
        CloudDesign(path=pcd(tmp_path / "a.pcd", encoding, **changed))


@pytest.mark.parametrize("encoding", ["ascii", "binary", "binary_compressed"])
def test_a_pcd_file_that_was_cut_off_is_refused(encoding: str, tmp_path: Path) -> None:
    """Between two points, within one, or after its header."""
    content = Path(pcd(tmp_path / "a.pcd", encoding)).read_bytes()
    header, data = content.index(encoding.encode()) + len(encoding) + 1, 7 * 8 * 80
    scale = (len(content) - header) / data
    for kept in (7 * 8 * 40, 7 * 8 * 40 + 3, 0):
        (tmp_path / "b.pcd").write_bytes(content[: header + int(kept * scale)])
        with pytest.raises(UsageError, match="no point cloud"):
            CloudDesign(path=InputFile(tmp_path / "b.pcd"))


def test_without_its_library_a_pcd_file_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The message names the extra to install."""
    (tmp_path / "a.pcd").write_bytes(b"VERSION 0.7")
    monkeypatch.setitem(sys.modules, "pypcd4", None)
    with pytest.raises(UsageError, match=r"zoobench\[meshes\]"):
        CloudDesign(path=InputFile(tmp_path / "a.pcd"))


def painted(path: Path, *, packed: bool = True, scattered: bool = False) -> CloudDesign:
    """A body of 90 x 30 x 30 in any unit with a red and a green half, a black core and a pair of blue legs.

    As Open3D writes annotated bodies: with colours packed into a float, of points on a lattice or at random.
    """
    pypcd4 = pytest.importorskip("pypcd4")
    rng = np.random.default_rng(0)
    lattice = 3.0 * (np.indices((30, 20, 10)).reshape(3, -1).T + 0.5)
    points = rng.uniform((0, 0, 0), (90, 60, 30), size=(30000, 3)) if scattered else lattice
    x, y, z = points.T
    is_leg = y < 30.0
    kept = ~is_leg | ((x > 60.0) & (np.abs(z - 15.0) > 5.0))
    colour = np.where(is_leg, 255, np.where(x > 45.0, 255 << 16, 255 << 8))
    colour = np.where(~is_leg & (y < 36.0), 0, colour)[kept].astype(np.uint32)
    values, kinds = (colour.view(np.float32), np.float32) if packed else (colour, np.uint32)
    columns = [*points[kept].T.astype(np.float32), values]
    cloud = pypcd4.PointCloud.from_points(columns, ["x", "y", "z", "rgb"], [np.float32] * 3 + [kinds])
    cloud.save(path, pypcd4.Encoding("binary"))
    return CloudDesign(path=InputFile(path), length=0.09)


@pytest.mark.parametrize(("packed", "scattered"), [(True, False), pytest.param(False, True, marks=pytest.mark.slow)])
def test_the_colours_of_an_annotated_cloud_are_muscles(packed: bool, scattered: bool, tmp_path: Path) -> None:
    """In the order of red, green, blue; black is passive; fibres run along each part, in one leg of a pair."""
    body = painted(tmp_path / "a.pcd", packed=packed, scattered=scattered).body(PAPER)
    assert body.muscles == ("muscle-1", "muscle-2", "muscle-3")
    blue, green, red = (body.muscle_membership[:, number] > 0.5 for number in range(3))
    assert body.positions[blue, 1].max() < body.positions[green, 1].min()
    assert body.positions[green, 0].max() < body.positions[red, 0].min()
    passive = body.muscle_membership.sum(axis=1) == 0.0
    assert passive.mean() == pytest.approx(0.2 * 0.5 / (0.5 + 0.5 / 3 * 2 / 3), abs=0.06)
    assert np.abs(body.fibres[red][:, 0]).min() > 0.9
    assert np.abs(body.fibres[blue]).max(axis=0).argmax() != 2
    assert np.ptp(body.positions[:, 0]) + 1 / 256 == pytest.approx(0.09, abs=1 / 128)
    assert body.volumes.sum() == pytest.approx(0.09 * 0.06 * 0.03 * (0.5 + 0.5 / 3 * 2 / 3), rel=0.1)
    assert body.head.any()
    assert body.tail.any()
    assert any("3 colours" in note and "black and passive" in note for note in body.notes)


@pytest.mark.slow
def test_a_cloud_without_muscles_gets_pairs_with_a_word(tmp_path: Path) -> None:
    """Positions alone; `grouping` replaces the file's muscles, too."""
    np.savez(tmp_path / "a.npz", positions=columns()["positions"])
    body = CloudDesign(path=InputFile(tmp_path / "a.npz"), muscles=8).body(PAPER)
    assert body.muscles[-1] == "row-2-right-top"
    assert "no muscles" in body.notes[-1]
    regrouped = CloudDesign(path=InputFile(tmp_path / "a.npz"), muscles=3, grouping="axis").body(PAPER)
    assert (len(regrouped.muscles), len(regrouped.notes)) == (3, 2)


def test_a_picture_is_no_annotation(tmp_path: Path) -> None:
    """A colour of its own for every point, or black alone."""
    for colours in (np.arange(80) + 1, np.zeros(80, int)):
        with pytest.raises(UsageError, match="colours other than black"):
            _paint(tmp_path / "a.pcd", colours)


def block(steps: tuple[float, float, float], counts: tuple[int, int, int]) -> Any:
    """Points of a lattice [mm]."""
    return np.indices(counts).reshape(3, -1).T * steps


def loaded(path: Path, positions: Any, **params: Any) -> CloudDesign:
    """The design from the places of points [mm] alone."""
    np.savez(path, positions=positions)
    return CloudDesign(path=InputFile(path), **({"unit": "mm"} | params))


def mass(made: CloudDesign) -> float:
    """Of the body at 1/128 m [g]."""
    return float(1000.0 * made.body(PAPER).masses(1000.0).sum())


@pytest.mark.slow
@pytest.mark.parametrize("steps", [(10.0, 5.0, 5.0), (5.0, 5.0, 10.0), (4.0, 5.0, 6.0)])
def test_a_lattice_has_an_edge_along_each_axis(steps: tuple[float, float, float], tmp_path: Path) -> None:
    """Each of 11 x 11 x 11 points stands for a box with the steps as edges."""
    made = loaded(tmp_path / "a.npz", block(steps, (11, 11, 11)))
    assert mass(made) == pytest.approx(1331 * np.prod(steps) / 1000.0)
    assert made.body(PAPER).size == pytest.approx(np.array(steps) * 11 / 1000.0, abs=2e-3)


@pytest.mark.slow
def test_a_face_centred_lattice_is_solid(tmp_path: Path) -> None:
    """Each point of every other site stands for two cells."""
    sites = block((4.0, 4.0, 4.0), (20, 12, 12))
    sites = sites[(sites.sum(axis=1) / 4.0) % 2 == 0]
    assert mass(loaded(tmp_path / "a.npz", sites)) == pytest.approx(len(sites) * 2 * 0.064)


@pytest.mark.slow
@pytest.mark.parametrize("turned", [pytest.param(False, marks=pytest.mark.slow), True])
def test_scattered_points_have_the_volume_between_them(turned: bool, tmp_path: Path) -> None:
    """20,000 at random in a box of 81 ml, along the axes or across them, within 4 %, with a word."""
    rng = np.random.default_rng(0)
    points = rng.uniform((0.0, 0.0, 0.0), (90.0, 30.0, 30.0), size=(20_000, 3))
    if turned:
        points = points @ np.linalg.qr(rng.normal(size=(3, 3)))[0]
    made = loaded(tmp_path / "a.npz", points)
    assert mass(made) == pytest.approx(81.0, rel=0.04)
    assert any("lie on no lattice" in note for note in made.notes)


@pytest.mark.slow
def test_coarse_numbers_are_no_lattice(tmp_path: Path) -> None:
    """Scattered points rounded to whole millimetres, most of which are free: they are not cubes of a millimetre."""
    points = np.random.default_rng(0).uniform((0.0, 0.0, 0.0), (90.0, 30.0, 30.0), size=(8_000, 3)).round()
    assert mass(loaded(tmp_path / "a.npz", points)) == pytest.approx(81.0, rel=0.06)


@pytest.mark.slow  # the next refuses the same of a lattice
def test_points_on_a_surface_are_too_thin(tmp_path: Path) -> None:
    """Of a sphere: there is nothing within."""
    points = np.random.default_rng(0).normal(size=(20_000, 3))
    made = loaded(tmp_path / "a.npz", 50.0 * points / np.linalg.norm(points, axis=1, keepdims=True))
    with pytest.raises(UsageError, match="lie on surfaces or lines"):
        made.body(Fidelity(1 / 512))


def test_a_flat_lattice_and_a_few_points_have_no_volume(tmp_path: Path) -> None:
    """A single layer has no thickness, and between a few points there is no telling."""
    with pytest.raises(UsageError, match="lie on surfaces or lines"):
        loaded(tmp_path / "a.npz", block((4.0, 4.0, 4.0), (30, 1, 30))).body(PAPER)
    points = np.random.default_rng(0).uniform(0.0, 50.0, size=(100, 3))
    with pytest.raises(UsageError, match=r"100 points on no lattice.*Give 500 or more"):
        loaded(tmp_path / "a.npz", points).body(PAPER)


def test_pcd_files_of_earlier_versions_are_read(tmp_path: Path) -> None:
    """Those of 0.5 have no viewpoint and write their version without a zero."""
    pytest.importorskip("pypcd4")
    points = block((5.0, 5.0, 5.0), (11, 11, 11))
    header = (
        "# .PCD v.5 - Point Cloud Data file format\nVERSION .5\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
        "WIDTH 1331\nHEIGHT 1\nPOINTS 1331\nDATA ascii\n"
    )
    (tmp_path / "a.pcd").write_text(header + "".join(f"{x:g} {y:g} {z:g}\n" for x, y, z in points))
    assert mass(CloudDesign(path=InputFile(tmp_path / "a.pcd"), unit="mm")) == pytest.approx(1331 * 0.125)


def test_points_without_a_place_are_left_out(tmp_path: Path) -> None:
    """As in organised files, with a word."""
    points = np.vstack([block((5.0, 5.0, 5.0), (11, 11, 11)), np.full((50, 3), np.nan)])
    made = loaded(tmp_path / "a.npz", points)
    assert mass(made) == pytest.approx(1331 * 0.125)
    assert "50 of 1,381 points have no place: left out." in made.notes


@pytest.mark.parametrize("place", [pytest.param((400.0, 0.0, 0.0), marks=pytest.mark.slow), (401.3, 7.7, -20.0)])
def test_a_stray_point_is_left_out(place: tuple[float, float, float], tmp_path: Path) -> None:
    """On the lattice or off it; the body is as long as without it."""
    made = loaded(tmp_path / "a.npz", np.vstack([block((5.0, 5.0, 5.0), (11, 11, 11)), place]))
    assert mass(made) == pytest.approx(1331 * 0.125)
    assert "1 of 1,332 points are far from all others: left out." in made.notes


def test_what_was_assumed_of_a_cloud_is_said(tmp_path: Path) -> None:
    """The metre, and the directions; nothing of that if they were given."""
    points = block((5.0, 5.0, 5.0), (11, 6, 5))
    size, pose, *_ = loaded(tmp_path / "a.npz", points / 1000.0, unit="auto").notes
    assert "is 0.055 x 0.03 x 0.025 in its file" in size
    assert "its unit was taken for the metre" in size
    assert "x was taken as ahead and y as up, as in exported files" in pose
    given = loaded(tmp_path / "a.npz", points, ahead="x", up="y").notes
    assert given[0] == "The body is 55 x 30 x 25 in its file (length, height, width), in mm."
    assert "grouping=paired" in given[1]


def ply(path: Path, form: str) -> CloudDesign:
    """`columns` as a PLY file in text or in bytes."""
    given = columns()
    names = ("x", "y", "z", "muscle", "fx", "fy", "fz")
    rows = np.zeros(80, dtype=[(name, "<i4" if name == "muscle" else "<f4") for name in names])
    for number, axis in enumerate("xyz"):
        rows[axis], rows[f"f{axis}"] = given["positions"][:, number], given["fibres"][:, number]
    rows["muscle"] = given["muscle"]
    kinds = "".join(f"property {'int' if name == 'muscle' else 'float'} {name}\n" for name in names)
    header = f"ply\nformat {form} 1.0\ncomment muscle 0 belly\nelement vertex 80\n{kinds}end_header\n"
    body = rows.tobytes()
    if form == "ascii":
        body = "".join(" ".join(str(value) for value in row) + "\n" for row in rows.tolist()).encode()
    path.write_bytes(header.encode() + body)
    return CloudDesign(path=InputFile(path))


@pytest.mark.slow
def test_a_ply_file_in_text_is_that_in_bytes(tmp_path: Path) -> None:
    """Bit for bit, with the names of muscles from its comments."""
    pytest.importorskip("trimesh")
    text, binary = (ply(tmp_path / f"{form}.ply", form).body(PAPER) for form in ("ascii", "binary_little_endian"))
    for name in ("positions", "volumes", "muscle_membership", "fibres"):
        np.testing.assert_array_equal(getattr(text, name), getattr(binary, name))
    assert text.muscles == binary.muscles == ("belly",)


def _paint(path: Path, colour: Any) -> CloudDesign:
    """The block of `columns` with these colours."""
    pypcd4 = pytest.importorskip("pypcd4")
    data = [*columns()["positions"].T.astype(np.float32), colour.astype(np.uint32)]
    pypcd4.PointCloud.from_points(data, ["x", "y", "z", "rgb"], [np.float32] * 3 + [np.uint32]).save(path)
    return CloudDesign(path=InputFile(path))
