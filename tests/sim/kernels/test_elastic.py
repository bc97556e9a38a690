"""The kernels' constitutive laws against their NumPy twins, and their adjoints against differences."""
# ruff: noqa: ANN201  (the arguments of kernels are typed by the kernel compiler)

import numpy as np
import pytest
import taichi as ti

from tests.sim.kernels import lanes
from tests.sim.kernels.lanes import relative, rounded, symmetric
from zoobench.sim.kernels.array_types import Rows, Scalars
from zoobench.sim.kernels.elastic import (
    SMALLEST_J,
    fibre_stress,
    fibre_stress_adjoint,
    neo_hookean,
    neo_hookean_adjoint,
    viscous,
)
from zoobench.sim.kernels.layout import columns, put_columns
from zoobench.sim.model.laws import elastic as twins
from zoobench.sim.model.laws.elastic import lame_parameters

MU, LAM = lame_parameters(1e4, 0.3)
PRECISIONS = pytest.mark.parametrize(
    ("precision", "tolerance"), [(64, 1e-12), pytest.param(32, 1e-6, marks=pytest.mark.slow)]
)


@ti.kernel
def neo_hookean_all(F: Rows, adjoint: Rows, stress: Rows, back: Rows, mu: float, lam: float):
    """Neo-Hookean stress and its adjoint by F."""
    for p in range(F.shape[2]):
        deformation = columns(F, 0, 0, p, 0)
        put_columns(stress, 0, 0, p, 0, neo_hookean(deformation, mu, lam))
        put_columns(back, 0, 0, p, 0, neo_hookean_adjoint(deformation, columns(adjoint, 0, 0, p, 0), mu, lam))


@ti.kernel
def fibre_all(
    F: Rows, fibre: Rows, adjoint: Rows, stress: Rows, F_adjoint: Rows, fibre_adjoint: Rows, tension_adjoint: Scalars,
    tension: float,
):  # fmt: skip
    """Active stress and its adjoints."""
    for p in range(F.shape[2]):
        deformation = columns(F, 0, 0, p, 0)
        put_columns(stress, 0, 0, p, 0, fibre_stress(deformation, tension, fibre[p]))
        more, along, turned = fibre_stress_adjoint(deformation, columns(adjoint, 0, 0, p, 0), tension, fibre[p])
        put_columns(F_adjoint, 0, 0, p, 0, more)
        tension_adjoint[p] = along
        fibre_adjoint[p] = turned


@ti.kernel
def viscous_all(C: Rows, stress: Rows, eta: float):
    """Viscous stress."""
    for p in range(C.shape[2]):
        put_columns(stress, 0, 0, p, 0, viscous(columns(C, 0, 0, p, 0), eta))


def _deformations(count: int = 200, seed: int = 1) -> np.ndarray:
    rng = np.random.default_rng(seed)
    F = np.eye(3) + 0.3 * rng.normal(size=(3 * count, 3, 3))
    return F[np.linalg.det(F) > 0.2][:count]


def _neo_hookean(F: np.ndarray, adjoint: np.ndarray, precision: int = 64) -> tuple[np.ndarray, np.ndarray]:
    given = lanes.tensors(precision, *(lanes.columns(a) for a in (F, adjoint, 0 * F, 0 * F)))
    with lanes.compiled():
        neo_hookean_all(*given, MU, LAM)
    return lanes.matrices(given[2]), lanes.matrices(given[3])


def _fibre(
    F: np.ndarray, fibre: np.ndarray, adjoint: np.ndarray, tension: float, precision: int = 64
) -> list[np.ndarray]:
    """Stress, then the adjoints of F, tension and fibre."""
    arrays = [lanes.columns(F), lanes.four(fibre), *(lanes.columns(a) for a in (adjoint, 0 * F, 0 * F))]
    given = lanes.tensors(precision, *arrays, lanes.four(0 * fibre), np.zeros(len(F)))
    with lanes.compiled():
        fibre_all(*given, tension)
    assert not given[5][:, 3].any()
    return [*(lanes.matrices(t) for t in given[3:5]), given[6].double().numpy(), given[5][:, :3].double().numpy()]


def _fibres(count: int) -> np.ndarray:
    d = np.random.default_rng(3).normal(size=(count, 3))
    return d / np.linalg.norm(d, axis=1, keepdims=True)


