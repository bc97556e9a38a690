"""The substep's kernels: the window of the grid, bounds of every access, and the parallel driver against the serial."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch

from tests.sim import scenes
from zoobench.sim.model.fidelity import Kernel, Transfer
from zoobench.sim.solver import Solver

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("name", ["ground", "sand"])
def test_grid_outside_the_window_is_neither_read_nor_written(name: str) -> None:
    """NaN in every node before the episode changes no bit of it, and is still there far from the matter."""
    _, expected, _ = scenes.episode(scenes.SCENES[name](), 3, worlds=2)
    solver = Solver(scenes.SCENES[name](), scenes.fidelity(), worlds=2, gradients=True)
    grid = solver.launcher._grid
    grid.fill_(torch.nan)
    rollout = solver.run(scenes.actuation(solver, 3))
    assert np.array_equal(rollout.positions, expected.positions)
    touched = ~torch.isnan(grid[0]).any(-1)
    places = torch.nonzero(touched)
    low, high = places.amin(0), places.amax(0)
    first = solver.simulation.start.window[0, 0]
    # in three frames no particle travels farther than two cells
    assert (low >= first[:3] - 2).all()
    assert (high < first[3:] + 2).all()
    assert 0 < int(touched.sum()) < touched.numel() / 4


@pytest.mark.parametrize(
    "name",
    ["sand", *(pytest.param(name, marks=pytest.mark.slow) for name in ("ground", "clay", "mud", "snow", "water"))],
)
def test_parallel_driver_agrees_with_the_serial_one(name: str) -> None:
    """Path and gradient to 1e-12; on one thread even the order of the additions is nearly the same."""
    serial, parallel = scenes.compare_drivers(scenes.SCENES[name](), 3)
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
solver.parameters.mass = solver.parameters.mass[:, :9].clone()
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
