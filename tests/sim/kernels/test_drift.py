"""Relaxation of water's J to its local mean: against closed forms, and with exact adjoints."""
# ruff: noqa: ANN201  (the arguments of kernels are typed by the kernel compiler)

from dataclasses import replace

import numpy as np
import pytest
import taichi as ti

from tests.sim import scenes
from tests.sim.kernels import lanes
from tests.sim.kernels.lanes import arena
from tests.sim.kernels.splines_numpy import spline
from tests.sim.kernels.test_water import CELLS
from tests.sim.test_adjoint import GROUPS, Probe
from zoobench.arrays import Array
from zoobench.sim.kernels.array_types import Rows, Scalars
from zoobench.sim.kernels.boundary import WALL_NODES
from zoobench.sim.kernels.context import Around, Field
from zoobench.sim.kernels.drift import (
    RETURN_RATE,
    TOLERATED_DRIFT,
    mean_ratio,
    mean_ratio_adjoint,
    relaxed_ratio,
    relaxed_ratio_adjoint,
    scatter_ratio,
    scatter_ratio_adjoint,
)
from zoobench.sim.kernels.laws.water import LAW
from zoobench.sim.kernels.layout import RATIO, scene_constants
from zoobench.sim.kernels.splines import CUBIC, QUADRATIC, stencil, weight_derivatives, weights
from zoobench.sim.model.rollout import Gradient
from zoobench.sim.model.scene import Scene
from zoobench.sim.solver import Solver

SHARE = 0.03
NODES = CELLS + 2 * WALL_NODES + 1


@ti.kernel
def ratios_all(
    constants: Scalars, grid: Rows, grid_adjoint: Rows, x: Rows, J: Scalars, adjoint: Scalars,
    after: Scalars, x_adjoint: Rows, J_adjoint: Scalars, share: float, mass: float, width: ti.template(),
):  # fmt: skip
    """J of water particles after relaxation to the local mean, and its adjoints."""
    ti.loop_config(serialize=True)
    for _ in range(1):
        scene = scene_constants(constants, LAW)
        nodes = arena(scene)
        for p in range(x.shape[0]):
            at = stencil(x[p], scene, nodes, width)
            w = weights(at.offset, width)
            scatter_ratio(Field(grid, RATIO, nodes, 0, width), Around(at, w), J[p], mass)
        for p in range(x.shape[0]):
            at = stencil(x[p], scene, nodes, width)
            w, dw = weights(at.offset, width), weight_derivatives(at.offset, width)
            ratio, up = J[p], adjoint[p]
            field, near = Field(grid, RATIO, nodes, 0, width), Around(at, w, dw)
            mean = mean_ratio(field, near, ratio)
            after[p] = relaxed_ratio(ratio, mean, share)
            own_adjoint, mean_adjoint = relaxed_ratio_adjoint(ratio, mean, share, up)
            J_adjoint[p] = own_adjoint
            x_adjoint[p] = mean_ratio_adjoint(
                field, Field(grid_adjoint, RATIO, nodes, 0, width), near, mean, mean_adjoint
            )
        for p in range(x.shape[0]):
            at = stencil(x[p], scene, nodes, width)
            w, dw = weights(at.offset, width), weight_derivatives(at.offset, width)
            more = scatter_ratio_adjoint(Field(grid_adjoint, RATIO, nodes, 0, width), Around(at, w, dw), J[p], mass)
            x_adjoint[p] += more[0]
            J_adjoint[p] += more[1]


def _relaxed(places: Array, J: Array, adjoint: Array, width: int) -> tuple[Array, Array, Array]:
    """J after a step, and the adjoints of places [cells] and J."""
    empty, zeros = np.zeros((RATIO + 1, NODES**3, 4)), lanes.four(0 * places)
    given = lanes.tensors(64, lanes.constants(NODES), empty, empty, lanes.four(places), J, adjoint, 0 * J, zeros, 0 * J)
    with lanes.compiled():
        ratios_all(*given, SHARE, 0.125, width)
    after, x_adjoint, J_adjoint = (tensor.numpy() for tensor in given[6:])
    return after, x_adjoint[:, :3], J_adjoint


def _drifted(count: int = 400) -> tuple[Array, Array]:
    """Places in a tank, and J, some of which differ from the local mean by more than is tolerated, either way."""
    rng = np.random.default_rng(3)
    return rng.uniform(0.1, CELLS - 0.1, (count, 3)) + WALL_NODES, rng.uniform(0.9, 1.0, count)


