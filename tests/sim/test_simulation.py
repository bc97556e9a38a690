"""The state that solver, step control and adjoint share."""

import ast
from pathlib import Path

import numpy as np
import pytest
import torch

from tests.sim import scenes
from zoobench.sim import simulation
from zoobench.sim.model.state import BodyState
from zoobench.sim.simulation import Simulation
from zoobench.sim.solver import Solver


def _moved() -> Simulation:
    """Two worlds after some actuated substeps."""
    solver = Solver(scenes.ground_scene(), scenes.fidelity(), worlds=2)
    solver.run(scenes.actuation(solver, 2))
    return solver.simulation


def test_rewind_restores_the_state_at_time_zero() -> None:
    """Of all worlds, a dead one too, with all muscles at rest."""
    sim = _moved()
    sim.alive[1] = 0
    assert not torch.equal(sim.matter.x, sim.start.x)
    sim.rewind()
    for now, start in zip(sim.matter.tensors(), sim.start.tensors(), strict=True):
        assert torch.equal(now, start)
    assert sim.alive.tolist() == [1, 1]
    assert not sim.parameters.tension.any()


def test_restart_leaves_the_other_worlds_alone() -> None:
    """One world is at time zero again, alive."""
    sim = _moved()
    sim.alive[0] = 0
    before = sim.matter.copy_slot(0)
    sim.restart(0)
    assert torch.equal(sim.matter.F[0, 0], sim.start.F[0, 0])
    assert torch.equal(sim.matter.F[0, 1], before.F[0, 1])
    assert sim.alive.tolist() == [1, 1]


@pytest.mark.parametrize("precision", [32, 64])
def test_records_and_muscles_are_the_same_where_the_state_is(precision: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """As on a GPU, whose tensors are converted there: the same episode and gradient to rounding."""
    given = scenes.fidelity(precision)
    _, expected, gradient = scenes.episode(scenes.ground_scene(), 3, given, worlds=2)
    solver = Solver(scenes.ground_scene(), given, gradients=True, worlds=2)
    monkeypatch.setattr(solver.simulation, "_device", "cpu:0")  # another name of the CPU, as the code sees it
    found = solver.run(scenes.actuation(solver, 3))
    np.testing.assert_allclose(found.positions, expected.positions, rtol=0, atol=1e-14)
    np.testing.assert_allclose(found.velocities, expected.velocities, rtol=0, atol=1e-12)
    np.testing.assert_allclose(found.tension, expected.tension, rtol=1e-12)
    np.testing.assert_allclose(found.muscle_potential, expected.muscle_potential, rtol=1e-12)
    actuation = solver.backward(found, *scenes.path_weights(solver, 3)).actuation
    np.testing.assert_allclose(actuation, gradient.actuation, rtol=1e-12)


def test_window_holds_every_stencil_after_particles_were_moved() -> None:
    """By a whole cell: the window follows."""
    sim = _moved()
    sim.refresh_window()
    window = sim.matter.window.clone()
    sim.matter.x[0, 1, :, 0] += scenes.SPACING
    sim.refresh_window()
    assert (sim.matter.window - window)[0, :, :6].tolist() == [[0] * 6, [1, 0, 0, 1, 0, 0]]


@pytest.mark.parametrize("place", [-5.0, 99.0, 1e30, -1e30, np.inf, -np.inf, np.nan])
@pytest.mark.parametrize("everywhere", [False, True])
def test_window_holds_the_stencils_of_escaped_particles(place: float, everywhere: bool) -> None:
    """It lies in the grid and has room for a stencil, wherever one of the particles or all of them are."""
    sim = _moved()
    sim.matter.x[0, 0, 0 if not everywhere else slice(None)] = place
    sim.refresh_window()
    for low, high, nodes in zip(*sim.matter.window[0, 0, :6].view(2, 3).tolist(), sim.launcher.shape, strict=True):
        assert 0 <= low <= high - 3 <= nodes - 3
        if abs(place) < 1e9:
            assert low == 0 if place < 0 else high == nodes
        else:  # processors make different integers of it
            assert (low, high) == (0, nodes)


def test_a_body_scales_mass_and_volume_together() -> None:
    """By its occupancy, and the mass by its density ratio too."""
    sim = _moved()
    arrays = BodyState().filled(sim.scene, 2)
    sim.set_body(arrays | {"occupancy": 0.5 * arrays["occupancy"], "density_ratio": 0.5 * arrays["density_ratio"]})
    halved = sim.parameters.mass.clone(), sim.parameters.volume.clone()
    sim.set_body(arrays)
    assert np.allclose(halved[0], 0.25 * sim.parameters.mass, rtol=1e-12)
    assert np.allclose(halved[1], 0.5 * sim.parameters.volume, rtol=1e-12)


def test_step_control_and_adjoint_do_not_import_each_other() -> None:
    """They use the simulation; the solver uses all three."""
    folder = Path(simulation.__file__).parent
    users = {"step_control": {"adjoint", "solver"}, "adjoint": {"step_control", "solver"}}
    users["simulation"] = {"step_control", "adjoint", "solver"}
    for name, others in users.items():
        tree = ast.parse((folder / f"{name}.py").read_text(encoding="utf-8"))
        imported = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
        assert not imported & {f"zoobench.sim.{other}" for other in others}
