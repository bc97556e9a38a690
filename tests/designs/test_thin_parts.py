"""Parts that are thinner than a particle."""

import numpy as np
import pytest
from scipy.ndimage import binary_opening

from zoobench.designs.thin_parts import Thickness, coarsest, distant, thickened

GRID = 0.1 * (np.indices((20, 12, 12)).reshape(3, -1).T + 0.5)


def test_a_thread_becomes_two_particles_thick_wherever_it_lies() -> None:
    """A thread of no thickness behind a box, at several places on the lattice; the box is unchanged."""
    inside = np.asarray((GRID[:, 0] > 1.0) & (np.abs(GRID[:, 1:] - 0.6) < 0.4).all(axis=1))
    for place in (0.57, 0.6, 0.64):
        thread = np.stack([np.linspace(0.0, 1.0, 41), np.full(41, place), np.full(41, place)], axis=1)
        kept = GRID[thickened(GRID, inside, thread, 0.1) & ~inside]
        sections = [len(kept[np.isclose(kept[:, 0], x)]) for x in np.unique(kept[:, 0].round(6))]
        assert sections == [4] * 10


def test_solid_matter_has_no_thin_parts() -> None:
    """No point on a ball is far from its particles, at any place on the lattice."""
    directions = np.random.default_rng(0).normal(size=(500, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    for shift in np.random.default_rng(1).uniform(-0.05, 0.05, size=(10, 3)):
        centre = np.array([1.0, 0.6, 0.6]) + shift
        ball = GRID[np.linalg.norm(GRID - centre, axis=1) < 0.4]
        assert not len(distant(centre + 0.4 * directions, ball, 0.15))
        inside = np.linalg.norm(GRID - centre, axis=1) < 0.4
        np.testing.assert_array_equal(thickened(GRID, inside, centre + 0.4 * directions, 0.1), inside)


def test_thickness_is_the_volume_that_cubes_fill() -> None:
    """Against openings by scipy, on random matter; the share decreases with the cube."""
    cells = np.zeros((16, 14, 12), bool)
    cells[1:9, 2:9, 3:8] = cells[8:15, 5:6, 2:9] = cells[3:6, 9:12, 4:10] = True
    points = 0.5 * np.argwhere(cells)
    found = Thickness.of(points, 0.5)
    for span in range(1, 7):
        opened = binary_opening(np.pad(cells, 8), np.ones((span,) * 3))
        assert found.share(0.5 * span) == pytest.approx(opened.sum() / cells.sum())
    assert (np.diff(found.shares) <= 0.0).all()
    assert found.share(10.0) == 0.0


def test_the_coarsest_fidelity_that_holds_a_body_is_named() -> None:
    """By its name, or none if all are too coarse."""
    assert "'standard'" in coarsest(lambda fidelity: fidelity.grid_spacing < 1 / 90)
    assert "finer fidelity than those" in coarsest(lambda _: False)
