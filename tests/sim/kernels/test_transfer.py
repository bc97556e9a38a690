"""The six combinations of transfer and kernel: their conserved quantities, dissipation and gradients."""
# ruff: noqa: ANN201  (the arguments of kernels are typed by the kernel compiler)

import math
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest
import taichi as ti

from tests.sim import scenes
from tests.sim.kernels.law_kernels import tensors
from tests.sim.test_adjoint import GROUPS, Probe
from zoobench.sim.kernels.array_types import Matrices, Nodes, Vectors
from zoobench.sim.kernels.transfer import AFLIP, APIC, gather
from zoobench.sim.model.fidelity import SPLINES, Fidelity, Kernel, Transfer
from zoobench.sim.model.lattice import fill_box
from zoobench.sim.model.matter import ElasticMaterial
from zoobench.sim.model.scene import ElasticBody, Scene
from zoobench.sim.solver import Solver
from zoobench.verify.validate.waves import fit_decay

H = scenes.SPACING
NEW = scenes.COMBINATIONS[1:]
HARDEST = ("aflip", "cubic")
FEW = ((("pic", "quadratic"), "flight"), (HARDEST, "ground"))
"""Beside the default, both other transfers and the other kernel."""

combinations = pytest.mark.parametrize(("transfer", "kernel"), scenes.COMBINATIONS)


def _unless(is_fast: bool) -> tuple[pytest.MarkDecorator, ...]:
    """The marks of a case: each compiles kernels of its own, so that few can be fast."""
    return () if is_fast else (pytest.mark.slow,)


hardest_first = pytest.mark.parametrize(
    ("transfer", "kernel"), [pytest.param(*pair, marks=_unless(pair == HARDEST)) for pair in NEW]
)


@ti.kernel
def gather_all(
    grid: Nodes, x: Vectors, v: Vectors, C: Matrices, h: float, width: ti.template(), transfer: ti.template()
):  # fmt: skip
    """Velocity and affine matrix at places."""
    for p in range(x.shape[0]):
        velocity, affine = gather(grid, 0, x[p], 1.0 / h, width, transfer)
        v[p] = velocity
        C[p] = affine


@pytest.mark.parametrize("transfer", [APIC, AFLIP])
@pytest.mark.parametrize("kernel", get_args(Kernel))
def test_gather_reproduces_affine_fields(kernel: Kernel, transfer: int) -> None:
    """Velocity and matrix of v = a + B x to round-off, whether the loops are unrolled or not."""
    rng = np.random.default_rng(1)
    a, B, places = rng.normal(size=3), rng.normal(size=(3, 3)), H * rng.uniform(2.0, 9.0, (200, 3))
    nodes = H * np.indices((12, 12, 12)).transpose(1, 2, 3, 0)
    grid = np.concatenate([a + nodes @ B.T, np.ones((12, 12, 12, 1))], axis=-1)[None]
    given = tensors(64, grid, places, 0 * places, np.zeros((200, 3, 3)))
    gather_all(*given, H, SPLINES[kernel].width, transfer)
    assert np.abs(given[2].numpy() - (a + places @ B.T)).max() <= 1e-14
    assert np.abs(given[3].numpy() - B).max() <= 1e-12


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
    assert apic > 3 * aflip > 0


# name of the scene, tolerance, frames
EPISODES = [("flight", 1e-6, 8), ("ground", 1e-4, 8), ("sand", 1e-4, 5), ("water", 1e-4, 4)]


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


@pytest.mark.parametrize("name", ["ground", pytest.param("water", marks=pytest.mark.slow)])
@hardest_first
def test_parallel_driver_agrees_with_the_serial_one(transfer: Transfer, kernel: Kernel, name: str) -> None:
    """Path and gradient to 1e-12 of the largest."""
    scenes.compare_drivers(scenes.SCENES[name](), 5, scenes.fidelity(transfer=transfer, kernel=kernel))


@pytest.mark.parametrize(
    ("transfer", "kernel"),
    [pytest.param(*pair, marks=_unless(pair in (("apic", "quadratic"), HARDEST))) for pair in scenes.COMBINATIONS],
)
def test_only_aflip_holds_a_slab_for_the_motion_before_forces(transfer: Transfer, kernel: Kernel) -> None:
    """Forward and in reverse; without AFLIP the arrays are empty, so that a kernel that used them would fail."""
    solver, _, _ = scenes.episode(scenes.ground_scene(), 1, scenes.fidelity(transfer=transfer, kernel=kernel), worlds=2)
    launcher = solver.launcher
    nodes = launcher._grid.numel()
    held = [grid.numel() for grid in (*launcher._grids[1:], *launcher._reverse_grids)]
    assert held == ([nodes, 0, nodes, nodes, nodes, 0] if transfer == "aflip" else [0, 0, nodes, nodes, 0, 0])
