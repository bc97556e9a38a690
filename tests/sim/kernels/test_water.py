"""Water's volume ratio: tied to the density of its particles, by rules with exact adjoints."""
# ruff: noqa: ANN201  (the arguments of kernels are typed by the kernel compiler)

from dataclasses import replace

import numpy as np
import pytest
import taichi as ti

from tests.sim import scenes
from tests.sim.kernels import lanes
from tests.sim.kernels.lanes import arena
from tests.sim.kernels.splines_numpy import spline
from tests.sim.test_adjoint import GROUPS, Probe
from zoobench.sim.kernels.array_types import Rows, Scalars
from zoobench.sim.kernels.boundary import WALL_NODES
from zoobench.sim.kernels.context import Around, Field
from zoobench.sim.kernels.laws.water import (
    LAW,
    density_factor,
    free_fraction,
    free_fraction_adjoint,
    water_ratio,
    water_ratio_adjoint,
)
from zoobench.sim.kernels.layout import MOMENTUM, VELOCITY, scene_constants
from zoobench.sim.kernels.splines import CUBIC, QUADRATIC, stencil, weight_derivatives, weights
from zoobench.sim.kernels.transfer import by_offset, gather_slopes, gather_value, scatter_value
from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.model.lattice import fill_box, particle_volume
from zoobench.sim.model.laws import water as twins
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.laws.water import LARGEST_RATIO, SMALLEST_RATIO, TOLERATED_SURPLUS, WaterMaterial
from zoobench.sim.model.rollout import Gradient
from zoobench.sim.model.scene import Ground, MediumBed, Scene
from zoobench.sim.solver import Solver

H = scenes.SPACING
SHARE = 0.03
Four = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


@ti.kernel
def water_ratio_all(
    J: Scalars, growth: Scalars, rho: Scalars, adjoint: Scalars,
    after: Scalars, J_adjoint: Scalars, growth_adjoint: Scalars, rho_adjoint: Scalars, share: float,
):  # fmt: skip
    """New volume ratio of water and its adjoints."""
    for p in range(J.shape[0]):
        after[p] = water_ratio(J[p], growth[p], rho[p], share)
        J_adjoint[p], growth_adjoint[p], rho_adjoint[p] = water_ratio_adjoint(
            J[p], growth[p], rho[p], share, adjoint[p]
        )


@ti.kernel
def relative_density_all(
    constants: Scalars, grid: Rows, grid_adjoint: Rows, x: Rows, adjoint: Scalars, rho: Scalars, x_adjoint: Rows,
    width: ti.template(),
):  # fmt: skip
    """Relative density at places, and its adjoints, as a substep combines them."""
    ti.loop_config(serialize=True)
    for p in range(x.shape[0]):
        scene = scene_constants(constants, LAW)
        nodes = arena(scene)
        at = stencil(x[p], scene, nodes, width)
        w, dw = weights(at.offset, width), weight_derivatives(at.offset, width)
        near, field = Around(at, w, dw), Field(grid, VELOCITY, nodes, 0, width)
        whole = free_fraction(near, scene, width)
        factor = density_factor(whole, scene)
        found = gather_value(field, near)[3] * factor
        rho[p] = found
        by_mass = ti.Vector([0.0, 0.0, 0.0, factor * adjoint[p]])
        scatter_value(Field(grid_adjoint, MOMENTUM, nodes, 0, width), near, by_mass)
        by_weights = by_offset(gather_slopes(field, near), by_mass)
        x_adjoint[p] = by_weights + free_fraction_adjoint(near, whole, found, adjoint[p], scene, width)


def _states(count: int = 3000) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """J, growth and relative density in every branch of the law."""
    rng = np.random.default_rng(1)
    return rng.uniform(0.85, 1.1, count), rng.uniform(0.95, 1.05, count), rng.uniform(0.3, 3.0, count)


def _ratio(J: np.ndarray, growth: np.ndarray, rho: np.ndarray, adjoint: np.ndarray, precision: int = 64) -> Four:
    given = lanes.tensors(precision, J, growth, rho, adjoint, 0 * J, 0 * J, 0 * J, 0 * J)
    water_ratio_all(*given, SHARE)
    after, *back = (tensor.double().numpy() for tensor in given[4:])
    return after, back[0], back[1], back[2]


@pytest.mark.parametrize(("precision", "tolerance"), [(64, 1e-15), pytest.param(32, 5e-7, marks=pytest.mark.slow)])
def test_ratio_agrees_with_its_twin(precision: int, tolerance: float) -> None:
    """In spray, at a surplus of density, and where J is at a bound."""
    kind = np.float64 if precision == 64 else np.float32
    J, growth, rho = (a.astype(kind).astype(float) for a in _states())
    found = _ratio(J, growth, rho, J, precision)[0]
    assert np.abs(found - twins.water_ratio(J, growth, rho, SHARE)).max() <= tolerance


