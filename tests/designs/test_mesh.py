"""Bodies from mesh files, valid and invalid."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.conformance.cells import cell
from tests.designs.meshes import TRUNK, design, fish
from zoobench import registry
from zoobench.cell.problem import Problem
from zoobench.designs.mesh import MeshDesign
from zoobench.designs.mesh_file import FORMATS, load
from zoobench.errors import SceneError, UsageError
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


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        # every solid in one format, and one of them in every format
        pytest.param(name, kind, marks=() if name == "torus" or kind == "stl" else pytest.mark.slow)
        for name in ("sphere", "torus", "capsule", "annulus")
        for kind in FORMATS
    ],
)
def test_every_format_is_read_as_the_same_solid(name: str, kind: str, tmp_path: Path) -> None:
    """The volume is trimesh's, and the inside is the closed form up to the facets' error."""
    mesh = shape(name)
    mesh.export(tmp_path / f"a.{kind}")
    found = load(str(tmp_path / f"a.{kind}")).mesh
    assert found.volume() == pytest.approx(mesh.volume, rel=1e-6)
    points = np.random.default_rng(0).uniform(*mesh.bounds, size=(3000, 3))
    low, high = mesh.bounds
    middle = points if name != "capsule" else points - (0.0, 0.0, (low[2] + high[2]) / 2)
    assert (found.inside(points) != inside(name, middle)).mean() < 0.02


@pytest.mark.parametrize(
    "particles_per_cell",
    [pytest.param(count, marks=() if count == 8 else pytest.mark.slow) for count in PARTICLES_PER_CELL],
)
def test_a_body_from_a_file_is_whole(particles_per_cell: int, tmp_path: Path) -> None:
    """The requirements on every design, with the mass of the mesh."""
    path = tmp_path / "a.stl"
    shape("sphere").export(path)
    made = registry.create(Kind.DESIGN, Ref("mesh", params=(("muscles", 8), ("path", str(path)))))
    body = made.body(Fidelity(1 / 64, particles_per_cell=particles_per_cell))
    assert body.masses(1000.0).sum() == pytest.approx(1000.0 * load(str(path)).mesh.volume() * 1e-9, rel=1e-5)
    assert body.positions[:, 1].min() >= 0.0
    assert np.ptp(body.positions[:, 0]) == pytest.approx(0.1, abs=1 / 64)
    assert body.muscles[:2] == ("row-1-left-bottom", "row-1-left-top")
    assert len(body.muscles) == 8
    assert (body.muscle_membership.sum(axis=0) > 0.0).all()
    assert body.muscle_membership.sum(axis=1) == pytest.approx(1.0)
    assert np.linalg.norm(body.fibres, axis=1) == pytest.approx(1.0)
    assert body.positions[body.head, 0].min() > body.positions[body.tail, 0].max()


@pytest.mark.slow
def test_it_is_posed_and_scaled(tmp_path: Path) -> None:
    """A capsule along the file's z lies along x with the given length and fibres."""
    body = design(shape("capsule"), tmp_path / "a.stl", ahead="z", up="x", length=0.12).body(Fidelity(1 / 128))
    assert np.ptp(body.positions, axis=0) + 1 / 256 == pytest.approx([0.12, 0.048, 0.048], abs=1 / 128)
    assert np.abs(body.fibres[:, 0]).min() > 0.99
    upright = design(shape("capsule"), tmp_path / "b.stl", length=0.05).body(Fidelity(1 / 128))
    assert np.ptp(upright.positions, axis=0).argmax() == 1


@pytest.mark.slow
def test_groups_do_not_depend_on_the_resolution(tmp_path: Path) -> None:
    """Nearest coarse and fine particles are in the same group; a second reading is equal bit for bit."""
    made = design(shape("torus"), tmp_path / "a.ply", muscles=6, grouping="k-means")
    again = MeshDesign(path=made.path, muscles=6, grouping="k-means")
    points = np.random.default_rng(0).uniform(-0.05, 0.05, size=(200, 3))
    np.testing.assert_array_equal(made.groups.membership(points), again.groups.membership(points))
    body = made.body(Fidelity(1 / 100))
    shares = body.muscle_membership.mean(axis=0)
    assert shares == pytest.approx(1 / 6, abs=0.05)


@pytest.mark.parametrize(
    ("name", "content"), [("a.stl", b""), ("a.stl", b"no mesh"), ("a.glb", b"glTF"), ("a.obj", b"")]
)
def test_what_is_no_mesh_is_refused(name: str, content: bytes, tmp_path: Path) -> None:
    """Empty files and other contents, without a traceback."""
    (tmp_path / name).write_bytes(content)
    with pytest.raises(UsageError, match=r"cannot be read|can be read|no triangles|no whole STL"):
        load(str(tmp_path / name))