@PRECISIONS
def test_laws_agree_with_their_twins(precision: int, tolerance: float) -> None:
    """Neo-Hookean and fibre stress."""
    (F, d), adjoint = rounded(precision, _deformations(), _fibres(200)), np.zeros((200, 3, 3))
    assert relative(_neo_hookean(F, adjoint, precision)[0], twins.neo_hookean(F, MU, LAM), MU) <= tolerance
    assert relative(_fibre(F, d, adjoint, 512.0, precision)[0], twins.fibre_stress(F, 512.0, d), 512.0) <= tolerance


def test_viscous_stress_is_that_of_the_symmetric_rate() -> None:
    """2 eta D, and a rotation causes none."""
    C = np.random.default_rng(2).normal(size=(50, 3, 3))
    given = lanes.tensors(64, lanes.columns(C), lanes.columns(0 * C))
    with lanes.compiled():
        viscous_all(*given, 3.0)
    assert np.abs(lanes.matrices(given[1]) - 6.0 * symmetric(C)).max() <= 1e-14


def test_rest_is_free_of_stress() -> None:
    """At F = I passive matter bears nothing, exactly."""
    rest = np.eye(3)[None]
    assert not _neo_hookean(rest, rest)[0].any()


def test_laws_are_objective_and_isotropic() -> None:
    """tau(QF) = Q tau(F) Q^T and tau(FQ) = tau(F); a fibre turns with the rest pose."""
    F, none = _deformations(), np.zeros((200, 3, 3))
    Q = np.linalg.qr(np.random.default_rng(5).normal(size=(200, 3, 3)))[0]
    Q *= np.linalg.det(Q)[:, None, None]
    back = np.swapaxes(Q, 1, 2)
    stress = _neo_hookean(F, none)[0]
    assert relative(_neo_hookean(Q @ F, none)[0], Q @ stress @ back, MU) <= 1e-12
    assert relative(_neo_hookean(F @ Q, none)[0], stress, MU) <= 1e-12
    d = _fibres(200)
    active = _fibre(F, d, none, 700.0)[0]
    assert relative(_fibre(Q @ F, d, none, 700.0)[0], Q @ active @ back, 700.0) <= 1e-12
    turned = np.einsum("pji,pj->pi", Q, d)
    assert relative(_fibre(F @ Q, turned, none, 700.0)[0], active, 700.0) <= 1e-12


def test_adjoints_of_elastic_laws_match_differences() -> None:
    """Of neo-Hookean stress by F; of fibre stress by F, tension and fibre."""
    rng = np.random.default_rng(6)
    F, d = _deformations(), _fibres(200)
    adjoint, step, turn = symmetric(rng.normal(size=F.shape)), rng.normal(size=F.shape), rng.normal(size=d.shape)
    e = 1e-6

    def check(plus: np.ndarray, minus: np.ndarray, exact: np.ndarray) -> None:
        derivative = ((plus - minus) * adjoint).sum((1, 2)) / (2 * e)
        assert np.abs(derivative - exact).max() <= 1e-7 * np.abs(exact).max()

    back = _neo_hookean(F, adjoint)[1]
    check(_neo_hookean(F + e * step, adjoint)[0], _neo_hookean(F - e * step, adjoint)[0], (back * step).sum((1, 2)))
    _, F_adjoint, tension_adjoint, fibre_adjoint = _fibre(F, d, adjoint, 3.0)
    at = [_fibre(F + s * e * step, d, adjoint, 3.0)[0] for s in (1, -1)]
    check(at[0], at[1], (F_adjoint * step).sum((1, 2)))
    at = [_fibre(F, d, adjoint, 3.0 + s * e)[0] for s in (1, -1)]
    check(at[0], at[1], tension_adjoint)
    at = [_fibre(F, d + s * e * turn, adjoint, 3.0)[0] for s in (1, -1)]
    check(at[0], at[1], (fibre_adjoint * turn).sum(1))


def test_guard_of_an_inverted_element() -> None:
    """Below the smallest J stress and adjoint stay finite and log J is held, for flat and point-like matter too."""
    F = np.stack([np.diag([0.02, 1.0, 1.0]), np.diag([-0.5, 1.0, 1.0]), np.diag([0.0, 0.0, 1.0]), np.zeros((3, 3))])
    adjoint = np.tile(np.eye(3), (4, 1, 1))
    stress, back = _neo_hookean(F, adjoint)
    held = MU * (F @ np.swapaxes(F, 1, 2) - np.eye(3)) + LAM * np.log(SMALLEST_J) * np.eye(3)
    assert np.allclose(stress, held, rtol=1e-14)
    assert np.allclose(back, 2 * MU * F, rtol=1e-14)
