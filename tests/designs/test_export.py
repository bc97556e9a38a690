"""Exported bodies in the readers of other libraries and in our own."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from zoobench import registry
from zoobench.designs.base import Body
from zoobench.designs.export import COLUMNS, export
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.spec import Ref

PAPER = Fidelity(1 / 128)
EDGE = 1 / 256


@pytest.fixture(scope="module")
def panda() -> Body:
    """A body with passive parts."""
    body = registry.create(Kind.DESIGN, Ref("panda")).body(PAPER)
    assert isinstance(body, Body)
    return body


def test_npz_keeps_everything(panda: Body, tmp_path: Path) -> None:
    """Every array by name, bit for bit."""
    export(panda, tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz") as found:
        assert tuple(found["muscles"]) == panda.muscles
        for name in ("positions", "volumes", "stiffness", "muscle_membership", "fibres", "head", "tail"):
            np.testing.assert_array_equal(found[name], getattr(panda, name))


def test_ply_is_read_by_others(panda: Body, tmp_path: Path) -> None:
    """trimesh reads points and columns."""
    trimesh = pytest.importorskip("trimesh")
    export(panda, tmp_path / "a.ply")
    cloud = trimesh.load(tmp_path / "a.ply")
    np.testing.assert_allclose(cloud.vertices, panda.sites, atol=1e-7)
    np.testing.assert_allclose(cloud.metadata["_ply_raw"]["vertex"]["data"]["fill"], panda.volumes / EDGE**3, rtol=1e-6)
    rows = cloud.metadata["_ply_raw"]["vertex"]["data"]
    assert rows.dtype.names == COLUMNS
    passive = panda.muscle_membership.sum(axis=1) <= 0.5
    np.testing.assert_array_equal(rows["muscle"] == -1, passive)
    np.testing.assert_allclose(rows["fy"], panda.fibres[:, 1], atol=1e-6)


def test_pcd_is_read_by_others(panda: Body, tmp_path: Path) -> None:
    """pypcd4 reads the same values as in the PLY file."""
    pypcd4 = pytest.importorskip("pypcd4")
    trimesh = pytest.importorskip("trimesh")
    export(panda, tmp_path / "a.pcd")
    export(panda, tmp_path / "a.ply")
    cloud = pypcd4.PointCloud.from_path(tmp_path / "a.pcd")
    assert cloud.fields == COLUMNS
    assert cloud.points == panda.particle_count
    rows = trimesh.load(tmp_path / "a.ply").metadata["_ply_raw"]["vertex"]["data"]
    for name in COLUMNS:
        np.testing.assert_array_equal(cloud.pc_data[name], rows[name])


def test_stl_is_closed_and_encloses_the_volume(panda: Body, tmp_path: Path) -> None:
    """Watertight, with the body's volume within 1 % and its box within a particle."""
    trimesh = pytest.importorskip("trimesh")
    pytest.importorskip("skimage")
    export(panda, tmp_path / "a.stl")
    mesh = trimesh.load(tmp_path / "a.stl")
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume == pytest.approx(panda.volumes.sum(), rel=0.01)
    assert mesh.extents == pytest.approx(np.ptp(panda.positions, axis=0) + EDGE, abs=EDGE)


def test_stl_of_a_body_smaller_than_its_cubes(tmp_path: Path) -> None:
    """It is closed and encloses the volume, though no place is as full as a twentieth."""
    pytest.importorskip("skimage")
    trimesh = pytest.importorskip("trimesh")
    cube = Ref.parse("block[height=0.002,length=0.07,width=0.002]")
    body = registry.create(Kind.DESIGN, cube).body(Fidelity(1 / 32))
    export(body, tmp_path / "a.stl")
    mesh = trimesh.load(tmp_path / "a.stl")
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(0.07 * 0.002**2, rel=0.1)


def test_stl_of_a_face_centred_lattice(tmp_path: Path) -> None:
    """Watertight, in one piece, with the body's volume within 1 %."""
    trimesh = pytest.importorskip("trimesh")
    pytest.importorskip("skimage")
    body = registry.create(Kind.DESIGN, Ref("caterpillar")).body(Fidelity(1 / 64, particles_per_cell=4))
    export(body, tmp_path / "a.stl")
    mesh = trimesh.load(tmp_path / "a.stl")
    assert mesh.is_watertight
    assert mesh.body_count == 1
    assert mesh.volume == pytest.approx(body.volumes.sum(), rel=0.01)


def test_an_exported_body_is_a_body(panda: Body, tmp_path: Path) -> None:
    """The surface, read as a mesh design, has the same mass and position."""
    pytest.importorskip("trimesh")
    pytest.importorskip("skimage")
    export(panda, tmp_path / "a.stl")
    ref = Ref("mesh", params=(("path", str(tmp_path / "a.stl")), ("unit", "m"), ("up", "y")))
    again = registry.create(Kind.DESIGN, ref).body(PAPER)
    assert again.masses(1000.0).sum() == pytest.approx(panda.masses(1000.0).sum(), rel=1e-3)
    centre, other = panda.positions.mean(axis=0), again.positions.mean(axis=0)
    assert other == pytest.approx(centre, abs=0.002)


@pytest.mark.parametrize("name", ["Rücken", "left fin", "back\nend_header", "end_header", "", "x" * 81])
def test_a_name_that_no_header_holds_is_refused(panda: Body, name: str, tmp_path: Path) -> None:
    """As a muscle may have in an `npz`, which keeps it; nothing is written."""
    odd = replace(panda, muscles=(name, *panda.muscles[1:]))
    for file in ("a.ply", "a.pcd"):
        with pytest.raises(UsageError, match=r"name .*ends in \.npz"):
            export(odd, tmp_path / file)
        assert not (tmp_path / file).exists()
    export(odd, tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz") as found:
        assert tuple(found["muscles"]) == odd.muscles


@pytest.mark.parametrize("name", ["a.docx", "a", "nowhere/a.npz"])
def test_where_nothing_can_be_written(panda: Body, name: str, tmp_path: Path) -> None:
    """An unknown suffix, none, and a missing folder."""
    with pytest.raises(UsageError, match=r"\.npz, \.pcd, \.ply or \.stl|cannot be written"):
        export(panda, tmp_path / name)
