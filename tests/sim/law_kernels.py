"""Kernels that apply the constitutive laws and the linear algebra to arrays, so that tests can call them."""
# ruff: noqa: ANN201  (the arguments of kernels are typed by the kernel compiler)

import numpy as np
import taichi as ti
import torch

from zoobench.sim import runtime
from zoobench.sim.array_types import Matrices, Scalars, Vectors
from zoobench.sim.linalg import cofactor, eigen_symmetric, pack, sinhc, unpack
from zoobench.sim.materials import (
    fibre_stress,
    fibre_stress_adjoint,
    neo_hookean,
    neo_hookean_adjoint,
    sand_update,
    sand_update_adjoint,
)


@ti.kernel
def neo_hookean_all(F: Matrices, pull: Matrices, stress: Matrices, back: Matrices, mu: float, lam: float):
    """Neo-Hookean stress and the adjoint for the pull."""
    for p in range(F.shape[0]):
        stress[p] = neo_hookean(F[p], mu, lam)
        back[p] = neo_hookean_adjoint(F[p], pull[p], mu, lam)


@ti.kernel
def fibre_all(
    F: Matrices, fibre: Vectors, pull: Matrices, stress: Matrices,
    F_back: Matrices, tension_back: Scalars, fibre_back: Vectors, tension: float,
):  # fmt: skip
    """Active stress and the adjoints for the pull."""
    for p in range(F.shape[0]):
        stress[p] = fibre_stress(F[p], tension, fibre[p])
        more, along, turned = fibre_stress_adjoint(F[p], pull[p], tension, fibre[p])
        F_back[p] = more
        tension_back[p] = along
        fibre_back[p] = turned


@ti.kernel
def sand_all(
    b: Matrices, surplus: Scalars, b_new: Matrices, left: Scalars, stress: Matrices,
    mu: float, lam: float, slope: float,
):  # fmt: skip
    """Plastic return of sand."""
    for p in range(b.shape[0]):
        elastic, rest, tau = sand_update(b[p], surplus[p], mu, lam, slope)
        b_new[p] = elastic
        left[p] = rest
        stress[p] = tau


@ti.kernel
def sand_back_all(
    b: Matrices, surplus: Scalars, b_pull: Matrices, surplus_pull: Scalars, stress_pull: Matrices,
    back: Matrices, surplus_back: Scalars, mu: float, lam: float, slope: float,
):  # fmt: skip
    """Adjoint of the plastic return."""
    for p in range(b.shape[0]):
        pull, rest = sand_update_adjoint(b[p], surplus[p], b_pull[p], surplus_pull[p], stress_pull[p], mu, lam, slope)
        back[p] = pull
        surplus_back[p] = rest


@ti.kernel
def eigen_all(a: Matrices, values: Vectors, frames: Matrices):
    """Eigenvalues and eigenvectors."""
    for p in range(a.shape[0]):
        squares, frame = eigen_symmetric(a[p])
        values[p] = squares
        frames[p] = frame


@ti.kernel
def algebra_all(a: Matrices, cofactors: Matrices, repacked: Matrices):
    """Cofactors, and the symmetric matrix after packing and unpacking."""
    for p in range(a.shape[0]):
        cofactors[p] = cofactor(a[p])
        repacked[p] = unpack(pack(a[p]))


@ti.kernel
def sinhc_all(x: Scalars, y: Scalars):
    """sinh(x) / x."""
    for p in range(x.shape[0]):
        y[p] = sinhc(x[p])


def tensors(precision: int, *arrays: np.ndarray) -> list[torch.Tensor]:
    """The arrays in the precision, with the runtime made ready for it."""
    runtime.start(precision)
    return [torch.as_tensor(np.ascontiguousarray(a)).to(runtime.real(precision)).clone() for a in arrays]


def symmetric(a: np.ndarray) -> np.ndarray:
    """Its symmetric part."""
    part: np.ndarray = 0.5 * (a + np.swapaxes(a, -1, -2))
    return part
