"""The splines' weights and their moments, on which the transfers rely."""
# ruff: noqa: ANN201  (the arguments of kernels are typed by the kernel compiler)

import numpy as np
import pytest
import taichi as ti

from tests.sim.kernels import lanes
from tests.sim.kernels.lanes import arena
from tests.sim.kernels.splines_numpy import spline
from zoobench.sim.kernels.array_types import Rows, Scalars
from zoobench.sim.kernels.layout import scene_constants
from zoobench.sim.kernels.splines import (
    CUBIC,
    INVERSE_MOMENT,
    QUADRATIC,
    pick,
    stencil,
    weight_derivatives,
    weight_second_derivatives,
    weights,
)

NODES = 12


@ti.kernel
def weights_all(
    constants: Scalars, x: Rows, first: Scalars, flat: Scalars, w: Scalars, picked: Scalars, derivative: Scalars,
    second: Scalars, width: ti.template(),
):  # fmt: skip
    """First node, its place in the grid, weights, the same by `pick`, first and second derivatives, at places."""
    for p in range(x.shape[0]):
        scene = scene_constants(constants)
        at = stencil(x[p], scene, arena(scene), width)
        found, rise = weights(at.offset, width), weight_derivatives(at.offset, width)
        bend = weight_second_derivatives(at.offset, width)
        node = (at.x, at.y, at.z)
        flat[p] = at.node
        for d in ti.static(range(3)):
            first[p, d] = node[d]
            for i in ti.static(range(width)):
                w[p, i, d] = found[i][d]
                derivative[p, i, d] = rise[i][d]
                second[p, i, d] = bend[i][d]
            for i in range(width):
                picked[p, i, d] = pick(found, i, d, width)


def _weights(places: np.ndarray, width: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Nodes of the stencil, weights, first and second derivatives, `[places, width, 3]` each."""
    empty = np.zeros((len(places), width, 3))
    given = lanes.tensors(
        64, lanes.constants(NODES), lanes.four(places), np.zeros_like(places), np.zeros(len(places)), *[empty] * 4
    )
    with lanes.compiled():
        weights_all(*given, width)
    first, flat, w, picked, derivative, second = (tensor.numpy() for tensor in given[2:])
    assert np.array_equal(w, picked, equal_nan=True)
    assert np.array_equal(flat, first @ [NODES**2, NODES, 1])
    return first[:, None, :] + np.arange(width)[None, :, None], w, derivative, second


def _places() -> np.ndarray:
    """Well inside the grid, some of them on nodes and half way between."""
    places = np.random.default_rng(1).uniform(2.0, NODES - 3.0, (500, 3))
    places[:20] = np.round(places[:20] * 2) / 2
    return places


@pytest.mark.parametrize("width", [QUADRATIC, CUBIC])
def test_moments(width: int) -> None:
    """Weights sum to 1, have the place as first moment and the same second moment everywhere, h^2/4 or h^2/3."""
    places = _places()
    nodes, w, _, _ = _weights(places, width)
    arm = nodes - places[:, None, :]
    assert (w >= 0.0).all()
    assert np.abs(w.sum(1) - 1.0).max() <= 1e-14
    assert np.abs((w * arm).sum(1)).max() <= 1e-14
    assert INVERSE_MOMENT[width] == {QUADRATIC: 4.0, CUBIC: 3.0}[width]
    full = np.einsum("pi,pj,pk->pijk", *np.moveaxis(w, 2, 0))
    offsets = np.stack(
        np.broadcast_arrays(arm[:, :, None, None, 0], arm[:, None, :, None, 1], arm[:, None, None, :, 2])
    )
    second = np.einsum("pijk,apijk,bpijk->pab", full, offsets, offsets)
    assert np.abs(second - np.eye(3) / INVERSE_MOMENT[width]).max() <= 1e-14


@pytest.mark.parametrize("width", [QUADRATIC, CUBIC])
def test_weights_are_the_spline_and_its_derivatives(width: int) -> None:
    """The spline at every node's distance, and its first and, away from its knots, second central differences."""
    places = _places()[20:]
    nodes, w, derivative, second = _weights(places, width)
    arm = places[:, None, :] - nodes
    assert np.abs(w - spline(arm, width)).max() <= 1e-15
    e = 1e-6
    difference = (spline(arm + e, width) - spline(arm - e, width)) / (2 * e)
    assert np.abs(derivative - difference).max() <= 1e-6
    e = 1e-4
    difference = (spline(arm + e, width) - 2.0 * spline(arm, width) + spline(arm - e, width)) / e**2
    smooth = np.abs(2.0 * arm - np.round(2.0 * arm)) > 2.0 * e
    assert smooth.mean() > 0.99
    assert np.abs(second - difference)[smooth].max() <= 1e-6


@pytest.mark.parametrize("width", [QUADRATIC, CUBIC])
def test_stencil_stays_inside_the_grid(width: int) -> None:
    """Wherever an escaped particle is, and if it has no place at all."""
    places = np.random.default_rng(2).uniform(-5.0, NODES + 5.0, (500, 3))
    places[:7, 1] = [1e9, -1e9, 1e30, -1e30, np.inf, -np.inf, np.nan]
    nodes, _, _, _ = _weights(places, width)
    assert nodes.min() == 0
    assert nodes.max() == NODES - 1