def test_an_unknown_format_is_refused(tmp_path: Path) -> None:
    """The message has the known formats; the registry does not read it."""
    (tmp_path / "a.docx").write_bytes(b"x")
    with pytest.raises(UsageError, match="stl, obj, ply, glb"):
        load(str(tmp_path / "a.docx"))
    with pytest.raises(UsageError, match=r"ends in '.docx'.*\.stl, \.obj, \.ply or \.glb"):
        registry.resolve(Kind.DESIGN, Ref("mesh", params=(("path", str(tmp_path / "a.docx")),)))


def test_the_wrong_unit_is_named(tmp_path: Path) -> None:
    """Millimetres read as metres give a robot of 100 m."""
    with pytest.raises(SceneError, match="unit"):
        design(shape("sphere"), tmp_path / "a.stl", unit="m")
    with pytest.raises(SceneError, match=r"is 0\.5 m long, 1\.25 m high and 0\.5 m wide"):
        design(shape("capsule"), tmp_path / "upright.stl", length=0.5)


@pytest.mark.parametrize("up", ["z", "auto"])
def test_a_wire_between_all_points_is_refused(up: str, tmp_path: Path) -> None:
    """Bent at a right angle, it is so thin that none of the points lies in it by which its thickness is measured."""
    wires = [trimesh.creation.box(bounds=[(0.0, 0.0, 0.0), end]) for end in ((100.0, 0.04, 0.04), (0.04, 100.0, 0.04))]
    with pytest.raises(SceneError, match="too thin"):
        design(trimesh.util.concatenate(wires), tmp_path / "a.stl", up=up).body(DRAFT)


@pytest.mark.slow
def test_what_is_too_thin_for_the_grid_is_refused(tmp_path: Path) -> None:
    """A sheet of 6 mm at 1/64 m, with the fidelity to use, but not at 1/128 m."""
    sheet = trimesh.creation.box(extents=(100.0, 60.0, 6.0))
    made = design(sheet, tmp_path / "a.stl")
    with pytest.raises(SceneError, match=r"too thin.*fidelity 'paper'"):
        made.body(DRAFT)
    assert made.body(Fidelity(1 / 128)).particle_count > 100


NAMED = {name: registry.create(Kind.FIDELITY, Ref(name)) for name in registry.names(Kind.FIDELITY)}


@pytest.mark.slow
@pytest.mark.parametrize("fins", [pytest.param("", marks=pytest.mark.slow), "flat"])
def test_a_thin_stalk_and_flat_fins_are_kept(fins: str, tmp_path: Path) -> None:
    """The body is as long and high as the mesh at every fidelity, has a tail, and the mass of the mesh."""
    made = design(fish(fins=fins), tmp_path / "a.stl")
    height = 0.048 if fins else 0.036
    for name in ("draft", "standard", "paper"):
        body, edge = made.body(NAMED[name]), NAMED[name].particle_edge
        assert np.ptp(body.positions, axis=0)[:2] + edge == pytest.approx([0.1, height], abs=1.5 * edge)
        assert body.tail.sum() > 10
        # exact, but for what is enclosed twice: lines measure that, here in another pose than the body's
        quadrature = 2e-3 * made.mesh.repeated
        assert body.volumes.sum() == pytest.approx(made.mesh.volume(), abs=max(quadrature, 1e-6 * made.mesh.volume()))


def test_a_fin_without_thickness_is_refused(tmp_path: Path) -> None:
    """A sheet of a single layer of triangles has no mass; the message has what is lost, and what to do."""
    with pytest.raises(SceneError, match=r"at the top, 26 % of its height.*some thickness"):
        design(fish(fins="sheet"), tmp_path / "a.stl").body(DRAFT)


@pytest.mark.slow
def test_a_thin_spike_is_kept(tmp_path: Path) -> None:
    """A spike of 6 mm, 1 mm thick, on a box of 100 mm."""
    box, spike = trimesh.creation.box(extents=(100, 40, 40)), trimesh.creation.box(extents=(10, 1, 1))
    mesh = trimesh.util.concatenate([box, spike.apply_translation((51.0, 0.3, 0.3))])
    assert design(mesh, tmp_path / "b.stl").body(Fidelity(1 / 200)).positions[:, 0].max() > 0.048


@pytest.mark.slow
@pytest.mark.parametrize("stalk", [2.0, *(pytest.param(stalk, marks=pytest.mark.slow) for stalk in (4.0, 6.0))])
def test_what_one_fidelity_holds_every_finer_one_holds(stalk: float, tmp_path: Path) -> None:
    """A stalk that some lattices meet and others miss was lost by the coarse ones and refused by the next."""
    trunk = [(x, max(high, stalk / 2), max(wide, stalk / 2)) if -43 < x < -20 else (x, high, wide)
             for x, high, wide in TRUNK]  # fmt: skip
    made = design(fish(trunk=trunk), tmp_path / "a.stl")
    accepted = []
    for fidelity in sorted(NAMED.values(), key=lambda fidelity: -fidelity.grid_spacing):
        try:
            accepted.append(made.body(fidelity).tail.any())
        except SceneError:
            accepted.append(False)
    assert accepted == sorted(accepted)
    assert accepted[-1]


