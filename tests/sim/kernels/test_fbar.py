"""F-bar: a particle's volume changes as that around it; against dense matrices and differences."""
# ruff: noqa: ANN201  (the arguments of kernels are typed by the kernel compiler)

import numpy as np
import pytest
import taichi as ti

from tests.sim import scenes
from tests.sim.kernels import lanes
from tests.sim.kernels.lanes import arena
from tests.sim.kernels.test_water import CELLS
from zoobench.arrays import Array
from zoobench.sim.kernels.array_types import Rows, Scalars
from zoobench.sim.kernels.boundary import WALL_NODES
from zoobench.sim.kernels.context import Context
from zoobench.sim.kernels.fbar import mean_rate, mean_rate_adjoint, scatter_rate, scatter_rate_adjoint
from zoobench.sim.kernels.layout import RATIO, C, V, X, scene_constants
from zoobench.sim.solver import Solver

NODES = CELLS + 2 * WALL_NODES + 1
MASS = 0.125
ROWS = 9
VARIANT = lanes.variant(fbar=True)


@ti.kernel
def rates_all(
    constants: Scalars, grid: Rows, grid_adjoint: Rows, body: Rows, state: Rows, adjoint: Rows, given: Scalars,
    change: Scalars, x_adjoint: Rows,
):  # fmt: skip
    """What the rates of particles change by, with the adjoint `given` its adjoint by places and C."""
    ti.loop_config(serialize=True)
    for _ in range(1):
        scene = scene_constants(constants)
        nodes = arena(scene)
        c = Context(
            VARIANT, state=state, adjoint=adjoint, body=body, grid=grid, grid_adjoint=grid_adjoint,
            scene=scene, nodes=nodes, w=0, s=0, start=0,
        )  # fmt: skip
        for p in range(state.shape[2]):
            scatter_rate(c, p)
        for p in range(state.shape[2]):
            mean, own = mean_rate(c, p)
            change[p] = mean - own
            x_adjoint[p] = mean_rate_adjoint(c, p, mean, given[p])
        for p in range(state.shape[2]):
            x, _mass = scatter_rate_adjoint(c, p, body[0, p, 0][0])
            x_adjoint[p] += x


def _changes(places: Array, rates: Array, given: Array) -> tuple[Array, Array, Array]:
    """What the rates change by, and the adjoints of places [cells] and rates."""
    count = len(places)
    state, body = np.zeros((1, 1, count, ROWS, 4)), np.zeros((1, count, 2, 4))
    state[0, 0, :, X, :3], body[0, :, 0, 0] = places, MASS
    for d, share in enumerate((0.5, 0.2, 0.3)):
        state[0, 0, :, C + d, d] = share * rates
    empty = np.zeros((RATIO + 1, NODES**3, 4))
    arrays = (lanes.constants(NODES), empty, empty, body, state, 0 * state, given, 0 * given, lanes.four(0 * places))
    tensors = lanes.tensors(64, *arrays)
    with lanes.compiled():
        rates_all(*tensors)
    adjoint, change, x_adjoint = (tensors[k].numpy() for k in (5, 7, 8))
    by_rate = adjoint[0, 0, :, C, 0]
    assert np.array_equal(by_rate, adjoint[0, 0, :, C + 2, 2])  # of the trace alone
    assert not adjoint[0, 0, :, V].any()
    return change, x_adjoint[:, :3], by_rate


def _stirred(count: int = 400) -> tuple[Array, Array]:
    """Places in a bed, and rates of volume change of their own."""
    rng = np.random.default_rng(3)
    return rng.uniform(0.1, CELLS - 0.1, (count, 3)) + WALL_NODES, rng.normal(size=count)


def test_a_particle_takes_the_mean_of_trilinear_weights() -> None:
    """By a dense matrix of all nodes' weights."""
    places, rates = _stirred()
    weights = np.ones((len(places), NODES, NODES, NODES))
    for d in range(3):
        shape = [len(places), 1, 1, 1]
        shape[d + 1] = NODES
        weights *= np.maximum(1.0 - np.abs(places[:, d, None] - np.arange(NODES)), 0.0).reshape(shape)
    flat = weights.reshape(len(places), -1)
    mean = flat @ (flat.T @ rates) / (flat @ flat.sum(0))
    assert _changes(places, rates, rates)[0] == pytest.approx(mean - rates, abs=1e-13)


def test_what_grows_evenly_is_left_alone_and_what_alternates_is_evened_out() -> None:
    """On a lattice of eight in a cell: a rate that is linear in place stays, and one that alternates becomes none."""
    ends = np.arange(1.25, CELLS, 0.5) + WALL_NODES
    places = np.stack(np.meshgrid(ends, ends, ends, indexing="ij"), axis=-1).reshape(-1, 3)
    inner = (np.abs(places - places.mean(axis=0)) < 0.5 * CELLS - 2.5).all(axis=1)
    assert inner.sum() >= 8
    linear = places @ np.array([0.3, -0.7, 1.1])
    alternating = (-1.0) ** np.round(2.0 * places - 0.5).sum(axis=1)
    assert _changes(places, linear, linear)[0][inner] == pytest.approx(0.0, abs=1e-12)
    assert _changes(places, alternating, linear)[0][inner] == pytest.approx(-alternating[inner], abs=1e-12)


def test_the_adjoint_matches_differences() -> None:
    """By the places and the rates, of the particle itself and of all that it shares nodes with."""
    places, rates = _stirred()
    rng = np.random.default_rng(4)
    given, step, more = rng.normal(size=rates.shape), rng.normal(size=places.shape), rng.normal(size=rates.shape)
    _, by_place, by_rate = _changes(places, rates, given)
    e = 1e-7
    low, high = (_changes(places + s * e * step, rates + s * e * more, given)[0] @ given for s in (-1, 1))
    assert (high - low) / (2 * e) == pytest.approx((by_place * step).sum() + (by_rate * more).sum(), rel=1e-6)


@pytest.mark.parametrize(("name", "has_it"), [("ground", False), ("sand", False), ("clay", True), ("mud", True)])
def test_only_media_that_keep_their_volume_have_it(name: str, has_it: bool) -> None:
    """Elsewhere the grid has no such field, so that a kernel that used it would fail."""
    launcher = Solver(scenes.SCENES[name](), scenes.fidelity()).launcher
    assert launcher.variant.fbar == has_it
    assert (launcher._grid.shape[0] > RATIO) == has_it
