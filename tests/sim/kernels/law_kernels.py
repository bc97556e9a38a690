"""Kernels that apply the constitutive laws and the linear algebra to arrays, so that tests can call them."""
# ruff: noqa: ANN001, ANN201, ANN202  (the arguments of kernels are typed by the kernel compiler)

import numpy as np
import taichi as ti

from zoobench.sim.kernels.array_types import Rows, Scalars
from zoobench.sim.kernels.columns import lanes, matrix, to_symmetric
from zoobench.sim.kernels.laws.media import shear_rate
from zoobench.sim.kernels.layout import by_name, while_compiling
from zoobench.sim.kernels.power_series import (
    EXPONENTIAL,
    HALF_LOGARITHM,
    ROOT,
    by_precision,
    series,
    series_adjoint,
)
from zoobench.sim.kernels.symmetric import (
    both_products,
    cofactors,
    deviator,
    double_dot,
    eigen_symmetric,
    invariants,
    sinhc,
    square,
    unit,
)

Vectors = ti.types.ndarray(dtype=ti.types.vector(3, float))
Matrices = ti.types.ndarray(dtype=ti.types.matrix(3, 3, float))
Symmetric = ti.types.ndarray(dtype=ti.types.vector(6, float))


@while_compiling
def medium_of(constants, law):
    """The constants of a medium by name."""
    return ti.Struct(**by_name(constants, law.constants))


@ti.func
def unpack(stored):
    """The symmetric matrix stored as (xx yy zz xy xz yz)."""
    xx, yy, zz, xy, xz, yz = stored[0], stored[1], stored[2], stored[3], stored[4], stored[5]
    return ti.Matrix([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


@ti.func
def pack(a):
    """A symmetric matrix as (xx yy zz xy xz yz)."""
    return ti.Vector([a[0, 0], a[1, 1], a[2, 2], a[0, 1], a[0, 2], a[1, 2]])


@ti.kernel
def medium_all(
    b: Matrices, history: Scalars, b_new: Matrices, after: Scalars, stress: Matrices,
    constants: Scalars, law: ti.template(),
):  # fmt: skip
    """Update of a solid medium."""
    for p in range(b.shape[0]):
        medium = medium_of(constants, law)
        trial = pack(b[p])
        packed, kept, tau = law.update(trial, history[p], medium, law)
        b_new[p], after[p], stress[p] = unpack(packed), kept, unpack(tau)


@ti.kernel
def medium_back_all(
    b: Matrices, history: Scalars, b_adjoint: Matrices, new_history_adjoint: Scalars, stress_adjoint: Matrices,
    trial_adjoint: Matrices, history_adjoint: Scalars,
    constants: Scalars, law: ti.template(),
):  # fmt: skip
    """Adjoint of the update."""
    for p in range(b.shape[0]):
        medium = medium_of(constants, law)
        trial, first, second = pack(b[p]), pack(b_adjoint[p]), pack(stress_adjoint[p])
        packed, past = law.update_adjoint(trial, history[p], first, new_history_adjoint[p], second, medium, law)
        trial_adjoint[p], history_adjoint[p] = unpack(packed), past


@ti.func
def _join(lanes: ti.template(), p):
    first, second = lanes[p, 0], lanes[p, 1]
    return ti.Vector([first[0], first[1], first[2], first[3], second[0], second[1]]), second[2]


@ti.kernel
def medium_native(
    state: Rows, adjoint: Rows, stress_adjoint: Rows, new: Rows, stress: Rows, back: Rows,
    constants: Scalars, law: ti.template(),
):  # fmt: skip
    """The update and its adjoint from arrays of four lanes, `[particles, 2]`: six numbers of a tensor and one more."""
    for p in range(state.shape[0]):
        medium = medium_of(constants, law)
        trial, history = _join(state, p)
        b_adjoint, left_adjoint = _join(adjoint, p)
        tau_adjoint, _ = _join(stress_adjoint, p)
        b, left, tau = law.update(trial, history, medium, law)
        trial_adjoint, history_adjoint = law.update_adjoint(
            trial, history, b_adjoint, left_adjoint, tau_adjoint, medium, law
        )
        new[p, 0], new[p, 1] = ti.Vector([b[0], b[1], b[2], b[3]]), ti.Vector([b[4], b[5], left, 0.0])
        stress[p, 0], stress[p, 1] = ti.Vector([tau[0], tau[1], tau[2], tau[3]]), ti.Vector([tau[4], tau[5], 0.0, 0.0])
        a = trial_adjoint
        back[p, 0], back[p, 1] = ti.Vector([a[0], a[1], a[2], a[3]]), ti.Vector([a[4], a[5], history_adjoint, 0.0])


@ti.kernel
def water_all(J: Scalars, pressure: Scalars, derivative: Scalars, constants: Scalars, law: ti.template()):
    """Kirchhoff pressure of water and its derivative."""
    for p in range(J.shape[0]):
        value, rise = law.pressure(J[p], medium_of(constants, law))
        pressure[p] = value
        derivative[p] = rise


@ti.kernel
def shear_rate_all(C: Matrices, rate: Matrices):
    """Deviatoric strain rate, on which the viscosity acts."""
    for p in range(C.shape[0]):
        c = [lanes(C[p][0, j], C[p][1, j], C[p][2, j], 0.0) for j in ti.static(range(3))]
        rate[p] = unpack(to_symmetric(shear_rate(matrix(c[0], c[1], c[2]))))


@ti.kernel
def eigen_all(a: Matrices, values: Vectors, frames: Matrices):
    """Eigenvalues and eigenvectors."""
    for p in range(a.shape[0]):
        squares, frame = eigen_symmetric(pack(a[p]))
        values[p] = squares
        frames[p] = frame


@ti.kernel
def symmetric_all(
    a: Symmetric, b: Symmetric, squares: Symmetric, products: Symmetric, cofs: Symmetric, deviators: Symmetric,
    numbers: Vectors, contractions: Scalars,
):  # fmt: skip
    """Algebra of symmetric matrices."""
    for p in range(a.shape[0]):
        squares[p] = square(a[p])
        products[p] = both_products(a[p], b[p])
        cofs[p] = cofactors(a[p])
        deviators[p] = deviator(a[p])
        numbers[p] = invariants(a[p])
        contractions[p] = double_dot(a[p], b[p])


SERIES = {"logarithm": HALF_LOGARITHM, "root": ROOT, "exponential": EXPONENTIAL}


@ti.kernel
def series_all(E: Symmetric, adjoint: Symmetric, values: Symmetric, back: Symmetric, name: ti.template()):
    """A power series and its adjoint."""
    for p in range(E.shape[0]):
        E2, inv = square(E[p]), invariants(E[p])
        c = series(inv, ti.static(by_precision(SERIES[name])))
        values[p] = c[0] * unit() + c[1] * E[p] + c[2] * E2
        back[p] = series_adjoint(E[p], E2, inv, ti.static(by_precision(SERIES[name])), adjoint[p])


@ti.kernel
def sinhc_all(x: Scalars, y: Scalars):
    """sinh(x) / x."""
    for p in range(x.shape[0]):
        y[p] = sinhc(x[p])


def packed(a: np.ndarray) -> np.ndarray:
    """Symmetric matrices as six numbers each."""
    six: np.ndarray = a[:, [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    return six


def unpacked(six: np.ndarray) -> np.ndarray:
    """The matrices of `packed`."""
    matrices: np.ndarray = six[:, [[0, 3, 4], [3, 1, 5], [4, 5, 2]]]
    return matrices
