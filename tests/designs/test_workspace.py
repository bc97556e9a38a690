"""Workspaces: the particles of a fixed design, and the inputs of networks."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from zoobench import registry
from zoobench.designs.base import Body
from zoobench.designs.caterpillar import Caterpillar
from zoobench.designs.workspace import BasedSpace, extent, features_at
from zoobench.errors import UnknownNameError, UsageError
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.spec import Ref

DRAFT = Fidelity(1 / 64)


def workspace(base: str, fidelity: Fidelity) -> Body:
    """The workspace of a design space on this base."""
    return BasedSpace(base=base).body(fidelity)


def test_it_is_the_whole_base() -> None:
    """Particles, labels, muscles and density are the base's; occupancy and stiffness are 1, fibres ahead."""
    base = registry.create(Kind.DESIGN, Ref("orca")).body(DRAFT)
    body = workspace("orca", DRAFT)
    assert body.malleable
    assert not base.malleable
    for name in ("positions", "volumes", "density_ratio", "muscle_membership", "head", "tail"):
        np.testing.assert_array_equal(getattr(body, name), getattr(base, name))
    assert body.muscles == base.muscles
    assert (body.occupancy == 1.0).all()
    assert (body.stiffness == 1.0).all()
    assert (body.fibres == (1.0, 0.0, 0.0)).all()


def test_a_base_may_have_a_version_and_a_parameter() -> None:
    """As on the command line."""
    long = workspace("caterpillar-v3[length=0.2]", DRAFT)
    np.testing.assert_array_equal(long.positions, Caterpillar(length=0.2).body(DRAFT).positions)


def test_an_unknown_base_is_refused() -> None:
    """With suggestions."""
    with pytest.raises(UnknownNameError, match="'caterpillar'"):
        workspace("caterpilar", DRAFT)


def test_a_file_must_be_named_with_its_content(tmp_path: Path) -> None:
    """A run's key contains the base's name; the message has the name with digest."""
    path = tmp_path / "ball.stl"
    trimesh.creation.icosphere(radius=0.03).export(path)
    with pytest.raises(UsageError, match="digest of the content") as refusal:
        workspace(f"mesh[path={path}]", DRAFT)
    whole = str(refusal.value).rpartition("base=")[2].removesuffix(".")
    assert workspace(whole, DRAFT).particle_count > 50


@pytest.mark.parametrize("base", ["block", pytest.param("panda", marks=pytest.mark.slow)])
def test_the_box_is_the_body_however_it_is_sampled(base: str) -> None:
    """Centre and half extent agree between grids to half a coarse particle."""
    (centre, half), (fine_centre, fine_half) = (extent(workspace(base, Fidelity(h))) for h in (1 / 64, 1 / 192))
    np.testing.assert_allclose(centre, fine_centre, atol=1 / 256)
    np.testing.assert_allclose(half, fine_half, atol=1 / 256)


def test_the_features_of_a_network() -> None:
    """Coordinates within half a particle of the box's faces, and the distances of the formulas."""
    body = workspace("block[length=0.125,height=0.0625,width=0.0625]", DRAFT)  # of whole cells, 8 x 4 x 4
    seen = features_at(body.positions, body)
    assert seen.shape == (body.particle_count, 7)
    np.testing.assert_allclose(np.abs(seen[:, :3]).max(axis=0), [15 / 16, 7 / 8, 7 / 8], rtol=1e-9)
    np.testing.assert_allclose(seen[:, :3].mean(axis=0), 0.0, atol=1e-12)
    for x, y, z, xy, xz, yz, radius in seen[::50]:
        assert xy == pytest.approx((x * x + y * y) ** 0.5)
        assert xz == pytest.approx((x * x + z * z) ** 0.5)
        assert yz == pytest.approx((y * y + z * z) ** 0.5)
        assert radius == pytest.approx((x * x + y * y + z * z) ** 0.5)
