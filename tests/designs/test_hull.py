"""The surface of a body in water."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from zoobench import registry
from zoobench.designs.anatomy import MIDDLE
from zoobench.designs.base import Body
from zoobench.designs.hull import TRIANGLES, _of_solid, _surface, hull_of
from zoobench.designs.sampling import SolidSample
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.lattice import fill_box
from zoobench.sim.model.potential_flow import areas
from zoobench.sim.model.surface_water import Hull
from zoobench.spec import Ref

DRAFT = Fidelity(1 / 64, robot="lagrangian")
STANDARD = replace(DRAFT, grid_spacing=1 / 96)


def _fish(fidelity: Fidelity) -> Body:
    body: Body = registry.create(Kind.DESIGN, Ref("fish")).body(fidelity)
    return body


def test_hull_of_a_solid_is_closed_and_has_its_volume() -> None:
    """Its triangles face outwards, and are about as many as asked for."""
    hull = hull_of(_fish(DRAFT))
    assert np.abs(areas(hull.triangles).sum(axis=0)).max() < 1e-9
    assert hull.volume == pytest.approx(_fish(DRAFT).volumes.sum(), rel=0.07)
    assert 0.7 * TRIANGLES < len(hull.triangles) < 1.5 * TRIANGLES


@pytest.mark.slow
def test_hull_of_a_solid_does_not_depend_on_the_grid() -> None:
    """It is that of the drawing."""
    draft, standard = (_fish(each) for each in (DRAFT, STANDARD))
    np.testing.assert_array_equal(hull_of(standard).triangles, hull_of(draft).triangles)


@pytest.mark.parametrize("name", ["fish", "shark", "clownfish", pytest.param("tuna", marks=pytest.mark.slow)])
def test_a_fish_has_a_symmetric_hull(name: str) -> None:
    """Triangle for triangle above and below as left and right, so that no fish turns, dives or rolls for its hull."""
    body = registry.create(Kind.DESIGN, Ref(name)).body(DRAFT)
    triangles, edge = _of_solid(body.drawing)
    middles = triangles.mean(axis=1)
    for axis, middle in ((1, 1.5 * MIDDLE), (2, 0.0)):
        mirrored = middles.copy()
        mirrored[:, axis] = 2.0 * middle - mirrored[:, axis]
        assert cKDTree(middles).query(mirrored)[0].max() < 1e-6 * edge


@pytest.mark.slow
def test_a_fish_in_its_rest_frame_has_the_same_mass_above_and_below() -> None:
    """Volume by volume; by sampling alone a shark that turned rose at draft, and not on finer grids. What was asked for
    another frame before is another body."""
    design = registry.create(Kind.DESIGN, Ref("shark"))
    grid = Fidelity(1 / 64, particles_per_cell=27)
    found = {}
    for robot in ("mpm", "lagrangian"):
        body = design.body(replace(grid, robot=robot))
        mirrored = body.positions * (1.0, -1.0, 1.0) + (0.0, 3.0 * MIDDLE, 0.0)
        away, partner = cKDTree(body.positions).query(mirrored)
        found[robot] = max(away.max() / 0.15, np.abs(body.volumes[partner] / body.volumes - 1.0).max())
    assert found["lagrangian"] < 1e-9
    assert found["mpm"] > 1e-3


def test_an_orca_without_its_back_fin_is_alike_above_and_below() -> None:
    """Before and behind the fin, so that it does not dive."""
    orca = registry.create(Kind.DESIGN, Ref("orca"))
    points = np.random.default_rng(0).uniform((-0.08, 0.0, -0.04), (0.08, 1.5 * MIDDLE, 0.04), (5000, 3))
    points = points[np.abs(points[:, 0] - 0.014) > 0.02]  # beside the fin
    mirrored = points * (1.0, -1.0, 1.0) + (0.0, 3.0 * MIDDLE, 0.0)
    inside = orca.distance(points) < 0.0
    assert inside.mean() > 0.1
    np.testing.assert_array_equal(inside, orca.distance(mirrored) < 0.0)


@pytest.mark.slow
def test_hull_of_particles_is_that_of_their_cubes() -> None:
    """Within a twentieth of the volume, as where only particles are known the corners are cut."""
    fish = _fish(STANDARD)
    known, found = hull_of(fish), hull_of(replace(fish, drawing=None))
    assert found.volume == pytest.approx(known.volume, rel=0.08)
    areas_of = [np.linalg.norm(areas(each.triangles), axis=1).sum() for each in (known, found)]
    assert areas_of[1] == pytest.approx(areas_of[0], rel=0.1)


def _cubes(shape: tuple[int, int, int], fill: float = 1.0) -> Body:
    """A box of full cubes, of which there is a share."""
    edge = 1 / 128
    sites = fill_box(np.zeros(3), edge * np.array(shape), edge, 1)
    sample = SolidSample.filled(sites, edge)
    sample = replace(sample, volumes=fill * sample.volumes)
    ends = {"head": np.ones(len(sites), bool), "tail": np.ones(len(sites), bool)}
    return Body.of(sample, np.ones((len(sites), 1)), ("muscle",), **ends)


def test_a_thin_plate_has_a_surface() -> None:
    """One of a layer of cubes that it fills by a third, too."""
    hull = hull_of(_cubes((8, 1, 8), fill=0.3))
    flat = np.abs(areas(hull.triangles)[:, 1]).sum()
    assert flat == pytest.approx(2 * (8 / 128) ** 2, rel=0.05)
    assert np.abs(areas(hull.triangles).sum(axis=0)).max() < 1e-12


def test_matter_that_is_thin_everywhere_has_a_surface() -> None:
    """As a relaxed body of a design space at its beginning, and a large body is found with larger cubes."""
    assert hull_of(replace(_cubes((6, 6, 6)), occupancy=np.full(216, 0.3))).volume == pytest.approx(
        (6 / 128) ** 3, rel=0.1
    )
    large = hull_of(_cubes((30, 20, 10)))
    assert len(large.triangles) <= 2 * TRIANGLES
    assert large.triangles.mean(axis=(0, 1)) == pytest.approx(np.array([15, 10, 5]) / 128, rel=0.05)


def test_a_closed_cavity_has_no_surface() -> None:
    """Its water does not flow, and has no potential that one system of equations would find."""
    block = _cubes((6, 6, 6))
    cavity = np.abs(block.sites - block.sites.mean(axis=0)).max(axis=1) < 1 / 128
    hull, whole = hull_of(replace(block, occupancy=np.where(cavity, 0.0, 1.0))), hull_of(block)
    assert hull.volume == pytest.approx(whole.volume, rel=1e-9)
    assert hull.phi == pytest.approx(whole.phi)


def test_front_and_back_of_what_has_no_thickness_are_left_out() -> None:
    """Where a body is mirrored both halves may end by one triangle, and its added mass would be any number: 148 kg in
    one body."""
    half = np.random.default_rng(275).choice([-1.0, -0.3, 0.4, 1.0], (3, 3, 3))
    found = _surface(np.pad(np.minimum(half, half[:, :, ::-1]), 1, constant_values=-1.0), 0.0, 1.0)
    assert np.abs(areas(found).sum(axis=0)).max() < 1e-5
    assert not cKDTree(found.mean(axis=1)).query_pairs(1e-4)
    assert Hull(found, 1.0).phi.max() < 1.0
