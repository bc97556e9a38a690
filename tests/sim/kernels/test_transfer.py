"""The six combinations of transfer and kernel: their conserved quantities, dissipation and gradients."""
# ruff: noqa: ANN201  (the arguments of kernels are typed by the kernel compiler)

import math
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest
import taichi as ti

from tests.sim import scenes
from tests.sim.kernels import lanes
from tests.sim.kernels.lanes import arena
from tests.sim.test_adjoint import GROUPS, Probe
from zoobench.arrays import Array
from zoobench.sim.kernels.array_types import Rows, Scalars
from zoobench.sim.kernels.columns import matrix
from zoobench.sim.kernels.context import Around, Field
from zoobench.sim.kernels.layout import BEFORE, MOMENTUM, VELOCITY, scene_constants
from zoobench.sim.kernels.splines import INVERSE_MOMENT, stencil, weight_derivatives, weights
from zoobench.sim.kernels.transfer import gather, gather_adjoint, scatter, scatter_adjoint
from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.model.fidelity import SPLINES, Fidelity, Kernel, Transfer
from zoobench.sim.model.lattice import fill_box
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.scene import Scene
from zoobench.sim.solver import Solver
from zoobench_verify.validate.waves import fit_decay

H = scenes.SPACING
NEW = scenes.COMBINATIONS[1:]
HARDEST = ("aflip", "cubic")
FEW = ((HARDEST, "ground"),)
"""Beside the default, which other tests have."""


def _unless(is_fast: bool) -> tuple[pytest.MarkDecorator, ...]:
    """The marks of a case: each compiles kernels of its own, so that few can be fast."""
    return () if is_fast else (pytest.mark.slow,)


combinations = pytest.mark.parametrize(
    ("transfer", "kernel"),
    [pytest.param(*pair, marks=_unless(pair[1] == "quadratic")) for pair in scenes.COMBINATIONS],
)
hardest_first = pytest.mark.parametrize(
    ("transfer", "kernel"), [pytest.param(*pair, marks=_unless(pair == HARDEST)) for pair in NEW]
)


@ti.kernel
def transfer_all(
    constants: Scalars, grid: Rows, x: Rows, moved: Rows, found: Rows, given: Rows, other: Rows, moved_adjoint: Rows,
    found_adjoint: Rows, width: ti.template(),
):  # fmt: skip
    """What is gathered at places; what is scattered from there into `moved`; and of the products of both with given
    adjoints the derivatives by the place (in the rows 4 and 5 of `found` and `other`) and by what goes in."""
    ti.loop_config(serialize=True)
    for p in range(x.shape[0]):
        scene = scene_constants(constants)
        nodes = arena(scene)
        at = stencil(x[p], scene, nodes, width)
        w, dw = weights(at.offset, width), weight_derivatives(at.offset, width)
        near = Around(at, w, dw)
        total, by_x, by_y, by_z = gather(Field(grid, VELOCITY, nodes, 0, width), near)
        found[p, 0], found[p, 1], found[p, 2], found[p, 3] = total, by_x, by_y, by_z
        slope = matrix(given[p, 1], given[p, 2], given[p, 3])
        scatter(Field(moved, MOMENTUM, nodes, 0, width), near, given[p, 0], slope)
        up = matrix(found_adjoint[p, 1], found_adjoint[p, 2], found_adjoint[p, 3])
        into = Field(moved_adjoint, MOMENTUM, nodes, 0, width)
        found[p, 4] = gather_adjoint(Field(grid, VELOCITY, nodes, 0, width), into, near, found_adjoint[p, 0], up)
        by_offset, first, one, two, three = scatter_adjoint(
            Field(grid, VELOCITY, nodes, 0, width), near, given[p, 0], slope
        )
        other[p, 0], other[p, 1], other[p, 2], other[p, 3], other[p, 4] = first, one, two, three, by_offset


NODES, PLACES = 12, 40


def _transfer(values: Array, places: Array, given: Array, up: Array, width: int, vectors: bool) -> tuple[Array, ...]:
    """Gathered `[places, 5, 4]`, scattered `[nodes^3, 4]`, the adjoint of scattering for `values` `[places, 5, 4]` and
    of gathering for `up` by the nodes `[nodes^3, 4]`."""
    empty, rows = np.zeros((2, NODES**3, 4)), np.zeros((len(places), 5, 4))
    # a kernel's own copy for either way of compilation
    kernel = transfer_all if vectors else SCALAR_TRANSFER
    arrays = lanes.tensors(
        64, lanes.constants(NODES, H), lanes.grid(2, NODES, VELOCITY, values), lanes.four(places), empty, rows, given,
        rows, empty, up,
    )  # fmt: skip
    with lanes.compiled(vectors=vectors):
        kernel(*arrays, width)
    return arrays[4].numpy(), arrays[3][MOMENTUM].numpy(), arrays[6].numpy(), arrays[7][MOMENTUM].numpy()


