"""Kernels that apply the constitutive laws and the linear algebra to arrays, so that tests can call them."""
# ruff: noqa: ANN201  (the arguments of kernels are typed by the kernel compiler)

import numpy as np
import taichi as ti
import torch

from zoobench.sim import runtime
from zoobench.sim.kernels.array_types import Matrices, Nodes, Pairs, Scalars, Vectors
from zoobench.sim.kernels.drift import (
    mean_ratio,
    mean_ratio_adjoint,
    returned_ratio,
    returned_ratio_adjoint,
    scatter_ratio,
    scatter_ratio_adjoint,
)
from zoobench.sim.kernels.elastic import fibre_stress, fibre_stress_adjoint, neo_hookean, neo_hookean_adjoint
from zoobench.sim.kernels.linalg import cofactor, eigen_symmetric, pack, sinhc, unpack
from zoobench.sim.kernels.media import (
    SNOW,
    hencky_update,
    hencky_update_adjoint,
    shear_rate,
    snow_update,
    snow_update_adjoint,
)
from zoobench.sim.kernels.shifting import dispersal, dispersal_adjoint
from zoobench.sim.kernels.water import crowding, crowding_adjoint, water_pressure, water_ratio, water_ratio_adjoint


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
def medium_all(
    b: Matrices, history: Scalars, b_new: Matrices, after: Scalars, stress: Matrices,
    c0: float, c1: float, c2: float, c3: float, c4: float, law: ti.template(),
):  # fmt: skip
    """Update of a solid medium."""
    for p in range(b.shape[0]):
        constants = ti.Vector([c0, c1, c2, c3, c4])
        if ti.static(law == SNOW):
            b_new[p], after[p], stress[p] = snow_update(b[p], history[p], constants)
        else:
            b_new[p], after[p], stress[p] = hencky_update(b[p], history[p], constants, law)


@ti.kernel
def medium_back_all(
    b: Matrices, history: Scalars, b_pull: Matrices, history_pull: Scalars, stress_pull: Matrices,
    back: Matrices, history_back: Scalars,
    c0: float, c1: float, c2: float, c3: float, c4: float, law: ti.template(),
):  # fmt: skip
    """Adjoint of the update."""
    for p in range(b.shape[0]):
        constants = ti.Vector([c0, c1, c2, c3, c4])
        if ti.static(law == SNOW):
            back[p], history_back[p] = snow_update_adjoint(
                b[p], history[p], b_pull[p], history_pull[p], stress_pull[p], constants
            )
        else:
            back[p], history_back[p] = hencky_update_adjoint(
                b[p], history[p], b_pull[p], history_pull[p], stress_pull[p], constants, law
            )


@ti.kernel
def water_all(J: Scalars, pressure: Scalars, slope: Scalars, bulk: float, exponent: float):
    """Kirchhoff pressure of water and its derivative."""
    for p in range(J.shape[0]):
        value, rise = water_pressure(J[p], ti.Vector([0.0, bulk, exponent, 0.0, 0.0]))
        pressure[p] = value
        slope[p] = rise


@ti.kernel
def water_ratio_all(
    J: Scalars, growth: Scalars, crowd: Scalars, pull: Scalars,
    after: Scalars, J_back: Scalars, growth_back: Scalars, crowd_back: Scalars, share: float,
):  # fmt: skip
    """New volume ratio of water and the adjoints for the pull."""
    for p in range(J.shape[0]):
        after[p] = water_ratio(J[p], growth[p], crowd[p], share)
        J_back[p], growth_back[p], crowd_back[p] = water_ratio_adjoint(J[p], growth[p], crowd[p], share, pull[p])


@ti.kernel
def ratios_all(
    ratios: Pairs, ratios_back: Pairs, x: Vectors, J: Scalars, pull: Scalars,
    after: Scalars, x_back: Vectors, J_back: Scalars, share: float, h: float, mass: float, width: ti.template(),
):  # fmt: skip
    """J of particles of water after its return to the mean around, and the adjoints for the pull."""
    ti.loop_config(serialize=True)
    for p in range(x.shape[0]):
        scatter_ratio(ratios, 0, x[p], J[p], mass, 1.0 / h, width)
    for p in range(x.shape[0]):
        mean = mean_ratio(ratios, 0, x[p], J[p], 1.0 / h, width)
        after[p] = returned_ratio(J[p], mean, share)
        J_back[p], mean_pull = returned_ratio_adjoint(J[p], mean, share, pull[p])
        x_back[p] = mean_ratio_adjoint(ratios, ratios_back, 0, x[p], mean, mean_pull, 1.0 / h, width)
    for p in range(x.shape[0]):
        place_pull, J_pull, _ = scatter_ratio_adjoint(ratios_back, 0, x[p], J[p], mass, 1.0 / h, width)
        x_back[p] += place_pull
        J_back[p] += J_pull


@ti.kernel
def crowding_all(
    grid: Nodes, grid_back: Nodes, x: Vectors, pull: Scalars, crowd: Scalars, x_back: Vectors, h: float, density: float,
    width: ti.template(),
):  # fmt: skip
    """Density around places over that at rest, and the adjoints for the pull."""
    ti.loop_config(serialize=True)
    for p in range(x.shape[0]):
        crowd[p] = crowding(grid, 0, x[p], 1.0 / h, density, width)
        x_back[p] = crowding_adjoint(grid, grid_back, 0, x[p], crowd[p], pull[p], 1.0 / h, density, width)


@ti.kernel
def dispersal_all(
    grid: Nodes, grid_back: Nodes, x: Vectors, J: Scalars, crowd: Scalars, pull: Vectors,
    shift: Vectors, x_back: Vectors, J_back: Scalars, crowd_back: Scalars, share: float, h: float,
    width: ti.template(),
):  # fmt: skip
    """Shifts out of a crowd, and the adjoints for the pull."""
    ti.loop_config(serialize=True)
    for p in range(x.shape[0]):
        shift[p] = dispersal(grid, 0, x[p], J[p], crowd[p], share, 1.0 / h, width)
        x_back[p], J_back[p], crowd_back[p] = dispersal_adjoint(
            grid, grid_back, 0, x[p], J[p], crowd[p], share, pull[p], 1.0 / h, width
        )


@ti.kernel
def shear_rate_all(C: Matrices, rate: Matrices):
    """What the viscosity acts on."""
    for p in range(C.shape[0]):
        rate[p] = shear_rate(C[p])


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


def relative(found: np.ndarray, expected: np.ndarray, scale: float | np.ndarray) -> float:
    """Largest error of a tensor relative to its norm, or to the law's own scale where that is larger."""
    axes = tuple(range(1, expected.ndim))
    size = np.maximum(np.sqrt(np.square(expected).sum(axes)), scale)
    return float((np.abs(found - expected).max(axes) / size).max())
