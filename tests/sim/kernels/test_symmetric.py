"""Algebra and eigenvectors of symmetric matrices stored as six numbers, against NumPy."""

import numpy as np
import pytest

from tests.sim.kernels.lanes import symmetric, tensors
from tests.sim.kernels.law_kernels import eigen_all, packed, sinhc_all, symmetric_all, unpacked


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


@pytest.mark.parametrize(("precision", "tolerance"), [(64, 1e-14), pytest.param(32, 2e-6, marks=pytest.mark.slow)])
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


@pytest.mark.parametrize("size", [1e-9, 1e-3, 1.0, 1e6])
def test_eigenvectors_are_those_of_the_deviator(size: float) -> None:
    """However small it is beside the trace, which a 64-bit number still resolves to 1e-16 of the trace."""
    cases = np.eye(3) + size * (_cases() - np.eye(3))
    a, values, frames = tensors(64, cases, np.zeros((63, 3)), np.zeros((63, 3, 3)))
    eigen_all(a, values, frames)
    matrix, u = a.numpy(), frames.numpy()
    inner = np.swapaxes(u, 1, 2) @ matrix @ u
    off_diagonal = np.abs(inner - np.einsum("pii,ij->pij", inner, np.eye(3)) * np.eye(3))
    assert (off_diagonal.max((1, 2)) <= 2e-14 * np.abs(matrix).max((1, 2))).all()


def test_algebra_of_six_numbers() -> None:
    """Squares, a b + b a, cofactors, invariants, contractions and deviators are those of the matrices."""
    rng = np.random.default_rng(3)
    a, b = (symmetric(rng.normal(size=(30, 3, 3))) for _ in range(2))
    found = tensors(64, packed(a), packed(b), *(np.zeros((30, 6)) for _ in range(4)), np.zeros((30, 3)), np.zeros(30))
    symmetric_all(*found)
    squares, products, cofactors, deviators = (unpacked(t.numpy()) for t in found[2:6])
    det, trace = np.linalg.det(a), np.trace(a, axis1=1, axis2=2)
    expected = (
        a @ a,
        a @ b + b @ a,
        det[:, None, None] * np.linalg.inv(a),
        a - trace[:, None, None] / 3 * np.eye(3),
    )
    for one, other in zip((squares, products, cofactors, deviators), expected, strict=True):
        assert np.allclose(one, other, rtol=1e-12, atol=1e-12)
    second = 0.5 * (trace**2 - np.trace(a @ a, axis1=1, axis2=2))
    assert np.allclose(found[6].numpy(), np.stack([trace, second, det], 1), rtol=1e-12, atol=1e-12)
    assert np.allclose(found[7].numpy(), (a * b).sum((1, 2)), rtol=1e-12, atol=1e-12)


def test_sinhc_is_smooth_through_zero() -> None:
    """sinh(x) / x to round-off on both sides of the switch to the series, 1 at 0."""
    x = np.concatenate([[0.0, 1e-300, -1e-9, 1e-5], np.linspace(-0.2, 0.2, 401), [-3.0, 5.0]])
    given, found = tensors(64, x, 0 * x)
    sinhc_all(given, found)
    safe = np.where(x == 0, 1.0, x)
    assert np.abs(found.numpy() / np.where(x == 0, 1.0, np.sinh(safe) / safe) - 1).max() <= 1e-14
