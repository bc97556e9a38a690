"""Limbs of a robot in its rest frame that meet: they do not pass through each other, by forces with exact gradients."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sim import scenes
from zoobench.arrays import Array
from zoobench.sim.solver import Solver

LAGRANGIAN = replace(scenes.fidelity(), robot="lagrangian")


def _distance(places: Array) -> Array:
    """Between the middles of the cubes, along x `[frames]` [cells]."""
    one, other = np.split(places[:, 0, :, 0], 2, axis=1)
    found: Array = (other.mean(axis=1) - one.mean(axis=1)) / scenes.SPACING
    return found


@pytest.mark.parametrize(("approach", "aside"), [(0.5, 0.0), (1.0, 0.3)])
def test_cubes_that_meet_bounce(approach: float, aside: float) -> None:
    """They come back, also where particles of one face the gaps of the other, and never are within each other."""
    rollout = Solver(scenes.pair_scene(approach, aside), LAGRANGIAN).run(np.zeros((100, 1, scenes.MUSCLES)))
    distance = _distance(rollout.positions)
    assert not rollout.divergences
    assert 2.0 < distance.min() < 3.5
    assert distance[-1] > 3.6


def test_momentum_is_kept_in_a_collision() -> None:
    """Linear and angular momentum, as the forces are central and by pairs."""
    scene = scenes.pair_scene(1.0, 0.3)
    solver = Solver(scene, replace(LAGRANGIAN, step=2e-4))
    robot, found = scene.robot, []
    for frames in (1, 40):
        rollout = solver.run(np.zeros((frames, 1, scenes.MUSCLES)))
        assert not rollout.divergences
        nodes, inverse = (each[0].numpy() for each in (solver.matter.nodes[0], solver.launcher._tables[8]))  # type: ignore[attr-defined]
        momenta = nodes[:, 1, :3] / inverse[:, None]
        found.append((momenta.sum(axis=0), np.cross(nodes[:, 0, :3], momenta).sum(axis=0)))
    assert _distance(rollout.positions).min() < 3.5
    mass = (robot.volumes * robot.density_ratio * robot.occupancy).sum() * robot.material.density
    np.testing.assert_allclose(found[1][0], found[0][0], atol=1e-12 * mass)
    np.testing.assert_allclose(found[1][1], found[0][1], atol=1e-12 * mass)


def test_limbs_far_from_each_other_are_not_looked_at() -> None:
    """No pair of parts is on the list of those that may meet until they come near."""
    for approach, near in ((0.2, False), (4.0, True)):
        solver = Solver(scenes.pair_scene(approach), LAGRANGIAN)
        solver.run(np.zeros((2, 1, scenes.MUSCLES)))
        assert bool(solver.launcher._tables[13][0, -1] > 0) == near  # type: ignore[attr-defined]


def test_gradient_through_a_collision_agrees_with_differences() -> None:
    """Of every group of parameters, along a random direction, for random adjoints of the trajectory."""
    rollout = scenes.compare_with_differences(scenes.pair_scene(4.0, 0.5), 5, LAGRANGIAN)
    assert np.diff(_distance(rollout.velocities * scenes.SPACING)).max() > 0.5  # they push each other