SCALAR_TRANSFER = ti.kernel(transfer_all.__wrapped__)
every_kernel_both_ways = pytest.mark.parametrize(
    ("kernel", "vectors"),
    [
        # single numbers, which no episode on a CPU has, take longest to compile
        pytest.param(kernel, vectors, marks=_unless(vectors and kernel == "quadratic"))
        for kernel in get_args(Kernel)
        for vectors in (True, False)
    ],
)


def _transferred(seed: int = 1) -> tuple[Array, Array, Array, Array]:
    """Random nodes, places, contributions and adjoints."""
    rng = np.random.default_rng(seed)
    places = H * rng.uniform(2.0, 9.0, (PLACES, 3))
    given, up = rng.normal(size=(2, PLACES, 4, 4))
    return rng.normal(size=(NODES,) * 3 + (4,)), places, given, up


@every_kernel_both_ways
def test_gather_reproduces_affine_fields(kernel: Kernel, vectors: bool) -> None:
    """Velocity and matrix of v = a + B x to round-off."""
    rng, width = np.random.default_rng(1), SPLINES[kernel].width
    _, places, given, up = _transferred()
    a, B = rng.normal(size=3), rng.normal(size=(3, 3))
    nodes = H * np.indices((NODES,) * 3).transpose(1, 2, 3, 0)
    values = np.concatenate([a + nodes @ B.T, np.ones((NODES,) * 3 + (1,))], axis=-1)
    found = _transfer(values, places, given, up, width, vectors)[0]
    assert np.abs(found[:, 0, :3] - (a + places @ B.T)).max() <= 1e-14
    assert np.abs(found[:, 0, 3] - 1.0).max() <= 1e-14
    offset = places / H - np.floor(places / H - (0.5 * width - 1.0))
    # columns of the matrix: the first moments about the particle over the splines' moment
    moments = found[:, 1:4] - offset[:, :, None] * found[:, :1]
    columns = INVERSE_MOMENT[width] / H * moments[..., :3]
    assert np.abs(np.swapaxes(columns, 1, 2) - B).max() <= 1e-12


@every_kernel_both_ways
def test_scatter_is_the_transpose_of_gather(kernel: Kernel, vectors: bool) -> None:
    """The product of what is scattered with a field is that of what is given with what is gathered of the field, and so
    for their adjoints by nodes and by what is given."""
    values, places, given, up = _transferred()
    found, moved, back, nodes_back = _transfer(values, places, given, up, SPLINES[kernel].width, vectors)
    flat = values.reshape(-1, 4)
    expected = (given * found[:, :4]).sum()
    assert (moved * flat).sum() == pytest.approx(expected, rel=1e-12)
    assert np.abs(back[:, :4] - found[:, :4]).max() <= 1e-13
    assert (nodes_back * flat).sum() == pytest.approx((up * found[:, :4]).sum(), rel=1e-12)


@every_kernel_both_ways
def test_derivatives_of_transfers_by_the_place_match_differences(kernel: Kernel, vectors: bool) -> None:
    """Of gathering and of scattering, with the first node's value and the slopes held."""
    values, places, given, up = _transferred()
    width, e = SPLINES[kernel].width, 1e-6
    found, _, back, _ = _transfer(values, places, given, up, width, vectors)
    for d in range(3):
        low, high = (
            _transfer(values, places + sign * e * H * np.eye(3)[d], given, up, width, vectors)[0] for sign in (-1, 1)
        )
        change = (high - low)[:, :4] / (2 * e)
        assert np.abs((change * up).sum((1, 2)) - found[:, 4, d]).max() <= 1e-7
        assert np.abs((change * given).sum((1, 2)) - back[:, 4, d]).max() <= 1e-7


def _spinning(transfer: Transfer, kernel: Kernel) -> Solver:
    """The muscle cube in free flight, turning and shearing."""
    gradient = np.array([[0.0, -6.0, 1.0], [5.0, 0.5, -3.0], [-1.0, 4.0, -0.5]])
    scene = scenes.weightless(scenes.thrown_body(np.array([0.3, -0.2, 0.1]), gradient))
    solver = Solver(scene, scenes.fidelity(transfer=transfer, kernel=kernel))
    solver.reset()
    return solver


@combinations
def test_momentum_is_kept_in_flight(transfer: Transfer, kernel: Kernel) -> None:
    """To round-off by all, and angular momentum by APIC; AFLIP loses or gains a little of it, PIC loses much."""
    solver = _spinning(transfer, kernel)
    momentum, angular = scenes.momenta(solver)
    solver.substeps(100)
    after, turned = scenes.momenta(solver)
    assert np.abs(after - momentum).max() <= 1e-12 * np.abs(momentum).max()
    drift = np.linalg.norm(turned - angular) / np.linalg.norm(angular)
    low, high = {"apic": (0.0, 1e-12), "aflip": (1e-6, 1e-2), "pic": (2e-2, 1.0)}[transfer]
    assert low <= drift <= high