def _mean(places: Array, J: Array, width: int) -> Array:
    """The local mean at every place, by a dense matrix of all nodes' weights."""
    weights = np.ones((len(places), NODES, NODES, NODES))
    for d in range(3):
        shape = [len(places), 1, 1, 1]
        shape[d + 1] = NODES
        weights *= spline(places[:, d, None] - np.arange(NODES), width).reshape(shape)
    flat = weights.reshape(len(places), -1)
    mean: Array = flat @ (flat.T @ J) / (flat @ flat.sum(0))
    return mean


@pytest.mark.parametrize("width", [QUADRATIC, pytest.param(CUBIC, marks=pytest.mark.slow)])
def test_what_is_far_from_the_mean_decays_and_nothing_else(width: int) -> None:
    """At the stated rate beyond the tolerated difference, by a twin on dense matrices; else bit for bit the same."""
    places, J = _drifted()
    after = _relaxed(places, J, J, width)[0]
    gap = _mean(places, J, width) - J
    excess = np.sign(gap) * np.maximum(np.abs(gap) - TOLERATED_DRIFT, 0.0)
    assert 0.2 < (excess < 0).mean() < 0.6
    assert 0.2 < (excess > 0).mean() < 0.6
    assert np.abs(after - J - RETURN_RATE * SHARE * excess).max() <= 1e-15
    assert np.array_equal(after[np.abs(gap) < TOLERATED_DRIFT - 1e-12], J[np.abs(gap) < TOLERATED_DRIFT - 1e-12])


@pytest.mark.parametrize("width", [QUADRATIC, pytest.param(CUBIC, marks=pytest.mark.slow)])
def test_adjoint_of_return_matches_differences(width: int) -> None:
    """By the places and by J, of the particle itself and of all that it shares nodes with."""
    places, J = _drifted()
    rng = np.random.default_rng(4)
    adjoint, step, change = rng.normal(size=J.shape), rng.normal(size=places.shape), rng.normal(size=J.shape)
    _, x_adjoint, J_adjoint = _relaxed(places, J, adjoint, width)
    e = 1e-7
    low, high = (_relaxed(places + s * e * step, J + s * e * change, adjoint, width)[0] @ adjoint for s in (-1, 1))
    assert (x_adjoint * step).sum() != 0.0
    assert (high - low) / (2 * e) == pytest.approx((x_adjoint * step).sum() + (J_adjoint * change).sum(), rel=1e-6)


def _scene() -> Scene:
    """The muscle cube on water of which every particle is compressed by an amount of its own."""
    scene = scenes.medium_scene("water")
    assert scene.medium is not None
    J = np.random.default_rng(5).uniform(0.91, 0.99, len(scene.medium.positions))
    return replace(scene, medium=replace(scene.medium, history=J))


@pytest.fixture(scope="module")
def probed() -> tuple[Probe, Gradient]:
    """A few frames of water that has drifted, and their gradient."""
    probe = Probe(_scene(), 3)
    return probe, probe.gradient()


@pytest.mark.slow  # the adjoint of the return itself is checked above
@pytest.mark.parametrize("name", GROUPS)
def test_gradient_through_drifted_water_matches_central_differences(probed: tuple[Probe, Gradient], name: str) -> None:
    """In every parameter group."""
    probe, gradient = probed
    direction = np.random.default_rng(7).uniform(-1.0, 1.0, probe.base[name].shape)
    assert probe.error(gradient, name, direction, 1e-5, largest=1e-5) <= 1e-5


@pytest.mark.slow
def test_parallel_driver_agrees_with_the_serial_one_on_drifted_water() -> None:
    """Path and gradient, in two worlds."""
    scenes.compare_drivers(_scene(), 3)


def test_water_compressed_alike_is_left_alone() -> None:
    """To the last bits of the mean."""
    places, J = _drifted()
    alike = np.full_like(J, 0.95)
    assert np.array_equal(_relaxed(places, alike, alike, QUADRATIC)[0], alike)


def test_only_water_holds_ratios() -> None:
    """Elsewhere the grid has no such field, so that a kernel that used it would fail."""
    for name in ("ground", "sand", "water"):
        launcher = Solver(scenes.SCENES[name](), scenes.fidelity()).launcher
        assert (launcher._grid.shape[0] > RATIO) == (name == "water")


@pytest.mark.parametrize("name", ["ground", pytest.param("water", marks=pytest.mark.slow)])
def test_the_reverse_holds_ratios_where_the_episode_does(name: str) -> None:
    """Its grid has the same fields."""
    launcher = scenes.episode(scenes.SCENES[name](), 1)[0].launcher
    assert launcher._grid_adjoint is not None
    assert launcher._grid_adjoint.shape[0] == launcher._grid.shape[0]
