"""The rig of the validation cases."""

import numpy as np
import pytest

from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.rest_cells import RestCells
from zoobench_verify.validate.rig import lattice, node_masses, passive_body

_MATTER = ElasticMaterial(youngs_modulus=1e4, poissons_ratio=0.2, density=1000.0)


def test_nodes_in_the_rest_frame_have_the_mass_and_the_centre_of_the_particles() -> None:
    """Of a block of one and a half cells, whose density differs from particle to particle."""
    points = lattice((0.0, 0.0, 0.0), (0.15, 0.1, 0.1), 0.05)
    masses = np.random.default_rng(1).uniform(0.5, 1.5, len(points))
    cells = RestCells.of(passive_body(_MATTER, points, 0.05**3), Fidelity(0.1, robot="lagrangian"))
    found = node_masses(cells, masses)
    assert found.sum() == pytest.approx(masses.sum(), rel=1e-12)
    assert found @ cells.places == pytest.approx(masses @ points, rel=1e-12)