@combinations
def test_no_transfer_adds_energy(transfer: Transfer, kernel: Kernel) -> None:
    """The map of velocities and affine fields in a substep without forces has no singular value above 1.

    In the norm of the kinetic energy. With AFLIP that keeps the rest of the velocity alone, as Fei et al. (2021) do, it
    has one of 1.14.
    """
    count = 16
    points = scenes.ARENA[0] / 2 + 2.0 * H * np.random.default_rng(3).random((count, 3))
    body = ElasticBody.passive(scenes.SOFT, points, np.full(count, H**3 / 8))
    body = scenes.with_idle_muscle(body)  # its kernels are those of the muscle cube
    solver = Solver(scenes.weightless(body), scenes.fidelity(transfer=transfer, kernel=kernel))
    solver.reset()
    v, C, scale = solver.matter.v[0, 0].numpy(), solver.matter.C[0, 0].numpy(), math.sqrt(solver.fidelity.moment)
    found = []
    for unit in np.eye(12 * count).reshape(-1, count, 12):
        v[:], C[:] = unit[:, :3], unit[:, 3:].reshape(-1, 3, 3) / scale
        solver.substeps(1, 1e-12)
        found.append(np.concatenate([v.reshape(count, 3), scale * C.reshape(count, 9)], axis=1).ravel())
    assert np.linalg.svd(np.array(found), compute_uv=False)[0] == pytest.approx(1.0, abs=1e-9)


def _bar_loss(transfer: Transfer, kernel: Kernel) -> float:
    """Share of the amplitude that the first longitudinal mode of a free bar, 16 cells long, loses in a period.

    The step is the same for all: loss is per step.
    """
    cells = 16
    h = 1.0 / cells
    bar = ElasticMaterial(youngs_modulus=1e4, poissons_ratio=0.0, density=1000.0)
    speed = math.sqrt(bar.youngs_modulus / bar.density)
    points = fill_box(np.array([3 * h, h, h]), np.array([3 * h + 1.0, 2 * h, 2 * h]), h, 8)
    phase = math.pi * (points[:, 0] - 3 * h)
    gradient = np.zeros((len(points), 3, 3))
    gradient[:, 0, 0] = -1e-3 * speed * math.pi * np.sin(phase)
    body = replace(
        ElasticBody.passive(bar, points, np.full(len(points), h**3 / 8)),
        velocities=1e-3 * speed * np.cos(phase)[:, None] * np.array([1.0, 0.0, 0.0]),
        velocity_gradients=gradient,
    )
    scene = Scene(body, (0, 0, 0), (1 + 6 * h, 3 * h, 3 * h), gravity=scenes.NO_GRAVITY)
    solver = Solver(scene, Fidelity(h, precision=64, transfer=transfer, kernel=kernel))
    solver.reset()
    dt, amplitude = 0.3 * h / speed, []
    for _ in range(320):  # three periods
        amplitude.append(float(solver.matter.v[0, 0, :, 0].numpy() @ np.cos(phase)))
        solver.substeps(1, dt)
    _, decay = fit_decay(dt * np.arange(320), np.array(amplitude), math.pi * speed)
    return 1.0 - math.exp(-decay * 2.0 / speed)


@pytest.mark.slow  # the same order is in tests/verify/accuracy/test_energy_audit.py
@pytest.mark.parametrize("kernel", get_args(Kernel))
def test_pic_damps_most_and_aflip_least(kernel: Kernel) -> None:
    """A wave's loss per period by each transfer, with the same step."""
    pic, apic, aflip = (_bar_loss(transfer, kernel) for transfer in ("pic", "apic", "aflip"))
    assert pic > 100 * apic
    # a third before AFLIP kept one share of the rest of both velocity and affine field, so that it never adds energy
    assert apic > 2 * aflip > 0


# name of the scene, tolerance, frames
EPISODES = [("flight", 1e-6, 8), ("ground", 1e-4, 8), ("sand", 1e-4, 5), ("water", 1e-4, 4)]


@pytest.mark.slow  # the transfers are differentiated alone above
@pytest.mark.parametrize(
    ("transfer", "kernel", "name", "tolerance", "frames"),
    [
        pytest.param(
            *pair,
            *episode,
            marks=_unless((pair, episode[0]) in FEW),
        )
        for pair in NEW
        for episode in EPISODES
    ],
)
def test_gradient_matches_central_differences(
    transfer: Transfer, kernel: Kernel, name: str, tolerance: float, frames: int
) -> None:
    """In every parameter group, in flight, on the ground, on sand and on water; the default is in `test_adjoint`."""
    probe = Probe(scenes.SCENES[name](), frames, fidelity=scenes.fidelity(transfer=transfer, kernel=kernel))
    gradient = probe.gradient()
    for group in GROUPS:
        direction = np.random.default_rng(7).uniform(-1.0, 1.0, probe.base[group].shape)
        assert probe.error(gradient, group, direction, tolerance) <= tolerance, group


