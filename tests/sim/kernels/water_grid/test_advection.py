"""Water alone: how little of a vortex is lost, and the adjoint of its substep."""

import numpy as np
import pytest
import torch

from tests.sim.wet_scenes import CELLS, divergence, empty_water, fine, flow_of, stirred
from zoobench.arrays import Array
from zoobench.sim.model.launch_plan import LaunchPlan
from zoobench.sim.model.state import Matter, Parameters
from zoobench.sim.solver import Solver


def taylor_green(speed: float, cells: int, spacing: float) -> Array:
    """A quarter of a Taylor-Green vortex of this wavelength by two, from wall to wall, four cells deep [m/s]."""
    k = np.pi / (cells * spacing)
    face, centre = np.arange(cells) * spacing, (np.arange(cells) + 0.5) * spacing
    velocities = np.zeros((cells, cells, 4, 3))
    velocities[..., 0] = (speed * np.outer(np.sin(k * face), np.cos(k * centre)))[:, :, None]
    velocities[..., 1] = (-speed * np.outer(np.cos(k * centre), np.sin(k * face)))[:, :, None]
    return velocities


@pytest.mark.parametrize("speed", [pytest.param(0.02, marks=pytest.mark.slow), 0.2])
def test_a_vortex_lasts(speed: float) -> None:
    """A Taylor-Green vortex with a wavelength of 16 cells keeps its speed for a quarter of a second, slow or fast."""
    given = taylor_green(speed, 8, 1 / 64)
    solver = Solver(empty_water(given, 1 / 64), fine(64, 1 / 64))
    solver.substeps(500, 5e-4)
    assert np.sqrt(np.square(flow_of(solver)).sum() / np.square(given).sum()) == pytest.approx(1.0, abs=0.006)


@pytest.mark.parametrize(("cells", "spacing", "least"), [(3, 1 / 64, 200.0), (5, 1 / 96, 600.0)])
def test_vortices_of_a_few_cells_decay_as_in_water_of_hundreds(cells: int, spacing: float, least: float) -> None:
    """What they lose is what the viscosity of a Reynolds number of hundreds would take, of 0.1 m at 50 mm/s."""
    given = taylor_green(0.05, cells, spacing)
    solver = Solver(empty_water(given, spacing), fine(64, spacing))
    solver.substeps(250, 1e-3)
    left = np.sqrt(np.square(flow_of(solver)).sum() / np.square(given).sum())
    viscosity = -np.log(left) / (2 * (np.pi / (cells * spacing)) ** 2 * 0.25)
    assert left < 1.0
    assert 0.1 * 0.05 / viscosity >= least


@pytest.mark.parametrize(("precision", "bound"), [(64, 1e-13), pytest.param(32, 1e-6, marks=pytest.mark.slow)])
@pytest.mark.parametrize("cells", [CELLS, (5, 4, 13)])
def test_water_is_incompressible(precision: int, bound: float, cells: tuple[int, int, int]) -> None:
    """A substep leaves no divergence, whatever the number of cells."""
    solver = Solver(empty_water(stirred(cells), 1 / 32), fine(precision))
    solver.substeps(1, 1e-3)
    assert np.abs(divergence(flow_of(solver))).max() <= bound


@pytest.mark.slow  # test_immersed.py has exact gradients through the same flow
def test_adjoint_of_the_flow() -> None:
    """The adjoint of twenty substeps by the water's velocity agrees with central differences."""
    rng, steps, scene = np.random.default_rng(0), 20, empty_water(stirred(), 1 / 32)
    solver = Solver(scene, fine(), gradients=True)
    sim, real = solver.simulation, torch.float64
    tape = sim.matter.extended(steps + 1)
    plan = LaunchPlan.none(1, real, "cpu")
    plan.set(np.zeros(1, np.int64), np.full(1, steps), np.full(1, 1e-3))
    weights = torch.as_tensor(rng.normal(size=sim.matter.flow.shape))
    way = stirred(seed=6).reshape(1, 1, -1, 3)

    def value(distance: float) -> float:
        tape.load_slot(0, sim.start)
        tape.flow[0, :, :, :3] += torch.as_tensor(distance * way[0])
        solver.launcher.advance(tape, sim.parameters, plan, 1)
        return float((tape.flow[steps] * weights[0]).sum())

    value(0.0)
    adjoint = Matter.zeros(1, 1, 1, 0, False, real, "cpu", weights.shape[2])
    adjoint.flow[:] = weights
    solver.launcher.reverse(tape, sim.parameters, plan, adjoint, Parameters.zeros(1, 1, 1, real, "cpu"))
    exact = float((adjoint.flow[..., :3].numpy() * way).sum())
    # the pressure over the step is large beside the velocity: small distances are lost in round-off
    difference = (value(1e-5) - value(-1e-5)) / 2e-5
    assert exact == pytest.approx(difference, rel=1e-6)