def _curvature(path: Path, side: str, grouping: str) -> float:
    """Of the middle line seen from above after six frames with the muscles of one side, or every second one [1/m]."""
    text = f"mesh[path={path},length=0.2,grouping={grouping}]"
    problem = Problem(cell(design=text, controller="trajectory[frames=6]", frames=6))
    names = problem.body.muscles
    active = [side in name or (grouping != "paired" and n % 2 == (side == "left")) for n, name in enumerate(names)]
    episode = problem.episode(np.tile(3.0 * np.array(active), 6))
    assert episode.record.motion is not None
    last = episode.record.motion.positions[-1, 0].numpy()
    return float(np.polyfit(problem.body.positions[:, 0], last[:, 2], 2)[0])


@pytest.mark.slow
def test_an_imported_fish_can_bend_to_both_sides(tmp_path: Path) -> None:
    """With the muscles of one side, to that side, and mirrored; slices across the middle line do not bend it."""
    path = tmp_path / "a.stl"
    fish().export(path)
    left, right = (_curvature(path, side, "paired") for side in ("left", "right"))
    assert left < -0.2
    assert right == pytest.approx(-left, rel=0.01)  # the triangles of its sides are no mirror images
    assert abs(_curvature(path, "left", "axis")) < 0.05 * right


@pytest.mark.slow
def test_the_file_decides_which_axis_is_up(tmp_path: Path) -> None:
    """A fish along any axes of the file is posed by `up=auto` as it was made."""
    made = design(fish(fins="flat"), tmp_path / "a.stl").body(DRAFT)
    turned = fish(fins="flat")
    turned.vertices = turned.vertices[:, [1, 2, 0]]
    found = design(turned, tmp_path / "b.stl", up="auto").body(DRAFT)
    np.testing.assert_allclose(found.positions, made.positions, atol=1e-9)
    assert "z was taken as ahead and y as up" in found.notes[1]


@pytest.mark.slow
def test_what_was_assumed_of_a_file_is_said(tmp_path: Path) -> None:
    """Its size, the length that it was given, and its directions; what was given is no assumption."""
    box = trimesh.creation.box(extents=(120.0, 40.0, 30.0))
    size, pose = design(box, tmp_path / "a.stl").notes
    assert "is 120 x 30 x 40 in its file" in size
    assert "its unit is not known, so it was scaled by 0.0008333 to a length of 0.1 m" in size
    assert "x was taken as ahead and z as up, as most CAD tools have it" in pose
    assert "give both, as in ahead=x,up=z" in pose
    made = design(box, tmp_path / "a.stl", unit="mm", ahead="x", up="z")
    assert made.notes == ("The body is 120 x 30 x 40 in its file (length, height, width), in mm.",)
    assert made.body(DRAFT).masses(1000.0).sum() == pytest.approx(0.144)
    given = design(box, tmp_path / "a.stl", length=0.06, ahead="x", up="z")
    assert given.notes[0].endswith("scaled by 0.0005 to a length of 0.06 m.")


def test_glb_has_y_up(tmp_path: Path) -> None:
    """As its format says; the same body in STL has z up."""
    box = trimesh.creation.box(extents=(120.0, 40.0, 30.0))
    assert np.ptp(design(box, tmp_path / "a.glb").mesh.vertices, axis=0) == pytest.approx([0.1, 0.1 / 3, 0.025])
    assert np.ptp(design(box, tmp_path / "a.stl").mesh.vertices, axis=0) == pytest.approx([0.1, 0.025, 0.1 / 3])
    assert "y as up, as the format has it" in design(box, tmp_path / "a.glb").notes[1]


def test_pieces_are_counted(tmp_path: Path) -> None:
    """Two boxes that do not touch are one body in a file, and two in a simulation."""
    boxes = [trimesh.creation.box(bounds=[(n, 0, 0), (n + 40, 50, 50)]) for n in (0, 60)]
    made = design(trimesh.util.concatenate(boxes), tmp_path / "a.stl")
    assert made.notes[-1] == "The body is in 2 pieces that do not touch, the smaller ones of 50 %."


@pytest.mark.parametrize(
    "params", [{"muscles": 0}, {"muscles": 6}, {"length": -1.0}, {"ahead": "z"}, {"length": 0.1, "unit": "mm"}]
)
def test_values_without_sense_are_refused(params: dict[str, Any], tmp_path: Path) -> None:
    """No muscle, muscles without a pair, a negative length, two parallel directions, two scales."""
    with pytest.raises(UsageError, match=r"cannot be|one line|both give the scale"):
        design(shape("sphere"), tmp_path / "a.stl", **params)
