"""Panels of a surface in a body's cells."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sim import scenes
from zoobench import registry
from zoobench.designs.hull import hull_of
from zoobench.registry import Kind
from zoobench.sim.model import surface_panels
from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.potential_flow import areas
from zoobench.sim.model.rest_cells import RestCells
from zoobench.sim.model.surface_panels import SurfacePanels
from zoobench.sim.model.surface_water import SurfaceWater
from zoobench.spec import Ref

GRID = Fidelity(1 / 64, robot="lagrangian")


@pytest.fixture(scope="module")
def fish() -> tuple[ElasticBody, SurfaceWater, RestCells, SurfacePanels]:
    """The fish in water, its cells and its panels."""
    body = registry.create(Kind.DESIGN, Ref("fish")).body(GRID)
    placed = ElasticBody.placed(scenes.SOFT, body, body.positions, body.edge)
    placed = replace(placed, site_offsets=body.sites - body.positions)
    water, cells = SurfaceWater(hull=hull_of(body)), RestCells.of(placed, GRID)
    return placed, water, cells, SurfacePanels.of(placed, water, cells, GRID.grid_spacing)


def test_panels_have_the_area_and_the_added_mass_of_the_triangles(
    fish: tuple[ElasticBody, SurfaceWater, RestCells, SurfacePanels],
) -> None:
    """Their vectors close the surface, and nothing is lost on the way to them."""
    _, water, _, panels = fish
    assert water.hull is not None
    vectors = areas(water.hull.triangles)
    sizes = np.linalg.norm(vectors, axis=1)
    assert np.abs(panels.given[:, :3].sum(axis=(0, 2))).max() < 1e-9
    assert panels.given[:, 4].sum() == pytest.approx(sizes.sum())
    assert panels.given[:, 5].sum() == pytest.approx(water.density * water.hull.phi @ sizes)
    flat = np.linalg.norm(panels.given[:, :3], axis=1).sum()
    assert 0.9 * sizes.sum() < flat <= sizes.sum()  # triangles that face alike


def test_a_weak_point_is_no_particle(
    fish: tuple[ElasticBody, SurfaceWater, RestCells, SurfacePanels],
) -> None:
    """Whatever its number; the last ones are beyond those of a body that has fewer particles than sites."""
    body, water, cells, panels = fish
    lane = np.argwhere((cells.particles >= 0).all(axis=1))[0, 0]
    particles = cells.particles.copy()
    particles[lane] = -len(body.positions) - 1
    found = SurfacePanels.of(body, water, replace(cells, particles=particles), GRID.grid_spacing)
    assert found.given[:, 4].sum() == pytest.approx(panels.given[:, 4].sum())
    assert not (found.cell == lane).any()


def test_water_acts_on_relaxed_matter_by_the_third_power_of_its_occupancy(
    fish: tuple[ElasticBody, SurfaceWater, RestCells, SurfacePanels],
) -> None:
    """As its stiffness does, and on none that is thinner than half of the rest."""
    body, water, cells, panels = fish
    half = SurfacePanels.of(replace(body, occupancy=0.5 * body.occupancy), water, cells, GRID.grid_spacing)
    assert half.given[:, :6].sum() == pytest.approx(
        (panels.given[:, :6] * np.array([0.125, 0.125, 0.125, 1, 0.125, 0.125])[:, None]).sum()
    )
    foremost = body.sites[:, 0] > np.quantile(body.sites[:, 0], 0.8)
    relaxed = replace(body, occupancy=np.where(foremost, 0.4, 1.0))
    thin = SurfacePanels.of(relaxed, water, cells, GRID.grid_spacing)
    assert not (foremost[cells.particles[thin.cell]] | (cells.particles[thin.cell] < 0)).all(axis=1).any()


def test_panels_move_as_their_cells_have_it(fish: tuple[ElasticBody, SurfaceWater, RestCells, SurfacePanels]) -> None:
    """Weights are those of a place within the cell, near the surface."""
    _, water, cells, panels = fish
    used = panels.given[:, 4] > 0.0
    assert panels.weights.sum(axis=1)[used] == pytest.approx(1.0)
    assert panels.weights.min() >= 0.0
    assert water.hull is not None
    places = np.einsum("gir,gil->glr", cells.places[cells.nodes[panels.cell]], panels.weights)[used]
    low, high = water.hull.triangles.min(axis=(0, 1)), water.hull.triangles.max(axis=(0, 1))
    assert (places > low - 1e-3).all()
    assert (places < high + 1e-3).all()


def test_a_light_node_has_little_part_in_the_motion_of_panels(
    fish: tuple[ElasticBody, SurfaceWater, RestCells, SurfacePanels], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Water would fling it about: its weight is less than that by its place alone."""
    body, water, cells, panels = fish
    own = cells.on_nodes(body.volumes)[cells.nodes[panels.cell]]
    group, node = np.unravel_index((own / own.max(axis=1, keepdims=True)).argmin(), own.shape)
    assert own[group, node] < 0.02 * own[group].max()
    monkeypatch.setattr(surface_panels, "_LIGHT", 0.0)
    alike = SurfacePanels.of(body, water, cells, GRID.grid_spacing)
    assert 0.0 < panels.weights[group, node].max() < 0.4 * alike.weights[group, node].max()


def test_second_derivatives_of_a_quadratic_are_exact(
    fish: tuple[ElasticBody, SurfaceWater, RestCells, SurfacePanels],
) -> None:
    """Where the body is thick enough to tell them, and of a linear field they are zero."""
    _, _, cells, panels = fish
    x, y, z = cells.places.T
    assert np.abs(np.einsum("gk,gkd->gd", (1.0 + 2.0 * x - y + 3.0 * z)[panels.around], panels.bend)).max() < 1e-8
    found = np.einsum("gk,gkd->gd", (1.5 * x * x + 2.0 * x * y)[panels.around], panels.bend)
    assert found[:, 0] == pytest.approx(np.full(len(found), 3.0), rel=0.01)
    assert found[:, 5] == pytest.approx(np.full(len(found), 2.0), rel=0.01)
