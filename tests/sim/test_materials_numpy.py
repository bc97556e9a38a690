"""The NumPy laws are the derivatives of their energies: tau = dPsi/dF F^T."""

from collections.abc import Callable

import numpy as np
import pytest

from zoobench.sim import materials_numpy as laws
from zoobench.sim.scene import lame_parameters

MU, LAM = lame_parameters(1e4, 0.3)
FIBRE = np.array([0.6, 0.0, 0.8])


def _hencky(F: np.ndarray) -> np.ndarray:
    return laws.hencky_energy(0.5 * np.log(np.linalg.eigvalsh(F @ np.swapaxes(F, -1, -2))), MU, LAM)


def _compressed(F: np.ndarray) -> np.ndarray:
    """Sand stress; a wide cone and strong pressure keep every state elastic."""
    b = F @ np.swapaxes(F, -1, -2)
    elastic, _, stress = laws.sand_update(b, np.zeros(len(F)), MU, LAM, 10.0)
    assert np.allclose(elastic, b, rtol=1e-10)
    return stress


LAWS: dict[str, tuple[Callable[[np.ndarray], np.ndarray], Callable[[np.ndarray], np.ndarray]]] = {
    "neo-hookean": (lambda F: laws.neo_hookean_energy(F, MU, LAM), lambda F: laws.neo_hookean(F, MU, LAM)),
    "fibre": (lambda F: laws.fibre_energy(F, 700.0, FIBRE), lambda F: laws.fibre_stress(F, 700.0, FIBRE)),
    "hencky": (_hencky, _compressed),
}


@pytest.mark.parametrize("name", LAWS)
def test_stress_is_the_derivative_of_the_energy(name: str) -> None:
    """To 1e-6 by central differences in all nine components of F."""
    energy, stress = LAWS[name]
    rng = np.random.default_rng(1)
    F = 0.8 * np.eye(3) + 0.05 * rng.normal(size=(50, 3, 3))
    derivative = np.zeros_like(F)
    e = 1e-6
    for i in range(3):
        for j in range(3):
            step = np.zeros((3, 3))
            step[i, j] = e
            derivative[:, i, j] = (energy(F + step) - energy(F - step)) / (2 * e)
    expected = derivative @ np.swapaxes(F, 1, 2)
    assert np.abs(stress(F) - expected).max() <= 1e-6 * np.abs(expected).max()


def test_drucker_prager_keeps_what_it_is_told_to() -> None:
    """The ratio kept is 1 inside the cone, below 1 outside and 0 when loose; every case by hand."""
    slope, mu, lam = 0.5, 1.0, 1.0
    strain = np.array([[-0.1, -0.1, -0.1], [0.2, -0.1, -0.25], [0.1, 0.1, 0.1]])
    elastic, left, keep = laws.drucker_prager(strain, np.array([0.0, 0.0, 0.02]), mu, lam, slope)
    # cone: |dev| <= -0.5 (3 + 2) / 2 tr
    size = np.linalg.norm(strain[1] - strain[1].mean())
    assert keep == pytest.approx([1.0, 1.25 * 0.15 / size, 0.0])
    assert keep[1] < 1.0
    assert elastic[0] == pytest.approx(strain[0])
    assert elastic.sum(1) == pytest.approx([-0.3, -0.15, 0.0])
    assert left == pytest.approx([0.0, 0.0, 0.32])
