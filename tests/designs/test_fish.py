"""The fish, and how a swimmer is sampled."""

import numpy as np
import pytest

from tests.envs.at_rest import made
from zoobench import registry
from zoobench.designs.anatomy import Animal
from zoobench.designs.caterpillar import Caterpillar
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.spec import Ref

FISH: Animal = registry.create(Kind.DESIGN, Ref("fish"))


@pytest.mark.parametrize("spacing", [1 / 96, *(pytest.param(1 / count, marks=pytest.mark.slow) for count in (64, 128))])
def test_a_swimmer_has_three_particles_along_a_cell(spacing: float) -> None:
    """Whatever the fidelity says. A scene has the edge of its robot's cubes, by which neighbours are told."""
    fidelity = Fidelity(spacing)
    assert FISH.body(fidelity).edge == pytest.approx(spacing / 3)
    ocean = made("ocean")
    assert ocean.scene(FISH.body(fidelity), fidelity).robot_edge(fidelity) == pytest.approx(spacing / 3)
    assert ocean.scene(Caterpillar().body(fidelity), fidelity).robot_edge(fidelity) == pytest.approx(spacing / 2)


def test_a_swimmer_is_sampled_once_for_fidelities_of_fewer_particles() -> None:
    """They have its lattice in common."""
    assert FISH.body(Fidelity(1 / 32, particles_per_cell=1)) is FISH.body(Fidelity(1 / 32, particles_per_cell=27))


@pytest.mark.parametrize("spacing", [1 / 64, 1 / 96, 1 / 128])
def test_no_cube_of_a_swimmer_is_of_both_sides(spacing: float) -> None:
    """Left and right muscles would cancel in it, and their arms be shorter by up to a tenth."""
    sites = FISH.body(Fidelity(spacing)).sites
    assert np.abs(sites[:, 2]).min() == pytest.approx(spacing / 6)


def test_the_stem_of_the_tail_is_thin_and_the_head_low() -> None:
    """Both are lower than the trunk between them, the stem than the fin behind it; the trunk is narrow."""

    def extent(x: float, axis: int) -> float:
        line = np.tile([x, 0.021, 0.0], (1001, 1))
        line[:, axis] += np.linspace(-0.025, 0.025, 1001)
        found: float = np.ptp(line[FISH.distance(line) <= 0.0, axis])
        return found

    fin, stem, trunk, snout = (extent(x, 1) for x in (-0.065, -0.049, 0.0, 0.07))
    assert snout < 0.55 * trunk
    assert stem < 0.8 * trunk
    assert stem < 0.65 * fin
    assert extent(0.0, 2) < 0.6 * trunk
