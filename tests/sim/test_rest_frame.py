"""Robots in their rest frame: closed forms, conservation laws, exact gradients, and what is refused."""

import re
from dataclasses import fields, replace

import numpy as np
import pytest

from tests.sim import scenes
from zoobench.errors import UsageError
from zoobench.sim.equilibrium import equilibrated
from zoobench.sim.model.elastic_bodies import BodyParticles, ElasticBody
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.scene import Ground, Scene
from zoobench.sim.model.terrain import Terrain
from zoobench.sim.solver import BodyState, Solver

LAGRANGIAN = replace(scenes.fidelity(), robot="lagrangian")


def _steady(scene: Scene, precision: int = 64) -> Fidelity:
    """A fixed step that is safe for the scene."""
    given = replace(LAGRANGIAN, precision=precision)  # type: ignore[arg-type]
    return replace(given, step=Solver(scene, given).dt)


@pytest.mark.parametrize(("precision", "tolerance"), [(64, 1e-10), pytest.param(32, 1e-4, marks=pytest.mark.slow)])
def test_free_fall_follows_the_exact_discrete_solution(precision: int, tolerance: float) -> None:
    """A thrown body takes y_n = y_0 + v n dt - g dt^2 n (n + 1) / 2, every particle alike."""
    start = np.array([0.1, 1.5, -0.1])
    # viscous, as the others here, so that the kernels are theirs: it is not strained
    body = replace(scenes.thrown_body(start), material=replace(scenes.SOFT, viscosity=20.0))
    scene = Scene(body, (0, 0, 0), scenes.ARENA)
    solver = Solver(scene, _steady(scene, precision))
    rollout = solver.run(np.zeros((35, 1, scenes.MUSCLES)))
    assert not rollout.divergences
    exact = scenes.thrown(solver, start, 35)
    moved = (rollout.positions - scene.robot.positions)[:, 0]
    assert np.abs(moved - exact[:, None]).max() <= tolerance * np.abs(exact).max()


def test_momentum_and_angular_momentum_are_conserved() -> None:
    """A spinning, actuated, viscous body without gravity and contact keeps both."""
    spin = np.array([[0.0, -4.0, 1.0], [4.0, 0.0, -2.0], [-1.0, 2.0, 0.0]])
    body = scenes.thrown_body(np.array([0.1, 0.15, -0.05]), spin)
    scene = scenes.weightless(replace(body, material=replace(scenes.SOFT, viscosity=20.0)))
    solver = Solver(scene, _steady(scene))
    acts = scenes.actuation(solver, 40)
    solver.run(acts[:1])
    linear, angular = scenes.node_momenta(solver)
    rollout = solver.run(acts)
    assert not rollout.divergences
    linear_end, angular_end = scenes.node_momenta(solver)
    assert np.ptp(np.linalg.norm(rollout.positions[-1, 0] - rollout.positions[-1, 0].mean(0), axis=1)) > 0.02
    assert np.abs(linear_end - linear).max() <= 1e-12 * np.linalg.norm(linear)
    assert np.abs(angular_end - angular).max() <= 1e-12 * np.linalg.norm(angular)


def test_muscle_reaches_its_equilibrium_stretch() -> None:
    """A slowly activated block takes the stretch at which passive and active stress cancel (validation case V16)."""
    strong = replace(scenes.SOFT, muscle_strength=0.3 * scenes.SOFT.youngs_modulus, viscosity=20.0)
    cube = scenes.muscle_body(cells=2)
    body = ElasticBody.passive(strong, cube.positions, cube.volumes)
    body = replace(body, muscle_membership=np.ones((body.particle_count, 1)))
    solver = Solver(scenes.weightless(body), LAGRANGIAN)
    ramp, hold = 100, 50
    level = np.concatenate([0.5 - 0.5 * np.cos(np.pi * np.arange(ramp) / ramp), np.ones(hold)])
    for sign, expected in ((-1.0, (1.6898, 0.8941)), (1.0, (0.7969, 1.0452))):
        rollout = solver.run(sign * level[:, None, None])
        assert not rollout.divergences
        stretch = (np.ptp(rollout.positions[-hold:, 0], axis=1) / np.ptp(body.positions, axis=0)).mean(0)
        assert stretch == pytest.approx([expected[0], expected[1], expected[1]], rel=5e-3)


