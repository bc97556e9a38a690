"""Velocity gradients on the host against the kernels'."""

from typing import get_args

import numpy as np
import pytest

from tests.sim import scenes
from zoobench.sim.model.fidelity import Kernel
from zoobench.sim.solver import Solver
from zoobench_verify.accuracy.grid_rates import grid_rates
from zoobench_verify.energies import to_array


@pytest.mark.parametrize(
    "kernel", ["quadratic", *(pytest.param(name, marks=pytest.mark.slow) for name in get_args(Kernel)[1:])]
)
def test_rates_are_those_that_the_kernels_gather(kernel: Kernel) -> None:
    """With APIC a particle's affine field after a substep is what it gathered from the nodes."""
    body = scenes.thrown_body(
        np.array([0.3, -0.2, 0.1]), np.array([[0.0, -6.0, 1.0], [5.0, 0.5, -3.0], [-1.0, 4.0, 1.0]])
    )
    solver = Solver(scenes.weightless(body), scenes.fidelity(kernel=kernel))
    solver.reset()
    solver.substeps(3)
    window, places = solver.matter.window[0, 0].clone(), to_array(solver.matter.x[0, 0]).copy()
    solver.substeps(1)
    nodes = to_array(solver.launcher.nodes(window))[0]
    found = grid_rates(nodes, to_array(window)[:3], places, solver.fidelity)
    expected = to_array(solver.matter.C[0, 0])
    assert np.abs(found - expected).max() <= 1e-10 * np.abs(expected).max()
