"""Particle shifting of water: down the density's gradient, only at a surplus, and with an exact adjoint."""
# ruff: noqa: ANN201  (the arguments of kernels are typed by the kernel compiler)

import numpy as np
import pytest
import taichi as ti

from tests.sim import scenes
from tests.sim.kernels import lanes
from tests.sim.kernels.lanes import arena
from tests.sim.kernels.test_water import CELLS, NODES, densities, tank_masses
from zoobench.arrays import Array
from zoobench.sim.kernels.array_types import Rows, Scalars
from zoobench.sim.kernels.boundary import WALL_NODES
from zoobench.sim.kernels.context import Around, Context
from zoobench.sim.kernels.laws.water import LAW
from zoobench.sim.kernels.layout import MOMENTUM, VELOCITY, scene_constants
from zoobench.sim.kernels.shifting import SHIFT_RATE, SHIFTED_SURPLUS, particle_shift, particle_shift_adjoint
from zoobench.sim.kernels.splines import CUBIC, QUADRATIC, stencil, weights
from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.model.lattice import fill_box, particle_volume
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.laws.water import WaterMaterial
from zoobench.sim.model.scene import Ground, MediumBed, Scene
from zoobench.sim.solver import Solver

H = scenes.SPACING
SHARE = 0.03


@ti.kernel
def particle_shift_all(
    constants: Scalars, grid: Rows, grid_adjoint: Rows, x: Rows, J: Scalars, rho: Scalars, adjoint: Rows,
    shift: Rows, x_adjoint: Rows, J_adjoint: Scalars, rho_adjoint: Scalars, share: float, variant: ti.template(),
):  # fmt: skip
    """Shifts of particles, and their adjoints."""
    ti.loop_config(serialize=True)
    for p in range(x.shape[0]):
        scene = scene_constants(constants, LAW)
        nodes = arena(scene)
        at = stencil(x[p], scene, nodes, variant.width)
        w = weights(at.offset, variant.width)
        c, near = Context(variant, grid=grid, grid_adjoint=grid_adjoint, nodes=nodes, scene=scene), Around(at, w)
        shift[p] = particle_shift(c, near, J[p], rho[p], share)
        by_place, by_ratio, by_density = particle_shift_adjoint(c, near, J[p], rho[p], share, adjoint[p])
        x_adjoint[p], J_adjoint[p], rho_adjoint[p] = by_place, by_ratio, by_density


def _particle_shift(grid: Array, places: Array, J: Array, rho: Array, adjoint: Array, width: int) -> tuple[Array, ...]:
    """Shift [cells], then the adjoints of node masses, places, J and density."""
    empty, masses, zeros = np.zeros((2, NODES**3, 4)), lanes.grid(2, NODES, VELOCITY, grid), lanes.four(0 * places)
    given = lanes.tensors(
        64, lanes.constants(NODES), masses, empty, lanes.four(places), J, rho, lanes.four(adjoint), zeros, zeros,
        0 * J, 0 * J,
    )  # fmt: skip
    with lanes.compiled():
        particle_shift_all(*given, SHARE, lanes.variant(width=width))
    shift, places_adjoint, J_adjoint, rho_adjoint = (tensor.numpy() for tensor in given[7:])
    masses_adjoint = given[2][MOMENTUM].numpy().reshape(grid.shape)
    return shift[:, :3], masses_adjoint, places_adjoint[:, :3], J_adjoint, rho_adjoint


def _density(grid: Array, places: Array, width: int) -> Array:
    return densities(grid, places, np.zeros(len(places)), width)[0]


def _stirred(count: int = 200) -> tuple[Array, Array, Array, Array]:
    """Places in a tank of uneven density, near walls too, with J and densities of which half are a surplus."""
    rng = np.random.default_rng(3)
    places = rng.uniform(0.1, CELLS - 0.1, (count, 3)) + WALL_NODES
    grid = tank_masses(places, QUADRATIC) + 0.1 * rng.random((NODES, NODES, NODES, 4))
    return grid, places, rng.uniform(0.9, 1.05, count), rng.uniform(0.4, 2.2, count)


@pytest.mark.parametrize("width", [QUADRATIC, pytest.param(CUBIC, marks=pytest.mark.slow)])
def test_shift_is_down_the_gradient_of_density(width: int) -> None:
    """As differences of the density have it, between walls too; exactly zero without a surplus."""
    grid, places, J, rho = _stirred()
    shift = _particle_shift(grid, places, J, rho, 0 * places, width)[0]
    e, derivative = 1e-6, np.empty_like(places)
    for d in range(3):
        low, high = (_density(grid, places + sign * e * np.eye(3)[d], width) for sign in (-1, 1))
        derivative[:, d] = np.log(high / low) / (2 * e)
    surplus = np.maximum(rho * J - 1.0 - SHIFTED_SURPLUS, 0.0)
    assert 0.2 < (surplus > 0).mean() < 0.8
    assert np.abs(shift + SHIFT_RATE * SHARE * surplus[:, None] * derivative).max() <= 1e-8
    assert not shift[surplus == 0.0].any()


@pytest.mark.parametrize("width", [QUADRATIC, pytest.param(CUBIC, marks=pytest.mark.slow)])
def test_adjoint_of_shift_matches_differences(width: int) -> None:
    """By the node masses, the places, J and the density."""
    given = _stirred()
    rng = np.random.default_rng(4)
    adjoint = rng.normal(size=given[1].shape)
    steps = [rng.uniform(-1.0, 1.0, a.shape) for a in given]
    back = _particle_shift(*given, adjoint, width)[1:]
    e = 1e-6
    low, high = (
        (
            _particle_shift(*(a + sign * e * step for a, step in zip(given, steps, strict=True)), adjoint, width)[0]
            * adjoint
        ).sum()
        for sign in (-1, 1)
    )
    exact = sum((b * step).sum() for b, step in zip(back, steps, strict=True))
    assert (high - low) / (2 * e) == pytest.approx(exact, rel=1e-6)
    assert all(np.abs(b).max() > 0.0 for b in back)
    assert not back[0][..., :3].any()


@pytest.mark.slow
def test_sheets_in_the_middle_of_cells_come_apart() -> None:
    """Water in sheets three cells apart, which pressure cannot separate, leaves them within three tenths of a second.

    Without a shift all of it is still in its sheets then.
    """
    places = fill_box(np.zeros(3), H * np.array([6.0, 6.0, 6.0]), H, 8)
    cell, rest = np.divmod(places[:, 1] / H, 3.0)
    places[:, 1] = H * (3.0 * cell + 1.5 + 0.03 * (rest - 1.5))
    volumes = np.full(len(places), particle_volume(H, 8))
    medium = MediumBed.at_rest(WaterMaterial(bulk_modulus=1e5, density=1000.0), places, volumes)
    grain = ElasticBody.passive(ElasticMaterial(1.0, 0.0, 1.0), np.array([[H, H, H]]), np.array([1e-9 * H**3]))
    scene = Scene(grain, (0.0, 0.0, 0.0), (6 * H, 14 * H, 6 * H), medium=medium, ground=Ground(0.0))
    solver = Solver(scene, scenes.fidelity(32))

    def fullest() -> float:
        y = solver.matter.x[0, 0, 1:, 1].numpy() / H - WALL_NODES
        return float(np.bincount(np.floor(y).astype(int)).max() / (8 * 36))

    solver.reset()
    assert fullest() == pytest.approx(3.0)
    solver.substeps(round(0.3 / solver.dt))
    assert fullest() <= 2.0