def test_adjoint_of_ratio_matches_differences() -> None:
    """By J, by the increment and by the density, away from the bounds themselves."""
    given, e = _states(), 1e-7
    rng = np.random.default_rng(2)
    adjoint = rng.normal(size=len(given[0]))
    steps = [rng.uniform(-1, 1, len(adjoint)) for _ in given]
    back = _ratio(*given, adjoint)[1:]
    exact = sum(b * step for b, step in zip(back, steps, strict=True))
    low, high = (
        twins.water_ratio(*(a + sign * e * step for a, step in zip(given, steps, strict=True)), SHARE)
        for sign in (-1, 1)
    )
    wrong = np.abs(adjoint * (high - low) / (2 * e) - exact) > 1e-7
    assert wrong.mean() <= 1e-3  # those with a bound between the two
    assert all((np.abs(b) > 0).any() for b in back)


def test_ratio_without_a_surplus_follows_the_flow() -> None:
    """Bit for bit J det(I + dt C) wherever J is below 1 and the density no more than a fifth too high."""
    J, growth, rho = _states()
    plain = (J * growth < 1.0) & (J * rho < 1.0 + TOLERATED_SURPLUS)
    assert 100 < plain.sum() < 0.9 * len(J)
    after = _ratio(J, growth, rho, J)[0]
    assert np.array_equal(after[plain], (J * growth)[plain])
    assert after.max() <= LARGEST_RATIO
    assert (after[rho > 1.0] <= 1.0).all()
    assert (after >= np.minimum(J * growth, SMALLEST_RATIO)).all()


CELLS = 6
NODES = CELLS + 2 * WALL_NODES + 1


def tank_masses(places: np.ndarray, width: int) -> np.ndarray:
    """Node masses `[nodes, nodes, nodes, 4]` of particles of a cubic tank `CELLS` wide, of density 1 at rest."""
    grid = np.zeros((NODES, NODES, NODES, 4))
    base = np.floor(places - (width / 2 - 1)).astype(int)
    w = np.stack([spline(places - base - i, width) for i in range(width)])
    for i, j, k in np.ndindex(width, width, width):
        index = (*(base + np.array([i, j, k])).T, 3)
        np.add.at(grid, index, w[i, :, 0] * w[j, :, 1] * w[k, :, 2] / 8)
    return grid