@pytest.mark.slow
def test_a_body_that_is_stretched_far_is_not_torn() -> None:
    """Flung apart along x, neighbours are more than twice as far away as at rest, and come back."""
    cube = scenes.muscle_body(cells=2)
    body = ElasticBody.passive(replace(scenes.SOFT, viscosity=5.0), cube.positions, cube.volumes)
    away = body.positions - body.positions.mean(axis=0)
    body = scenes.with_idle_muscle(replace(body, velocities=away * (260.0, 0.0, 0.0)))
    rollout = Solver(scenes.weightless(body), LAGRANGIAN).run(np.zeros((10, 1, 1)))
    length = np.ptp(rollout.positions[:, 0, :, 0], axis=1) / np.ptp(body.positions[:, 0])
    assert not rollout.divergences
    assert not rollout.tears
    assert length.max() > 2.1
    assert length.min() < 1.0


@pytest.mark.slow
def test_a_block_slides_as_friction_lets_it() -> None:
    """On a slope it accelerates by g (sin - mu cos) where that is positive, and does not move where it sticks."""
    tilt = np.radians(30)
    gravity = (9.81 * np.sin(tilt), -9.81 * np.cos(tilt), 0.0)
    for friction in (0.2, 0.8):
        body = scenes.with_idle_muscle(scenes.passive_block((0.3, 0.0, 0.3), (3, 1, 3), np.zeros(3)))
        body = replace(body, material=replace(body.material, youngs_modulus=1e5, viscosity=50.0))
        scene = Scene(body, (0.0, 0.0, 0.0), scenes.ARENA, ground=Ground(friction), gravity=gravity)
        given = replace(LAGRANGIAN, courant=0.7)
        solver = Solver(scene, given, start=equilibrated(replace(scene, gravity=(0.0, gravity[1], 0.0)), given, 40))
        moved = solver.run(np.zeros((40, 1, 1))).positions[:, 0, :, 0].mean(1)
        expected = 9.81 * max(0.0, np.sin(tilt) - friction * np.cos(tilt))
        assert 2 * (moved[-1] - moved[0]) / (40 * 0.008) ** 2 == pytest.approx(expected, rel=0.02, abs=0.01)


def _terrain_scene() -> Scene:
    """The muscle cube on a slope that bends."""
    scene = scenes.ground_scene()
    x = np.linspace(0.0, 0.75, 25)
    heights = 0.05 + 0.02 * np.sin(8 * x)[:, None] + 0.01 * np.cos(6 * x)[None]
    robot = replace(scene.robot, positions=scene.robot.positions + np.array([0.0, 0.055, 0.0]))
    return replace(scene, robot=robot, ground=Ground(0.5, Terrain(heights, 0.75 / 24)))


def _ragged_scene() -> Scene:
    """A layer of the muscle cube with spikes: cubes that join the cells of the layer, and beyond them weak points."""
    scene = scenes.damped_scene()
    x, y, z = np.round((scene.robot.positions - scene.robot.positions.min(0)) / scenes.EDGE).astype(int).T
    kept = (x < 2) | ((y % 3 == 0) & (z % 3 == 0))
    arrays = {
        item.name: getattr(scene.robot, item.name)[kept]
        for item in fields(BodyParticles) if isinstance(getattr(scene.robot, item.name), np.ndarray)
    }  # fmt: skip
    return replace(scene, robot=replace(scene.robot, **arrays, velocities=scene.robot.velocities[kept]))


_FAST = (_ragged_scene,)
"""It has all effects of the others but the terrain, and each compiles kernels of its own."""


@pytest.mark.slow  # the conformance suite has it, of a fish in the sea
@pytest.mark.parametrize(
    "make",
    [
        *_FAST,
        *(
            pytest.param(make, marks=pytest.mark.slow)
            for make in (_terrain_scene, scenes.flight_scene, scenes.ground_scene, scenes.damped_scene)
        ),
    ],
)
def test_gradient_agrees_with_differences(make: object) -> None:
    """Of every group of parameters, along a random direction, for random adjoints of the trajectory."""
    scenes.compare_with_differences(make(), 6, LAGRANGIAN)  # type: ignore[operator]


@pytest.mark.slow  # tests/sim/test_tape.py has it on the grid; its kernel takes eight seconds
def test_gradient_is_the_same_from_checkpoints() -> None:
    """States that are computed again give every bit of the gradient."""
    scene = scenes.damped_scene()
    whole, pieces = (
        scenes.episode(scene, 5, LAGRANGIAN, density_ratio_min=0.5, checkpoint_interval=interval)[2]
        for interval in (None, 2)
    )
    assert scenes.same(whole, pieces)


@pytest.mark.slow  # its kernel takes eight seconds
def test_an_adjoint_that_overflows_is_told_of_its_node() -> None:
    """The particles' own have passed on to the nodes."""
    solver, rollout, _ = scenes.episode(scenes.damped_scene(), 4, LAGRANGIAN, density_ratio_min=0.5)
    far = np.full_like(rollout.positions, 1e308)
    fault = solver.backward(rollout, far, far).fault
    assert re.fullmatch(r"adjoint of x or v by substep \d+, node \d+, world 0", fault)


