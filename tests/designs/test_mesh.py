"""Bodies from mesh files, valid and invalid."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from zoobench import registry
from zoobench.designs.grouping import k_means, slices
from zoobench.designs.mesh import MeshDesign
from zoobench.designs.solid_mesh import FORMATS, load
from zoobench.errors import SceneError, UsageError
from zoobench.inputs import InputFile
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import PARTICLES_PER_CELL, Fidelity
from zoobench.spec import Ref

trimesh = pytest.importorskip("trimesh")
DRAFT = Fidelity(1 / 64)


def shape(name: str) -> Any:
    """A solid of trimesh's own, in millimetres."""
    make = trimesh.creation
    return {
        "sphere": lambda: make.icosphere(subdivisions=3, radius=50.0),
        "torus": lambda: make.torus(major_radius=40.0, minor_radius=14.0),
        "capsule": lambda: make.capsule(height=60.0, radius=20.0),
        "annulus": lambda: make.annulus(r_min=15.0, r_max=50.0, height=40.0),
    }[name]()


def inside(name: str, points: "np.ndarray[tuple[int, ...], np.dtype[np.float64]]") -> Any:
    """Which points [mm] are inside, in closed form."""
    x, y, z = points.T
    if name == "sphere":
        return x**2 + y**2 + z**2 < 50.0**2
    if name == "torus":
        return (np.hypot(x, y) - 40.0) ** 2 + z**2 < 14.0**2
    if name == "capsule":
        beyond = z - np.clip(z, -30.0, 30.0)
        return x**2 + y**2 + beyond**2 < 20.0**2
    return (np.hypot(x, y) > 15.0) & (np.hypot(x, y) < 50.0) & (abs(z) < 20.0)


def design(mesh: Any, path: Path, **params: Any) -> MeshDesign:
    """The design from a file of the mesh."""
    mesh.export(path)
    return MeshDesign(path=InputFile(path), **params)


@pytest.mark.parametrize("kind", FORMATS)
@pytest.mark.parametrize("name", ["sphere", "torus", "capsule", "annulus"])
def test_every_format_is_read_as_the_same_solid(name: str, kind: str, tmp_path: Path) -> None:
    """The volume is trimesh's, and the inside is the closed form up to the facets' error."""
    mesh = shape(name)
    mesh.export(tmp_path / f"a.{kind}")
    found = load(str(tmp_path / f"a.{kind}"))
    assert found.volume() == pytest.approx(mesh.volume, rel=1e-6)
    assert found.pieces() == 1
    points = np.random.default_rng(0).uniform(*mesh.bounds, size=(3000, 3))
    low, high = mesh.bounds
    middle = points if name != "capsule" else points - (0.0, 0.0, (low[2] + high[2]) / 2)
    assert (found.inside(points) != inside(name, middle)).mean() < 0.02


@pytest.mark.parametrize("particles_per_cell", PARTICLES_PER_CELL)
def test_a_body_from_a_file_is_whole(particles_per_cell: int, tmp_path: Path) -> None:
    """The requirements on every design, with the mass of the mesh."""
    path = tmp_path / "a.stl"
    shape("sphere").export(path)
    made = registry.create(Kind.DESIGN, Ref("mesh", params=(("muscles", 5), ("path", str(path)))))
    body = made.body(Fidelity(1 / 64, particles_per_cell=particles_per_cell))
    assert body.masses(1000.0).sum() == pytest.approx(1000.0 * load(str(path)).volume() * 1e-9, rel=1e-5)
    assert body.positions[:, 1].min() >= 0.0
    assert np.ptp(body.positions[:, 0]) == pytest.approx(0.1, abs=1 / 64)
    assert body.muscles == tuple(f"muscle-{n}" for n in range(1, 6))
    assert (body.muscle_membership.sum(axis=0) > 0.0).all()
    assert body.muscle_membership.sum(axis=1) == pytest.approx(1.0)
    assert np.linalg.norm(body.fibres, axis=1) == pytest.approx(1.0)
    assert body.positions[body.head, 0].min() > body.positions[body.tail, 0].max()


def test_it_is_posed_and_scaled(tmp_path: Path) -> None:
    """A capsule along the file's z lies along x with the given length and fibres."""
    body = design(shape("capsule"), tmp_path / "a.stl", ahead="z", up="x", length=0.12).body(Fidelity(1 / 128))
    assert np.ptp(body.positions, axis=0) + 1 / 256 == pytest.approx([0.12, 0.048, 0.048], abs=1 / 128)
    assert np.abs(body.fibres[:, 0]).min() > 0.99
    upright = design(shape("capsule"), tmp_path / "b.stl", length=0.05).body(Fidelity(1 / 128))
    assert np.ptp(upright.positions, axis=0).argmax() == 1


