"""The substep's kernels: the window of the grid, bounds of every access, and the parallel driver against the serial."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from tests.sim import scenes
from zoobench.sim.model.fidelity import Kernel, Transfer
from zoobench.sim.model.launch_plan import LaunchPlan
from zoobench.sim.model.state import Parameters, empty_matter
from zoobench.sim.runtime import real
from zoobench.sim.solver import Solver

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("name", ["ground", "sand"])
def test_grid_outside_the_window_is_neither_read_nor_written(name: str) -> None:
    """NaN in every node before the episode changes no bit of it, and is still there behind the largest window."""
    _, expected, _ = scenes.episode(scenes.SCENES[name](), 3, worlds=2)
    solver = Solver(scenes.SCENES[name](), scenes.fidelity(), worlds=2)
    grid = solver.launcher._grid
    grid.fill_(torch.nan)
    rollout = solver.run(scenes.actuation(solver, 3))
    assert np.array_equal(rollout.positions, expected.positions)
    first = solver.simulation.start.window[0, 0]
    # in three frames no particle travels farther than two cells
    most = int((first[3:6] - first[:3] + 4).prod())
    untouched = torch.isnan(grid).all(-1)
    assert untouched[:, most:].all()
    assert 0 < most < grid.shape[1] / 4
    assert not untouched[:, : most // 8].any()


def _guarded(tensor: torch.Tensor, room: int) -> tuple[torch.Tensor, torch.Tensor]:
    """A tensor of the same shape within one that has `room` NaNs before it and after it."""
    whole = torch.full((tensor.numel() + 2 * room,), torch.nan, dtype=tensor.dtype)
    return whole, whole[room:-room].view(tensor.shape)


@pytest.mark.parametrize("place", [-9.0, 9.0, 1e30, -1e30, np.inf, np.nan])
@pytest.mark.parametrize(("name", "precision"), [("ground", 32), pytest.param("water", 64, marks=pytest.mark.slow)])
def test_an_escaped_particle_writes_nothing_out_of_bounds(name: str, precision: int, place: float) -> None:
    """Nothing before or behind the grid, nor behind the window in it, which holds every stencil after every substep,
    with momenta kept for the reverse or not, and in the reverse."""
    solver = Solver(scenes.SCENES[name](), scenes.fidelity(precision), worlds=2)
    sim, launcher, slots, kind = solver.simulation, solver.launcher, 4, real(precision)
    sim.matter.x[0, 0, 5, 1] = place
    sim.refresh_window()
    whole, launcher._grid = _guarded(launcher._grid, 4000)
    adjoints, launcher._grid_adjoint = _guarded(launcher._grid, 4000)
    tape = empty_matter(sim.scene, slots, 2, kind, "cpu")
    tape.load_slot(0, sim.matter)
    plan = LaunchPlan.none(2, kind, "cpu")
    plan.set(np.zeros(2, np.int64), np.full(2, slots - 1), np.full(2, sim.limit.dt))
    launcher.advance(tape, sim.parameters, plan, 1)
    lower, upper = tape.window[..., :3], tape.window[..., 3:6]
    nodes = torch.tensor(launcher.shape)
    assert (lower >= 0).all()
    assert (upper <= nodes).all()
    first = torch.floor(tape.x * 32 - 0.5)
    known = first.abs() < 2**30
    first = first.clamp(min=0.0).minimum(nodes - 3.0)
    assert torch.where(known, first >= lower[:, :, None], True).all()
    assert torch.where(known, first + 3 <= upper[:, :, None], True).all()
    launcher.reverse(
        tape,
        sim.parameters,
        plan,
        empty_matter(sim.scene, 1, 2, kind, "cpu"),
        Parameters.zeros(2, sim.robot_count, sim.particle_count, kind, "cpu"),
    )
    most = int((upper - lower).prod(-1).max())
    for around, grid in ((whole, launcher._grid), (adjoints, launcher._grid_adjoint)):
        assert torch.isnan(around[:4000]).all()
        assert torch.isnan(around[-4000:]).all()
        assert torch.isnan(grid[:, most:]).all()


@pytest.mark.parametrize(
    "name",
    [
        # the other scenes of a GPU's driver take five to twenty seconds each to compile here
        "ground",
        *(
            pytest.param(name, marks=pytest.mark.slow)
            for name in ("wading", "flight", "interface", "sand", "clay", "mud", "snow", "water")
        ),
    ],
)
def test_parallel_driver_agrees_with_the_serial_one(name: str) -> None:
    """Path and gradient to 1e-12; on one thread even the order of the additions is nearly the same."""
    serial, parallel = scenes.compare_drivers(scenes.SCENES[name](), 3)
    assert np.abs(parallel.velocities - serial.velocities).max() <= 1e-12 * np.abs(serial.velocities).max()


@pytest.mark.slow
def test_the_parallel_driver_takes_water_to_the_walls() -> None:
    """Where two walls meet, a node is pressed by both, in another order than in turn."""
    scene = scenes.wading_scene()
    assert scene.medium is not None
    water = replace(scenes.medium_bed("water", first=0), friction=0.0, transfer="aflip")
    aside = replace(scene.robot, positions=scene.robot.positions - 8 * scenes.SPACING * np.array([1.0, 0.0, 1.0]))
    serial, parallel = scenes.compare_drivers(replace(scene, robot=aside, medium=water), 3)
    assert np.abs(parallel.velocities - serial.velocities).max() <= 1e-12 * np.abs(serial.velocities).max()


SAFETY = """
import sys
from tests.sim import scenes
from zoobench.sim import runtime
name, transfer, kernel = sys.argv[1:]
fidelity = scenes.fidelity(transfer=transfer, kernel=kernel)
solver, rollout, _ = scenes.episode(scenes.SCENES[name](), 2, fidelity, worlds=2)
assert not rollout.divergences
print("safe")
solver.parameters.body = solver.parameters.body[:, :9].clone()
try:
    solver.substeps(1)
except Exception as error:
    print("caught" if "Out of bound access" in str(error) else error)
runtime.stop()
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "transfer", "kernel"),
    [
        (name, *pair)
        for number, pair in enumerate(scenes.COMBINATIONS)
        for name in (("ground", "water") if number else scenes.SCENES)
    ],
)
def test_no_access_out_of_bounds(name: str, transfer: Transfer, kernel: Kernel) -> None:
    """Forward and reverse pass the kernel compiler's bounds checks, which a read beyond too short an array does not."""
    environment = os.environ | {"ZOOBENCH_DEBUG": "1"}
    command = [sys.executable, "-c", SAFETY, name, transfer, kernel]
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=900)
    assert done.stdout.split() == ["safe", "caught"], done.stdout + done.stderr