MIXED = [("aflip", "apic"), ("apic", "aflip"), ("aflip", "pic"), ("pic", "apic")]

mixtures = pytest.mark.parametrize(
    ("robot", "medium"), [pytest.param(*pair, marks=_unless(pair == MIXED[0])) for pair in MIXED]
)


@pytest.mark.slow  # the conformance suite has the gradient of one, in the desert, and test_serial.py both drivers
@pytest.mark.parametrize(("robot", "medium"), MIXED)
def test_robot_and_medium_have_transfers_of_their_own(robot: Transfer, medium: Transfer) -> None:
    """On a bed the gradient is that of differences in every group, and both drivers agree."""
    fidelity = scenes.fidelity(transfer=robot, medium_transfer=medium)
    probe = Probe(scenes.medium_scene(), 5, fidelity=fidelity)
    gradient = probe.gradient()
    for group in GROUPS:
        direction = np.random.default_rng(7).uniform(-1.0, 1.0, probe.base[group].shape)
        assert probe.error(gradient, group, direction, 1e-4) <= 1e-4, group
    scenes.compare_drivers(scenes.medium_scene(), 4, fidelity)


@pytest.mark.slow
@mixtures
def test_different_transfers_keep_the_common_momentum(robot: Transfer, medium: Transfer) -> None:
    """A robot and a medium that collide in free flight: what a particle keeps, the nodes have not."""
    scene = replace(scenes.medium_scene(), ground=None, gravity=scenes.NO_GRAVITY)
    lift = np.array([0.0, 6 * scenes.SPACING, 0.0])
    assert scene.medium is not None
    scene = replace(
        scene,
        robot=replace(scene.robot, positions=scene.robot.positions + lift),
        medium=replace(scene.medium, positions=scene.medium.positions + lift),
    )
    solver = Solver(scene, scenes.fidelity(transfer=robot, medium_transfer=medium))
    solver.reset()
    mass, v = solver.parameters.mass[0].numpy(), solver.matter.v[0, 0].numpy()
    before, met = mass @ v, v[solver.robot_count :].copy()
    solver.substeps(60)
    assert np.abs(mass @ v - before).max() <= 1e-12 * np.abs(before).max()
    assert np.abs(v[solver.robot_count :] - met).max() > 0.01


@pytest.mark.slow
@hardest_first
def test_checkpointed_gradient_is_the_full_memory_gradient(transfer: Transfer, kernel: Kernel) -> None:
    """Bit for bit: nothing of a substep is kept on the grid that the next one would miss."""
    fidelity = scenes.fidelity(transfer=transfer, kernel=kernel)
    full, *others = (
        scenes.episode(scenes.ground_scene(), 5, fidelity, worlds=2, checkpoint_interval=interval)[2]
        for interval in (5, 1, 2)
    )
    assert full.actuation.any()
    assert [scenes.same(gradient, full) for gradient in others] == [True, True]


@pytest.mark.slow  # each compiles for ten seconds; tests/sim/kernels/test_serial.py is fast
@pytest.mark.parametrize("name", ["ground", "water"])
@pytest.mark.parametrize(("transfer", "kernel"), NEW)
def test_parallel_driver_agrees_with_the_serial_one(transfer: Transfer, kernel: Kernel, name: str) -> None:
    """Path and gradient to 1e-12 of the largest."""
    scenes.compare_drivers(scenes.SCENES[name](), 5, scenes.fidelity(transfer=transfer, kernel=kernel))


@pytest.mark.parametrize(
    ("transfer", "kernel"),
    [pytest.param(*pair, marks=_unless(pair == ("apic", "quadratic"))) for pair in scenes.COMBINATIONS],
)
def test_only_aflip_holds_a_field_for_the_motion_before_forces(transfer: Transfer, kernel: Kernel) -> None:
    """Forward and in reverse; without AFLIP the grid has no such field, so that a kernel that used it would fail."""
    solver, _, _ = scenes.episode(scenes.ground_scene(), 1, scenes.fidelity(transfer=transfer, kernel=kernel), worlds=2)
    launcher = solver.launcher
    assert launcher._grid_adjoint is not None
    for grid in (launcher._grid, launcher._grid_adjoint):
        assert (grid.shape[0] > BEFORE) == (transfer == "aflip")
        assert (grid[BEFORE:] != 0).any() == (transfer == "aflip")
