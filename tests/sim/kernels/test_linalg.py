"""Small dense algebra against NumPy."""

import numpy as np
import pytest

from tests.sim.kernels.law_kernels import algebra_all, eigen_all, sinhc_all, symmetric, tensors


def _cases() -> np.ndarray:
    """Random, degenerate and nearly degenerate positive matrices, and the identity."""
    rng = np.random.default_rng(1)
    turns = np.linalg.qr(rng.normal(size=(60, 3, 3)))[0]
    spectra = np.exp(rng.normal(size=(60, 3)))
    spectra[10:20, 1] = spectra[10:20, 0]
    spectra[20:30] = spectra[20:30, :1]
    spectra[30:40, 1] = spectra[30:40, 0] * (1 + 1e-9)
    spectra[40:50] = 1 + 1e-12 * rng.normal(size=(10, 3))
    full = np.einsum("pij,pj,pkj->pik", turns, spectra, turns)
    return symmetric(np.concatenate([full, [np.eye(3), np.diag([2.0, 1.0, 2.0]), np.diag([3.0, 1.0, 2.0])]]))


@pytest.mark.parametrize(("precision", "tolerance"), [(64, 1e-14), (32, 2e-6)])
def test_eigen_decomposition_agrees_with_lapack(precision: int, tolerance: float) -> None:
    """Eigenvalues, orthogonality and the matrix put together again, where eigenvalues meet too."""
    a, values, frames = tensors(precision, _cases(), np.zeros((63, 3)), np.zeros((63, 3, 3)))
    eigen_all(a, values, frames)
    matrix, w, u = (t.double().numpy() for t in (a, values, frames))
    scale = np.abs(matrix).max((1, 2))
    assert (np.abs(np.sort(w) - np.linalg.eigvalsh(matrix)).max(1) <= tolerance * scale).all()
    assert np.abs(np.swapaxes(u, 1, 2) @ u - np.eye(3)).max() <= tolerance
    together = np.einsum("pij,pj,pkj->pik", u, w, u)
    assert (np.abs(together - matrix).max((1, 2)) <= tolerance * scale).all()


def test_cofactor_and_packing() -> None:
    """cof(a) = det(a) a^-T, finite for singular a; packing keeps symmetric matrices as they are."""
    rng = np.random.default_rng(2)
    general = rng.normal(size=(20, 3, 3))
    general[0, 2] = general[0, 1]
    a, cofactors, _ = tensors(64, general, 0 * general, 0 * general)
    algebra_all(a, cofactors, a.clone())
    expected = np.linalg.det(general[1:])[:, None, None] * np.swapaxes(np.linalg.inv(general[1:]), 1, 2)
    assert np.allclose(cofactors.numpy()[1:], expected, rtol=1e-11, atol=1e-12)
    assert np.isfinite(cofactors.numpy()).all()
    even, unused, repacked = tensors(64, symmetric(general), 0 * general, 0 * general)
    algebra_all(even, unused, repacked)
    assert np.array_equal(repacked.numpy(), even.numpy())


def test_sinhc_is_smooth_through_zero() -> None:
    """sinh(x) / x to round-off on both sides of the switch to the series, 1 at 0."""
    x = np.concatenate([[0.0, 1e-300, -1e-9, 1e-5], np.linspace(-0.2, 0.2, 401), [-3.0, 5.0]])
    given, found = tensors(64, x, 0 * x)
    sinhc_all(given, found)
    safe = np.where(x == 0, 1.0, x)
    assert np.abs(found.numpy() / np.where(x == 0, 1.0, np.sinh(safe) / safe) - 1).max() <= 1e-14
