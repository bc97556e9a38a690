"""Viscosity of elastic matter: the Kelvin-Voigt bar, and robots that it keeps whole."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sim import scenes
from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.step_limits import isolated_particle_limit
from zoobench.sim.solver import Solver

LENGTH = 12 * scenes.SPACING


def _ringing(viscosity: float, seconds: float) -> float:
    """Amplitude left of a free bar's first longitudinal mode: velocity, and displacement by the mode's frequency."""
    material = ElasticMaterial(youngs_modulus=1e4, poissons_ratio=0.0, density=1000.0, viscosity=viscosity)
    block = scenes.passive_block((0.15, 0.3, 0.3), (12, 2, 2), np.zeros(3))
    k = np.pi / LENGTH
    shape = np.cos(k * (block.positions[:, 0] - 0.15))
    velocities = np.zeros_like(block.positions)
    velocities[:, 0] = 1e-3 * shape
    body: ElasticBody = replace(block, material=material, velocities=velocities)
    # the same step with and without, since the scheme's own damping is that of a step
    fidelity = replace(scenes.fidelity(), step=2e-3)
    solver = Solver(scenes.weightless(body), fidelity)
    rollout = solver.run(np.zeros((round(seconds / 0.008), 1, 0)))
    moved = (rollout.positions[-1, 0] - body.positions)[:, 0] @ shape
    speed = rollout.velocities[-1, 0, :, 0] @ shape
    return float(np.hypot(moved * k * np.sqrt(10.0), speed))


@pytest.mark.parametrize("viscosity", [5.0, 10.0])
def test_bar_rings_down_as_a_kelvin_voigt_bar_does(viscosity: float) -> None:
    """The mode decays with eta k^2 / rho, to 3 % of the logarithm, the scheme's own damping taken off."""
    seconds = 0.48
    found = np.log(_ringing(0.0, seconds) / _ringing(viscosity, seconds)) / seconds
    assert found == pytest.approx(viscosity * (np.pi / LENGTH) ** 2 / 1000.0, rel=0.03)


def test_viscosity_shortens_the_step() -> None:
    """The declared and the chosen step keep w dt^2 + 2 d dt <= 4 with the viscosity of the lightest particle."""
    calm = scenes.flight_scene()
    scene = replace(calm, robot=replace(calm.robot, material=replace(calm.robot.material, viscosity=20.0)))
    thick, thin = Solver(scene, scenes.fidelity()), Solver(calm, scenes.fidelity())
    assert thick.limit.dt_iso < thin.limit.dt_iso
    lightest = 1000.0 * scene.robot.density_ratio.min()
    here, there = thick.current_limit()[0], thin.current_limit()[0]
    stiffness = 4.0 * (scenes.SPACING / (2.0 * there.dt_iso)) ** 2
    # the stiffest particle need not be the lightest one: the bound takes the worst of both
    assert here.dt_iso == pytest.approx(
        isolated_particle_limit(scenes.fidelity(), stiffness, 20.0 / lightest), rel=1e-9
    )


def test_robot_that_is_torn_is_noticed_once() -> None:
    """Pulled apart by its muscles: the first frame with neighbours a cell apart, the particle and the advice."""
    scene = scenes.flight_scene(moving=False)
    strong = replace(scene.robot, material=replace(scenes.SOFT, muscle_strength=6e3))
    solver = Solver(replace(scene, robot=strong), scenes.fidelity(), worlds=2)
    actuation = np.zeros((12, 2, scenes.MUSCLES))
    actuation[2:, 1] = -1.0
    rollout = solver.run(actuation)
    assert set(rollout.tears) == {1}
    found = rollout.tears[1]
    assert found.frame > 2
    assert found.value > found.limit == 2.0
    assert "The robot is torn" in str(found)
