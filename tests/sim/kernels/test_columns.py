"""Algebra of matrices in columns of four lanes, against NumPy."""
# ruff: noqa: ANN202  (the arguments of kernels are typed by the kernel compiler)

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import taichi as ti

from tests.sim.kernels import lanes
from zoobench.arrays import Array
from zoobench.sim.kernels import columns as algebra
from zoobench.sim.kernels.array_types import Rows, Scalars
from zoobench.sim.kernels.layout import add_columns, columns, put_columns

COUNT = 20


def _apply(function: Any, *, vectors: bool) -> Array:
    """The matrices that the function makes of each pair of `_matrices`."""

    @ti.kernel
    def kernel(a: Rows, b: Rows, found: Rows):
        for p in range(a.shape[2]):
            put_columns(found, 0, 0, p, 0, function(columns(a, 0, 0, p, 0), columns(b, 0, 0, p, 0)))

    given = lanes.tensors(64, *(lanes.columns(a) for a in (*_matrices(), np.zeros((COUNT, 3, 3)))))
    with lanes.compiled(vectors=vectors):
        kernel(*given)
    return lanes.matrices(given[2])


def _matrices() -> tuple[Array, Array]:
    """Random matrices, of which the first is singular."""
    a, b = np.random.default_rng(1).normal(size=(2, COUNT, 3, 3))
    a[0, 2] = a[0, 1]
    return a, b


@ti.func
def _transpose(a: ti.template(), _: ti.template()):
    return algebra.transpose(a)


@ti.func
def _scale(a: ti.template(), b: ti.template()):
    return algebra.scale(b.x[1], a)


@ti.func
def _diagonal(a: ti.template(), _: ti.template()):
    return algebra.diagonal(algebra.trace(a))


@ti.func
def _cofactor(a: ti.template(), _: ti.template()):
    return algebra.cofactor(a)


@ti.func
def _outer(a: ti.template(), b: ti.template()):
    return algebra.outer(a.y, b.z)


@ti.func
def _symmetric(a: ti.template(), _: ti.template()):
    return algebra.from_symmetric(algebra.to_symmetric(algebra.matmul_transposed(a, a)))


@ti.func
def _products(a: ti.template(), b: ti.template()):
    return algebra.matrix(algebra.matvec(a, b.x), algebra.transposed_matvec(a, b.y), algebra.cross(a.z, b.z))


@ti.func
def _numbers(a: ti.template(), b: ti.template()):
    return algebra.matrix(
        algebra.lanes(algebra.dot(a.x, b.x), algebra.contract(a, b), algebra.determinant(a), 0.0),
        algebra.spatial(a.x + 1.0),
        algebra.zero_lanes(),
    )


def _cofactors(a: Array) -> Array:
    x, y, z = np.moveaxis(a, 2, 0)
    return np.stack([np.cross(y, z), np.cross(z, x), np.cross(x, y)], axis=2)


def _numpy_products(a: Array, b: Array) -> Array:
    parts = (
        np.einsum("pij,pj->pi", a, b[:, :, 0]),
        np.einsum("pji,pj->pi", a, b[:, :, 1]),
        np.cross(a[:, :, 2], b[:, :, 2]),
    )
    return np.stack(parts, axis=2)


def _numpy_numbers(a: Array, b: Array) -> Array:
    numbers = np.stack([(a[:, :, 0] * b[:, :, 0]).sum(1), (a * b).sum((1, 2)), np.linalg.det(a)], axis=1)
    return np.stack([numbers, a[:, :, 0] + 1.0, 0.0 * numbers], axis=2)


CASES: dict[str, tuple[Any, Callable[[Array, Array], Array]]] = {
    "add": (algebra.add, lambda a, b: a + b),
    "scale": (_scale, lambda a, b: b[:, 1:2, :1] * a),
    "diagonal": (_diagonal, lambda a, _: np.trace(a, axis1=1, axis2=2)[:, None, None] * np.eye(3)),
    "matmul": (algebra.matmul, lambda a, b: a @ b),
    "transposed_matmul": (algebra.transposed_matmul, lambda a, b: np.swapaxes(a, 1, 2) @ b),
    "matmul_transposed": (algebra.matmul_transposed, lambda a, b: a @ np.swapaxes(b, 1, 2)),
    "transpose": (_transpose, lambda a, _: np.swapaxes(a, 1, 2)),
    "outer": (_outer, lambda a, b: np.einsum("pi,pj->pij", a[:, :, 1], b[:, :, 2])),
    "cofactor": (_cofactor, lambda a, _: _cofactors(a)),
    "symmetric": (_symmetric, lambda a, _: a @ np.swapaxes(a, 1, 2)),
    "products": (_products, _numpy_products),
    "numbers": (_numbers, _numpy_numbers),
}


@pytest.mark.parametrize("vectors", [True, pytest.param(False, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", list(CASES))
def test_operations_agree_with_numpy(name: str, vectors: bool) -> None:
    """Compiled to vectors or to scalars; the fourth lanes of what is stored are zero."""
    function, expected = CASES[name]
    assert np.abs(_apply(function, vectors=vectors) - expected(*_matrices())).max() <= 1e-14


def test_cofactor_is_the_derivative_of_the_determinant() -> None:
    """cof(a) = det(a) a^-T where a is regular."""
    a, _ = _matrices()
    expected = np.linalg.det(a[1:])[:, None, None] * np.swapaxes(np.linalg.inv(a[1:]), 1, 2)
    assert np.allclose(_apply(_cofactor, vectors=True)[1:], expected, rtol=1e-11, atol=1e-12)


@ti.kernel
def _accumulate(rows: Rows, a: Rows, count: Scalars):
    for p in range(rows.shape[2]):
        for _ in range(count[0]):
            add_columns(rows, 0, 0, p, 0, columns(a, 0, 0, p, 0))


def test_additions_to_stored_columns_add_up() -> None:
    """In every lane."""
    a, b = _matrices()
    given = lanes.tensors(64, lanes.columns(a), lanes.columns(b), np.array([3.0]))
    with lanes.compiled():
        _accumulate(given[0], given[1], given[2].int())
    assert np.abs(lanes.matrices(given[0]) - (a + 3 * b)).max() <= 1e-14