def densities(
    grid: np.ndarray, places: np.ndarray, adjoint: np.ndarray, width: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Density at places [cells], and adjoints of node masses and places."""
    empty, masses = np.zeros((2, NODES**3, 4)), lanes.grid(2, NODES, VELOCITY, grid)
    given = lanes.tensors(
        64, lanes.constants(NODES), masses, empty, lanes.four(places), adjoint, 0 * adjoint, lanes.four(0 * places)
    )
    with lanes.compiled():
        relative_density_all(*given, width)
    return given[5].numpy(), given[2][MOMENTUM].numpy().reshape(grid.shape), given[6].numpy()[:, :3]


@pytest.mark.parametrize(("width", "bound"), [(QUADRATIC, 0.0043), pytest.param(CUBIC, 0.0043, marks=pytest.mark.slow)])
def test_density_of_a_full_tank_is_that_at_rest_up_to_its_walls(width: int, bound: float) -> None:
    """Within 0.43 % for each of the walls that cut the stencil, as far as a lattice differs from a continuum."""
    places = fill_box(np.zeros(3), np.full(3, float(CELLS)), 1.0, 8) + WALL_NODES
    rho, _, _ = densities(tank_masses(places, width), places, np.ones(len(places)), width)
    assert np.abs(rho - 1.0).max() <= (1.0 + bound) ** 3 - 1.0


@pytest.mark.parametrize("width", [QUADRATIC, pytest.param(CUBIC, marks=pytest.mark.slow)])
def test_adjoint_of_density_matches_differences(width: int) -> None:
    """By the places and the node masses, near walls and beyond them."""
    rng = np.random.default_rng(3)
    places = rng.uniform(-0.3, CELLS + 0.3, (200, 3)) + WALL_NODES
    grid = tank_masses(places, width) + 0.1 * rng.random((NODES, NODES, NODES, 4))
    adjoint, step, change = rng.normal(size=200), rng.normal(size=places.shape), rng.normal(size=grid.shape)
    _, grid_adjoint, back = densities(grid, places, adjoint, width)
    e = 1e-6
    values = [densities(grid + s * e * change, places + s * e * step, adjoint, width)[0] @ adjoint for s in (-1, 1)]
    exact = (back * step).sum() + (grid_adjoint * change).sum()
    assert (values[1] - values[0]) / (2 * e) == pytest.approx(exact, rel=1e-7)
    assert not grid_adjoint[..., :3].any()


def _dense_scene() -> Scene:
    """The muscle cube on water that has twice as many particles as its volume allows for, some of them sprayed up."""
    scene = scenes.medium_scene("water")
    assert scene.medium is not None
    rng = np.random.default_rng(4)
    more = scene.medium.positions + rng.uniform(0.0, 0.25 * H, scene.medium.positions.shape)
    places = np.concatenate([scene.medium.positions, more])
    bed = MediumBed.at_rest(scene.medium.material, places, np.tile(scene.medium.volumes, 2))
    return replace(scene, medium=replace(bed, velocities=rng.normal(size=places.shape) * 0.2))


@pytest.fixture(scope="module")
def probed() -> tuple[Probe, Gradient]:
    """A few frames in dense water, and their gradient."""
    probe = Probe(_dense_scene(), 3)
    return probe, probe.gradient()


@pytest.mark.slow  # the adjoints of density and shift are checked alone, and the conformance suite swims in a pond
@pytest.mark.parametrize("name", GROUPS)
def test_gradient_through_dense_water_matches_central_differences(probed: tuple[Probe, Gradient], name: str) -> None:
    """In every parameter group while the correction is active."""
    probe, gradient = probed
    direction = np.random.default_rng(7).uniform(-1.0, 1.0, probe.base[name].shape)
    exact = float((getattr(gradient, name) * direction).sum())
    errors = [abs(probe.difference(name, direction, e) / exact - 1.0) for e in (1e-5, 1e-6, 1e-7)]
    assert min(errors) <= 1e-5


def _grain() -> ElasticBody:
    soft = ElasticMaterial(youngs_modulus=1.0, poissons_ratio=0.0, density=1.0)
    return ElasticBody.passive(soft, np.array([[H, H, H]]), np.array([1e-9 * H**3]))


def _tank(column: tuple[int, int, int], cells: tuple[int, int, int], bulk: float = 1e5, copies: int = 1) -> Solver:
    """A column of water in a corner of a tank, each particle so many times."""
    places = np.tile(fill_box(np.zeros(3), H * np.array(column), H, 8), (copies, 1))
    places += np.random.default_rng(5).uniform(-1e-3, 1e-3, places.shape) * H * (copies > 1)
    medium = MediumBed.at_rest(
        WaterMaterial(bulk_modulus=bulk, density=1000.0), places, np.full(len(places), particle_volume(H, 8))
    )
    arena = (cells[0] * H, cells[1] * H, cells[2] * H)
    scene = Scene(_grain(), (0.0, 0.0, 0.0), arena, medium=medium, ground=Ground(0.0))
    return Solver(scene, scenes.fidelity(32))


def _height(solver: Solver) -> float:
    """Twice the mean height of the water [cells]."""
    return 2.0 * float(solver.matter.x[0, 0, 1:, 1].mean()) / H - 2.0 * WALL_NODES


@pytest.mark.slow
def test_water_keeps_its_level_after_a_slosh() -> None:
    """A dam of 10 cells breaks and is brought to rest after 3 s: 3.3 cells deep, to a tenth of a cell."""
    solver = _tank((6, 10, 3), (18, 30, 3))
    solver.reset()
    second = round(1.0 / solver.dt)
    solver.substeps(3 * second)
    assert float(solver.matter.history.max()) <= LARGEST_RATIO
    for _ in range(40):
        solver.substeps(second // 40)
        solver.matter.v.mul_(0.78)
        solver.matter.C.mul_(0.78)
    assert _height(solver) == pytest.approx(180 / 54, abs=0.1)


@pytest.mark.slow
def test_dense_water_expands() -> None:
    """Two particles in every place, both with J = 1, take the volume of both but for the tolerated surplus within two
    seconds."""
    solver = _tank((6, 4, 6), (6, 16, 6), copies=2)
    solver.reset()
    begin = _height(solver)
    solver.substeps(round(2.0 / solver.dt))
    assert begin == pytest.approx(4.0, rel=1e-3)
    # J times the density over that at rest may stay at 1 + TOLERATED_SURPLUS
    assert _height(solver) >= 8.0 * float(solver.matter.history.mean()) / (1.0 + TOLERATED_SURPLUS)


@pytest.mark.slow
def test_correction_does_not_depend_on_the_step() -> None:
    """After 10 ms J of dense water is the same with steps half as long, to a few per cent of its fall."""
    falls = []
    for halves in (1, 2):
        solver = _tank((6, 4, 6), (6, 16, 6), copies=2)
        solver.reset()
        solver.substeps(halves * round(0.01 / solver.dt), solver.dt / halves)
        falls.append(1.0 - float(solver.matter.history.mean()))
    assert falls[0] > 0.005
    assert falls[0] == pytest.approx(falls[1], rel=0.05)
