"""The power series of the laws against the functions themselves, and their adjoint against exact derivatives."""

import math

import numpy as np
import pytest

from tests.sim.kernels.lanes import rounded, symmetric, tensors
from tests.sim.kernels.law_kernels import packed, series_all, unpacked
from zoobench.sim.kernels.power_series import NEAR

# each function without its value at 0, and the numbers of its series
FUNCTIONS = {
    "logarithm": (lambda x: 0.5 * np.log1p(x), lambda k: 0.5 * (-1) ** (k + 1) / k if k else 0.0),
    "root": (
        lambda x: np.expm1(0.5 * np.log1p(x)),
        lambda k: math.prod((1.5 - i) / i for i in range(1, k + 1)) if k else 0.0,
    ),
    "exponential": (np.expm1, lambda k: 1.0 / math.factorial(k)),
}
EVERY_FUNCTION = pytest.mark.parametrize("name", FUNCTIONS)
PRECISIONS = pytest.mark.parametrize(
    ("precision", "rounding"), [(64, 2.2e-16), pytest.param(32, 1.2e-7, marks=pytest.mark.slow)]
)


def _matrices(size: float, count: int = 200) -> np.ndarray:
    """Symmetric matrices of this Frobenius norm: random, diagonal, of rank one and multiples of I."""
    rng = np.random.default_rng(7)
    a = symmetric(rng.normal(size=(count, 3, 3)))
    a[:40] *= np.eye(3)
    vectors = rng.normal(size=(20, 3))
    a[40:60] = vectors[:, :, None] * vectors[:, None, :] * rng.choice([-1, 1], (20, 1, 1))
    a[60], a[61] = np.eye(3), -np.eye(3)
    scaled: np.ndarray = size * a / np.linalg.norm(a, axis=(1, 2))[:, None, None]
    return scaled


@PRECISIONS
@EVERY_FUNCTION
def test_series_is_exact_to_rounding(name: str, precision: int, rounding: float) -> None:
    """From 1e-8 to the largest strains that it is used for, in units of the largest of its terms."""
    function, _ = FUNCTIONS[name]
    for size in (1e-8, 1e-4, 1e-2, NEAR):
        (E,) = rounded(precision, _matrices(size))
        given = tensors(precision, packed(E), packed(E), 0 * packed(E), 0 * packed(E))
        series_all(*given, name)
        found = unpacked(given[2].double().numpy())
        values, frames = np.linalg.eigh(E)
        expected = np.einsum("pij,pj,pkj->pik", frames, function(values), frames)
        largest = size
        if name == "exponential":
            expected, largest = expected + np.eye(3), 1.0
        # what rounding and the first term left out leave
        assert np.abs(found - expected).max() <= 4 * rounding * largest + 0.5 * rounding * (size / NEAR) ** 6


@EVERY_FUNCTION
def test_adjoint_of_the_series_is_exact(name: str) -> None:
    """f of the block matrix (E V; 0 E) has the derivative of f along V in its corner (Higham 2008, theorem 3.6)."""
    _, number = FUNCTIONS[name]
    rng = np.random.default_rng(8)
    for size in (1e-6, 1e-2, NEAR):
        E = _matrices(size)
        V, adjoint = (symmetric(rng.normal(size=E.shape)) for _ in range(2))
        given = tensors(64, packed(E), packed(adjoint), 0 * packed(E), 0 * packed(E))
        series_all(*given, name)
        block = np.block([[E, V], [0 * E, E]])
        total, power = np.zeros_like(block), np.broadcast_to(np.eye(6), block.shape)
        for k in range(30):
            total, power = total + number(k) * power, power @ block
        derivative = total[:, :3, 3:]
        exact, found = (derivative * adjoint).sum((1, 2)), (unpacked(given[3].numpy()) * V).sum((1, 2))
        assert np.abs(found - exact).max() <= 1e-13