@pytest.mark.slow  # its kernel takes eight seconds; tests/cell/test_robot.py has worlds on the grid
def test_world_of_a_batch_equals_the_same_world_alone() -> None:
    """Path and gradient of two worlds agree bit for bit with those of one."""
    scene = scenes.damped_scene()
    bodies = [scenes.muscle_body((0.3, 0.0, 0.3), seed=seed) for seed in (1, 5)]
    both = BodyState(**{name: np.stack([getattr(one, name) for one in bodies]) for name in scenes.BODY_GROUPS})
    solver, rollout, gradient = scenes.episode(scene, 4, LAGRANGIAN, both, worlds=2, density_ratio_min=0.5)
    weights = scenes.path_weights(solver, 4)
    for world, body in enumerate(bodies):
        alone = Solver(scene, LAGRANGIAN, gradients=True, density_ratio_min=0.5)
        single = BodyState(**{name: getattr(body, name)[None] for name in scenes.BODY_GROUPS})
        path = alone.run(scenes.actuation(solver, 4)[:, world : world + 1], single)
        assert np.array_equal(path.positions[:, 0], rollout.positions[:, world])
        found = alone.backward(path, weights[0][:, world : world + 1], weights[1][:, world : world + 1])
        assert np.array_equal(found.actuation[:, 0], gradient.actuation[:, world])
        assert np.array_equal(found.occupancy[0], gradient.occupancy[world])


@pytest.mark.slow
def test_nodes_of_a_lone_particle_stay_with_it() -> None:
    """A cube that is the only one of its cell, far from cells that are full, does not hold that cell's nodes; without
    weak points they swing away."""
    block = np.stack(np.meshgrid(*[np.arange(4)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    cubes = np.concatenate([block, [[4, 1, 1], [5, 1, 1], [6, 1, 1]]])
    positions = np.array([0.3, 0.004, 0.3]) + (cubes + 0.5) * scenes.EDGE
    body = ElasticBody.passive(scenes.SOFT, positions, np.full(len(cubes), scenes.EDGE**3))
    scene = Scene(body, (0.0, 0.0, 0.0), scenes.ARENA, ground=Ground(0.5))
    solver = Solver(scene, LAGRANGIAN, start=equilibrated(scene, LAGRANGIAN, 40))
    solver.run(np.zeros((100, 1, 0)))
    nodes, particles = (solver.matter.nodes[0, 0, :, 0, :3].numpy(), solver.matter.x[0, 0].numpy())
    apart = np.linalg.norm(nodes[:, None] - particles[None], axis=2).min(axis=1)
    assert apart.max() < 1.5 * scenes.SPACING


def test_the_step_is_safe_in_deep_compression() -> None:
    """A cube that muscles press to a third of its length takes shorter steps than at rest, and lives."""
    strong = replace(scenes.SOFT, muscle_strength=2e4, viscosity=20.0)
    cube = scenes.muscle_body(cells=2)
    body = ElasticBody.passive(strong, cube.positions, cube.volumes)
    body = replace(body, muscle_membership=np.ones((body.particle_count, 1)))
    solver = Solver(scenes.weightless(body), replace(LAGRANGIAN, courant=0.9))
    rollout = solver.run(np.tile([1.0, 1.0, -1.0], 10)[:, None, None])
    assert not rollout.divergences
    assert rollout.smallest_j[0] < 0.5
    assert rollout.counts.max() > rollout.counts[0, 0]


@pytest.mark.slow
def test_a_robot_beyond_its_terrain_has_diverged() -> None:
    """The ground is not known there, and no wall stops it; level ground goes on."""
    scene = _terrain_scene()
    viscous = replace(scene.robot.material, viscosity=20.0)  # as in the others here, whose kernels it has on the ground
    fast = np.tile([4.0, 0.0, 0.0], (scene.robot.particle_count, 1))
    for ground, ends in ((scene.ground, True), (Ground(0.5), False)):
        robot = replace(scene.robot, material=viscous, velocities=fast)
        solver = Solver(replace(scene, robot=robot, ground=ground), LAGRANGIAN)
        rollout = solver.run(np.zeros((40, 1, scenes.MUSCLES)))
        found = [divergence.quantity for divergence in rollout.divergences.values()]
        assert found == (["distance beyond the arena in cells"] if ends else [])


@pytest.mark.parametrize("scene", [scenes.medium_scene("sand"), scenes.interface_scene()], ids=["bed", "contact"])
def test_a_bed_is_refused(scene: Scene) -> None:
    """With where it may be used and what to choose instead."""
    with pytest.raises(UsageError, match=r"moves on firm ground and in water by forces.*without a bed"):
        Solver(scene, LAGRANGIAN)
