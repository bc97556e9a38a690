"""The nodes' momentum in the middle of a substep."""

import numpy as np
import pytest

from tests.sim.scenes import fidelity, flight_scene, medium_scene
from zoobench.sim.model.fidelity import Transfer
from zoobench.sim.solver import Solver


@pytest.mark.parametrize(
    "transfer", ["apic", *(pytest.param(name, marks=pytest.mark.slow) for name in ("pic", "aflip"))]
)
def test_the_nodes_hold_what_the_substep_then_makes_velocities_of(transfer: Transfer) -> None:
    """In free flight nothing else happens to them; together they have the particles' momentum and mass."""
    solver = Solver(flight_scene(), fidelity(transfer=transfer))
    solver.substeps(20)
    matter, parameters, dt = solver.matter, solver.parameters, solver.dt
    window = matter.window[0, 0].clone()
    mass, velocity = (tensor.numpy().copy() for tensor in (parameters.mass[0], matter.v[0, 0]))
    held = solver.launcher.momenta(matter, parameters, dt).numpy()
    solver.substeps(1, dt)
    after = solver.launcher.nodes(window).numpy()
    there = held[..., 3] > 0.0
    np.testing.assert_allclose(held[there][:, :3], (after[..., :3] * after[..., 3:])[there], rtol=1e-9, atol=1e-15)
    assert held[..., 3].sum() == pytest.approx(mass.sum())
    np.testing.assert_allclose(held[..., :3].sum((0, 1, 2, 3)), mass @ velocity, rtol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("medium", ["sand", "water"])
def test_looking_changes_nothing(medium: str) -> None:
    """The substeps after it are those that would have been taken."""
    ends = []
    for look in (False, True):
        solver = Solver(medium_scene(medium), fidelity())
        for _ in range(5):
            if look:
                solver.launcher.momenta(solver.matter, solver.parameters, solver.dt)
            solver.substeps(1)
        ends.append(solver.matter.x[0].numpy().copy())
    assert (ends[0] == ends[1]).all()
