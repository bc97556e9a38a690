"""The work of the muscles against the energy that the body gains."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sim.scenes import SOFT, fidelity, flight_scene, weightless
from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.lattice import fill_box, particle_volume
from zoobench.sim.model.laws.elastic import lame_parameters, neo_hookean_energy
from zoobench.sim.model.rollout import Rollout
from zoobench.sim.solver import Solver

FRAMES = 15


def _swimming_bar(spacing: float) -> tuple[Solver, Rollout]:
    """A weightless bar of which an upper and a lower muscle contract and relax, so that it shortens and bends."""
    corner = np.array([0.25, 0.3125, 0.3125])
    positions = fill_box(corner, corner + np.array([0.25, 0.125, 0.125]), spacing, 8)
    upper = (positions[:, 1] > 0.375).astype(float)
    bar = ElasticBody.passive(SOFT, positions, np.full(len(positions), particle_volume(spacing, 8)))
    bar = replace(bar, muscle_membership=np.stack([upper, 1 - upper], axis=1))
    solver = Solver(weightless(bar), Fidelity(spacing, precision=64))
    times = 0.008 * np.arange(FRAMES)
    activity = np.stack([0.5 * np.sin(20 * times + 0.5), -0.4 * np.cos(30 * times)], axis=1)
    return solver, solver.run(activity[:, None])


def _energy(solver: Solver) -> float:
    """Kinetic, the affine motion of the particles included, and elastic [J]."""
    mass, volume = solver.parameters.mass[0].numpy(), solver.parameters.volume[0].numpy()
    v, C, F = (field[0, 0].numpy() for field in (solver.matter.v, solver.matter.C, solver.matter.F))
    moment = solver.fidelity.grid_spacing**2 / 4
    kinetic = 0.5 * mass * ((v**2).sum(1) + moment * (C**2).sum((1, 2)))
    elastic = volume * neo_hookean_energy(F, *lame_parameters(SOFT.youngs_modulus, SOFT.poissons_ratio))
    return float((kinetic + elastic).sum())


def test_the_muscles_work_becomes_the_bodys_energy() -> None:
    """Nothing else does work on it: the difference is the transfer's dissipation, which halves with the grid."""
    missing = []
    for spacing in (1 / 32, 1 / 64):
        solver, rollout = _swimming_bar(spacing)
        missing.append(1.0 - _energy(solver) / rollout.muscle_work.sum())
    assert 0.0 < missing[1] < 0.08
    assert missing[1] < 0.55 * missing[0]


def test_the_potential_at_rest_is_half_the_strength_times_the_volume() -> None:
    """Q = s / 2 sum w V at F = 1, with the occupied part of the volume; muscles at rest do no work."""
    scene = flight_scene()
    solver = Solver(scene, fidelity())
    rollout = solver.run(np.zeros((2, 1, solver.muscle_count)))
    robot = scene.robot
    volumes = robot.muscle_membership * (robot.occupancy * robot.volumes)[:, None]
    assert rollout.muscle_potential[0, 0] == pytest.approx(0.5 * SOFT.muscle_strength * volumes.sum(0))
    assert (rollout.muscle_work == 0.0).all()
