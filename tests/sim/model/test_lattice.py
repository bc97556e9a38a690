"""Seeding: mass, order and evenness of the lattice."""

import numpy as np
import pytest

from tests.sim import scenes
from zoobench.errors import SceneError, UsageError
from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.model.fidelity import PARTICLES_PER_CELL, Fidelity
from zoobench.sim.model.lattice import fill_box, particle_volume
from zoobench.sim.model.scene import Scene
from zoobench.sim.solver import Solver

EVERY = pytest.mark.parametrize("per_cell", PARTICLES_PER_CELL)


@EVERY
def test_mass_of_a_body_is_density_times_volume(per_cell: int) -> None:
    """Whatever the sampling, in the solver's own tensors."""
    lower = np.array([0.2, 0.2, 0.2])
    cells = np.array([5, 3, 4])
    h = scenes.SPACING
    positions = fill_box(lower, lower + h * cells, h, per_cell)
    assert len(positions) == per_cell * cells.prod()
    body = ElasticBody.passive(scenes.STIFF, positions, np.full(len(positions), particle_volume(h, per_cell)))
    scene = Scene(body, (0.0, 0.0, 0.0), scenes.ARENA)
    solver = Solver(scene, Fidelity(h, particles_per_cell=per_cell, precision=64))
    solver.run(np.zeros((1, 1, 0)))
    assert float(solver.parameters.mass.sum()) == pytest.approx(1000.0 * h**3 * cells.prod(), rel=1e-12)


@EVERY
def test_lattice_is_even(per_cell: int) -> None:
    """Every cell has its centre of mass in its middle, and no two particles share a place."""
    points = fill_box(np.zeros(3), np.array([2.0, 2.0, 2.0]), 1.0, per_cell)
    assert np.allclose(points.mean(0), 1.0)
    assert (points > 0).all()
    assert (points < 2).all()
    distance = np.linalg.norm(points[:, None] - points[None], axis=2) + 9 * np.eye(len(points))
    assert distance.min() >= 0.33
    cells = np.floor(points).astype(int)
    assert (np.unique(cells, axis=0, return_counts=True)[1] == per_cell).all()


def test_order_is_that_of_the_grid_cells() -> None:
    """x slowest: neighbours in memory are neighbours on the grid."""
    cells = np.floor(fill_box(np.zeros(3), np.array([2.0, 3.0, 2.0]), 1.0, 8)).astype(int)
    index = cells @ [6, 2, 1]
    assert (np.diff(index) >= 0).all()


def test_box_that_is_no_whole_number_of_cells() -> None:
    """Only the sites inside are filled."""
    points = fill_box(np.zeros(3), np.array([1.5, 1.0, 1.0]), 1.0, 8)
    assert len(points) == 12
    assert points[:, 0].max() == 1.25


def test_box_without_a_particle_is_refused() -> None:
    """With its size in plain numbers, and the advice to go finer."""
    with pytest.raises(SceneError, match=r"A box of \(0\.2, 1\.0, 1\.0\) m"):
        fill_box(np.zeros(3), np.array([0.2, 1.0, 1.0]), 1.0, 8)
    with pytest.raises(SceneError, match="Use a finer fidelity or a larger body"):
        fill_box(np.zeros(3), np.array([0.2, 1.0, 1.0]), 1.0, 8)
    with pytest.raises(SceneError, match="holds no particle"):
        fill_box(np.zeros(3), np.array([-1.0, 1.0, 1.0]), 1.0, 8)


@pytest.mark.parametrize(("edge", "count"), [(100.0, r"8\.0e\+12"), (1e300, "inf")])
def test_a_box_in_another_unit_is_refused(edge: float, count: str) -> None:
    """A hundred metres on cells of a centimetre, or more than can be counted, before memory for them is asked for."""
    with pytest.raises(SceneError, match=f"{count} particles .* lengths are in metres"):
        fill_box(np.zeros(3), np.full(3, edge), 0.01, 8)


def test_unknown_sampling_is_refused() -> None:
    """Only the lattices that exist are offered."""
    with pytest.raises(UsageError, match="5 particles per cell are not offered"):
        fill_box(np.zeros(3), np.ones(3), 1.0, 5)
