"""Small dense algebra against NumPy."""

import numpy as np

from tests.sim.kernels.law_kernels import algebra_all, sinhc_all, symmetric, tensors


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