def test_groups_do_not_depend_on_the_resolution(tmp_path: Path) -> None:
    """Nearest coarse and fine particles are in the same group; a second reading is equal bit for bit."""
    made = design(shape("torus"), tmp_path / "a.ply", muscles=6)
    again = MeshDesign(path=made.path, muscles=6)
    np.testing.assert_array_equal(made.groups.centres, again.groups.centres)
    body = made.body(Fidelity(1 / 100))
    shares = body.muscle_membership.mean(axis=0)
    assert shares == pytest.approx(1 / 6, abs=0.05)


def test_k_means_finds_clumps_and_slices_cut_rods() -> None:
    """Four clusters are four groups; a rod has equal slices with fibres along it."""
    rng = np.random.default_rng(0)
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    points = (corners[:, None] + rng.uniform(-0.1, 0.1, size=(4, 50, 3))).reshape(-1, 3)
    shares = k_means(points, 4).membership(points)
    assert sorted(shares.sum(axis=0)) == [50, 50, 50, 50]
    rod = rng.uniform((-1.0, -0.1, -0.1), (1.0, 0.1, 0.1), size=(400, 3))
    cut = slices(rod, 4)
    assert cut.directions[:, 0] == pytest.approx(1.0, abs=0.01)
    assert (cut.membership(rod).argmax(axis=1) == np.clip((rod[:, 0] + 1) * 2, 0, 3).astype(int)).mean() > 0.97


def test_repairs(tmp_path: Path) -> None:
    """A missing triangle is filled, and inward normals are turned."""
    holed, flipped = shape("sphere"), shape("sphere")
    whole = holed.volume
    holed.update_faces(np.arange(len(holed.faces)) > 0)
    flipped.invert()
    for number, mesh in enumerate((holed, flipped)):
        mesh.export(tmp_path / f"{number}.stl")
        assert load(str(tmp_path / f"{number}.stl")).volume() == pytest.approx(whole, rel=1e-3)


def broken(kind: str) -> Any:
    """An invalid mesh."""
    mesh = shape("sphere")
    if kind == "open":
        mesh.update_faces(mesh.triangles_center[:, 2] < 0.0)
        return mesh
    inner = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], [[0, 1, 2], [0, 1, 3], [0, 1, 4]])
    return {"non-manifold": inner, "flat": trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])}[kind]


@pytest.mark.parametrize(
    ("kind", "message"), [("open", "not watertight"), ("non-manifold", "more than two faces"), ("flat", "watertight")]
)
def test_what_is_no_solid_is_refused(kind: str, message: str, tmp_path: Path) -> None:
    """The message names the defect."""
    broken(kind).export(tmp_path / "a.ply")
    with pytest.raises(UsageError, match=message):
        load(str(tmp_path / "a.ply"))


@pytest.mark.parametrize(
    ("name", "content"), [("a.stl", b""), ("a.stl", b"no mesh"), ("a.glb", b"glTF"), ("a.obj", b"")]
)
def test_what_is_no_mesh_is_refused(name: str, content: bytes, tmp_path: Path) -> None:
    """Empty files and other contents, without a traceback."""
    (tmp_path / name).write_bytes(content)
    with pytest.raises(UsageError, match=r"cannot be read|can be read|no triangles|a\.stl"):
        load(str(tmp_path / name))


def test_an_unknown_format_is_refused(tmp_path: Path) -> None:
    """The message has the known formats."""
    (tmp_path / "a.docx").write_bytes(b"x")
    with pytest.raises(UsageError, match="stl, obj, ply, glb"):
        load(str(tmp_path / "a.docx"))


def test_the_wrong_unit_is_named(tmp_path: Path) -> None:
    """Millimetres read as metres give a robot of 100 m."""
    with pytest.raises(SceneError, match="unit"):
        design(shape("sphere"), tmp_path / "a.stl", length=0.0)


def test_what_is_too_thin_for_the_grid_is_refused(tmp_path: Path) -> None:
    """A sheet of 6 mm at 1/64 m, but not at 1/128 m."""
    sheet = trimesh.creation.box(extents=(100.0, 60.0, 6.0))
    made = design(sheet, tmp_path / "a.stl")
    with pytest.raises(SceneError, match="too thin"):
        made.body(DRAFT)
    assert made.body(Fidelity(1 / 160)).particle_count > 100


@pytest.mark.parametrize("params", [{"muscles": 0}, {"length": -1.0}, {"ahead": "z"}])
def test_values_without_sense_are_refused(params: dict[str, Any], tmp_path: Path) -> None:
    """No muscle, a negative length, two parallel directions."""
    with pytest.raises(UsageError, match=r"cannot be|one line"):
        design(shape("sphere"), tmp_path / "a.stl", **params)
