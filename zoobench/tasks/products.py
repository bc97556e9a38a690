"""Products and eigenvectors of small matrices whose rounding no library decides.

BLAS and LAPACK choose their code by the processor's make, so that equal inputs give other last digits elsewhere. Sums,
products and roots of single numbers are rounded in the same way on every processor, and here they have one order.
"""

import math
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from zoobench.arrays import Array

if TYPE_CHECKING:
    from torch import Tensor

_SWEEPS = 8
"""Always so many, that the rounding of one matrix does not depend on the others; six reach the last digit for n = 4."""


_FEW = 4
"""Up to so many matrices are faster done one by one without NumPy: the bits are the same."""


def matmul(one: "Tensor", other: "Tensor") -> "Tensor":
    """The product of matrices `[..., n, m]` and `[..., m, k]`, `[..., n, k]`; differentiable."""
    product: Tensor = (one[..., :, :, None] * other[..., None, :, :]).sum(dim=-2)
    return product


def symmetric_eigen(matrices: Array) -> tuple[Array, Array]:
    """Eigenvalues `[..., n]`, ascending, and unit eigenvectors as columns `[..., n, n]` of symmetric matrices.

    By cyclic Jacobi rotations (Golub and Van Loan 2013, algorithm 8.5.3), for n of a few.
    """
    size = np.shape(matrices)[-1]
    if np.size(matrices) <= _FEW * size * size:
        found = [_eigen_of_one(matrix) for matrix in np.reshape(matrices, (-1, size, size)).swapaxes(-1, -2).tolist()]
        every_value, every_vector = zip(*found, strict=True)
        return np.reshape(every_value, np.shape(matrices)[:-1]), np.reshape(every_vector, np.shape(matrices))
    # the matrix, and below it the product of all rotations, whose columns turn with those of the matrix
    table = np.concatenate([matrices, np.broadcast_to(np.eye(size), np.shape(matrices))], axis=-2)
    matrix = table[..., :size, :]
    for _ in range(_SWEEPS):
        for p, q in combinations(range(size), 2):
            turn = _rotation(matrix[..., p, p], matrix[..., q, q], matrix[..., p, q])
            _mix(table, p, q, *turn)
            _mix(matrix.swapaxes(-1, -2), p, q, *turn)
    values = np.diagonal(matrix, axis1=-2, axis2=-1)
    order = np.argsort(values, axis=-1, kind="stable")
    return np.take_along_axis(values, order, -1), np.take_along_axis(table[..., size:, :], order[..., None, :], -1)


def _eigen_of_one(columns: list[list[float]]) -> tuple[list[float], list[list[float]]]:
    """As `symmetric_eigen`, of one matrix, by the same operations on single numbers."""
    size = len(columns)
    table = [[*column, *(float(row == n) for row in range(size))] for n, column in enumerate(columns)]
    for _ in range(_SWEEPS):
        for p, q in combinations(range(size), 2):
            one, other = table[p], table[q]
            apart, off_diagonal = other[q] - one[p], other[p]
            length = abs(apart) + math.sqrt(apart * apart + 4.0 * off_diagonal * off_diagonal)
            tangent = (-2.0 if apart < 0.0 else 2.0) * off_diagonal / (length if length > 0.0 else 1.0)
            cosine = 1.0 / math.sqrt(1.0 + tangent * tangent)
            sine = tangent * cosine
            pairs = list(zip(one, other, strict=True))
            table[p] = [cosine * a - sine * b for a, b in pairs]
            table[q] = [sine * a + cosine * b for a, b in pairs]
            for column in table:
                a, b = column[p], column[q]
                column[p], column[q] = cosine * a - sine * b, sine * a + cosine * b
    values = [column[n] for n, column in enumerate(table)]
    order = np.argsort(values, kind="stable").tolist()
    return [values[n] for n in order], [[table[n][size + row] for n in order] for row in range(size)]


def _rotation(first: Array, second: Array, off_diagonal: Array) -> tuple[Array, Array]:
    """Cosine and sine, `[..., 1]` each, of the smaller rotation that removes an off-diagonal element `[...]`."""
    apart = second - first
    # tan t = sign(d) 2 b / (|d| + sqrt(d^2 + 4 b^2)), of diagonal elements d apart and an off-diagonal b
    length = np.abs(apart) + np.sqrt(apart * apart + 4.0 * off_diagonal * off_diagonal)
    tangent = np.where(apart < 0.0, -2.0, 2.0) * off_diagonal / np.where(length > 0.0, length, 1.0)
    cosine = 1.0 / np.sqrt(1.0 + tangent * tangent)
    return cosine[..., None], (tangent * cosine)[..., None]


def _mix(columns: Array, p: int, q: int, cosine: Array, sine: Array) -> None:
    """Rotate columns p and q of matrices in place."""
    one, other = columns[..., p].copy(), columns[..., q].copy()
    columns[..., p] = cosine * one - sine * other
    columns[..., q] = sine * one + cosine * other
