"""Limbs of a robot in its rest frame that meet: they do not pass through each other, by forces with exact gradients."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sim import scenes
from zoobench.arrays import Array
from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.model.scene import Scene
from zoobench.sim.solver import Solver

LAGRANGIAN = replace(scenes.fidelity(), robot="lagrangian")


def _row_scene() -> Scene:
    """A cube that flies into a plate, behind which another cube is, at rest as the plate."""
    lengths, edge = ((6, 1.5), (3, 0.0), (6, 0.0)), scenes.EDGE
    places, speeds, first = [], [], 0.1
    for length, speed in lengths:
        corner = np.array([first, 0.3, 0.3])
        places.append(scenes.fill_box(corner, corner + edge * np.array([length, 6, 6]), scenes.SPACING, 8))
        speeds.append(np.full(len(places[-1]), speed))
        first += (length + 3) * edge
    cubes = np.concatenate(places)
    body = ElasticBody.passive(replace(scenes.SOFT, viscosity=20.0), cubes, np.full(len(cubes), edge**3))
    return scenes.weightless(
        scenes.with_idle_muscle(replace(body, velocities=np.concatenate(speeds)[:, None] * (1.0, 0.0, 0.0)))
    )


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
        found.append(scenes.node_momenta(solver))
    assert _distance(rollout.positions).min() < 3.5
    mass = (robot.volumes * robot.density_ratio * robot.occupancy).sum() * robot.material.density
    np.testing.assert_allclose(found[1][0], found[0][0], atol=1e-12 * mass)
    np.testing.assert_allclose(found[1][1], found[0][1], atol=1e-12 * mass)


def test_limbs_far_from_each_other_are_not_looked_at() -> None:
    """No pair of parts is on the list of those that may meet until they come near."""
    for approach, near in ((0.2, False), (4.0, True)):
        solver = Solver(scenes.pair_scene(approach), LAGRANGIAN)
        solver.run(np.zeros((2, 1, scenes.MUSCLES)))
        assert bool(solver.launcher._limbs[-1][0, -1] > 0) == near  # type: ignore[attr-defined]


@pytest.mark.slow
def test_limbs_that_meet_within_a_frame_are_not_missed() -> None:
    """What a plate hits that was at rest when the frame began; ten times as many frames give every bit of the path."""
    given = replace(LAGRANGIAN, step=5e-4)
    long, short = (
        Solver(_row_scene(), given, frame_seconds=seconds).run(np.zeros((round(0.16 / seconds), 1, 1)))
        for seconds in (0.08, 0.008)
    )
    assert not long.divergences
    struck = long.velocities[-1, 0, -6 * 6 * 6 :, 0].mean()
    assert struck > 0.3
    np.testing.assert_array_equal(long.positions[-1], short.positions[-1])


@pytest.mark.slow
def test_gradient_is_the_same_however_little_is_kept() -> None:
    """Frames in pieces give every bit of the path, and of the gradient all but the order of its sums."""
    scene, given = _row_scene(), replace(LAGRANGIAN, step=5e-4)
    state = sum(each.numel() * each.element_size() for each in Solver(scene, given).matter.tensors())
    found = []
    for memory in (None, 20 * state):
        solver = Solver(scene, given, frame_seconds=0.04, gradients=True, memory=memory)
        rollout = solver.run(np.zeros((4, 1, 1)))
        weights = scenes.path_weights(solver, 4)
        found.append((rollout, solver.backward(rollout, *weights)))
    assert found[0][0].segmentation != found[1][0].segmentation
    assert np.array_equal(found[0][0].positions, found[1][0].positions)
    for name in scenes.GROUPS:
        one, other = (getattr(gradient, name) for _, gradient in found)
        assert np.abs(one - other).max() <= 1e-12 * np.abs(one).max(), name


@pytest.mark.slow
def test_empty_particles_that_meet_have_finite_gradients() -> None:
    """In single precision, where their strengths squared are nothing."""
    scene = scenes.pair_scene(4.0)
    hollow = replace(scene.robot, occupancy=np.where(np.arange(scene.robot.particle_count) % 3, 0.0, 0.8))
    given = replace(LAGRANGIAN, precision=32)
    _, rollout, gradient = scenes.episode(replace(scene, robot=hollow), 4, given, density_ratio_min=0.5)
    assert not rollout.divergences
    assert np.diff(_distance(rollout.velocities * scenes.SPACING)).max() > 0.1  # they push each other
    assert all(np.isfinite(getattr(gradient, name)).all() for name in scenes.GROUPS)


@pytest.mark.slow
@pytest.mark.parametrize("approach", [0.2, 1.0])
def test_a_collision_without_damping_adds_little_energy(approach: float) -> None:
    """At the default Courant fraction and in single precision; kinetic energy afterwards is what strain gives back."""
    scene = scenes.pair_scene(approach)
    whole = replace(
        scene.robot, material=replace(scenes.SOFT, viscosity=0.0), density_ratio=np.ones(432), occupancy=np.ones(432)
    )
    rollout = Solver(replace(scene, robot=whole), replace(LAGRANGIAN, precision=32, courant=0.7)).run(
        np.zeros((round(0.6 / approach / 0.008), 1, scenes.MUSCLES))
    )
    energies = np.square(rollout.velocities[:, 0]).sum(axis=(1, 2))
    assert not rollout.divergences
    assert np.diff(_distance(rollout.velocities * scenes.SPACING)).max() > 0.01 * approach
    assert energies.max() < 1.2 * energies[0]


def test_gradient_through_a_collision_agrees_with_differences() -> None:
    """Of every group of parameters, along a random direction, for random adjoints of the trajectory."""
    rollout = scenes.compare_with_differences(scenes.pair_scene(4.0, 0.5), 5, LAGRANGIAN)
    assert np.diff(_distance(rollout.velocities * scenes.SPACING)).max() > 0.5  # they push each other
