"""Robots in water by forces on their surface: closed forms, exact gradients, and what is refused."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tests.sim import scenes
from zoobench.arrays import Array
from zoobench.errors import SceneError, UsageError
from zoobench.sim.kernels.panel_forces import ADDED
from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.model.potential_flow import areas
from zoobench.sim.model.scene import Effect, Ground, Scene
from zoobench.sim.model.surface_water import Hull, SurfaceWater
from zoobench.sim.solver import Solver

LAGRANGIAN = replace(scenes.fidelity(), robot="lagrangian")
SPEED = np.array([0.3, 0.05, -0.1])


def _box(lower: Array, upper: Array, count: int = 4) -> Array:
    """The surface of a box in triangles, `count` squared squares of each face."""
    line = np.linspace(0.0, 1.0, count + 1)
    u, v = np.meshgrid(line, line, indexing="ij")
    face = np.stack([u, v, np.ones_like(u)], axis=-1)
    corners = face[:-1, :-1], face[1:, :-1], face[1:, 1:], face[:-1, 1:]
    halves = np.concatenate(
        [np.stack([corners[k] for k in some], axis=2).reshape(-1, 3, 3) for some in ((0, 1, 2), (0, 2, 3))]
    )
    turned = np.concatenate([np.roll(halves, k, axis=2) for k in range(3)])
    whole = np.concatenate([turned, 1.0 - turned[:, ::-1]])
    return lower + whole * (upper - lower)


def _in_water(body: ElasticBody, **water: object) -> Scene:
    """A body of cubes in water that carries it."""
    edge = scenes.EDGE / 2
    hull = Hull(_box(body.positions.min(0) - edge, body.positions.max(0) + edge), scenes.SPACING)
    soft = replace(body, material=replace(body.material, viscosity=20.0))
    return Scene(soft, (0.0, 0.0, 0.0), scenes.ARENA, surface_water=SurfaceWater(hull=hull, **water))  # type: ignore[arg-type]


def _cube(speed: Array = SPEED, density: float = 1000.0, **water: object) -> Scene:
    """A stiff cube of water's density that moves as one."""
    block = scenes.with_idle_muscle(scenes.passive_block((0.3, 0.3, 0.3), (2, 2, 2), speed))
    return _in_water(replace(block, material=replace(scenes.STIFF, density=density, muscle_strength=1.0)), **water)


def _muscles(**water: object) -> Scene:
    """The muscle cube, which moves and turns, in a current."""
    return _in_water(scenes.muscle_body(cells=2, moving=True), current=(0.1, -0.05, 0.02), **water)


def test_panels_close_and_fill_the_cube() -> None:
    """The hull of a cube has its volume and no open side, and twice the added mass that a sphere of its size has at
    most."""
    water = _cube().surface_water
    assert water is not None
    assert water.hull is not None
    assert np.abs(areas(water.hull.triangles).sum(axis=0)).max() < 1e-15
    assert water.hull.volume == pytest.approx((2 * scenes.SPACING) ** 3)
    solver = Solver(_cube(), LAGRANGIAN)
    solver.substeps(1, 1e-9)
    added = solver.matter.nodes[0, 0, :, ADDED, :3].double().numpy().sum(axis=0)
    assert added / (1000.0 * water.hull.volume) == pytest.approx(np.full(3, 0.67), rel=0.05)  # of a cube: Brennen 1982


def test_a_body_of_water_s_density_stays_where_it_is() -> None:
    """At rest in still water nothing moves, whatever gravity is."""
    solver = Solver(_cube(np.zeros(3)), LAGRANGIAN)
    rollout = solver.run(np.zeros((20, 1, 1)))
    assert not rollout.divergences
    assert np.abs(rollout.positions - rollout.positions[0]).max() < 1e-12


@pytest.mark.parametrize(("density", "way"), [(1150.0, -1.0), (850.0, 1.0)])
def test_a_body_begins_to_sink_or_rise_as_its_added_mass_lets_it(density: float, way: float) -> None:
    """(m + m_added) a = (m - m_water) g, before drag counts."""
    solver = Solver(_cube(np.zeros(3), density), LAGRANGIAN)
    rollout = solver.run(np.zeros((2, 1, 1)))
    moved = (rollout.positions[-1, 0] - rollout.positions[0, 0]).mean(axis=0)
    steps, dt = rollout.counts[:, 0].sum(), 0.016 / rollout.counts[:, 0].sum()
    exact = 9.81 * 150.0 / (density + 670.0) * dt**2 * steps * (steps + 1) / 2
    assert moved == pytest.approx([0.0, way * exact, 0.0], rel=0.03, abs=1e-9)


def test_a_coasting_body_slows_down_by_its_drag() -> None:
    """v = v_0 / (1 + k v_0 t), with k = C A rho / (2 (m + m_added)): the square of the speed is what brakes it."""
    solver = Solver(_cube(np.array([0.5, 0.0, 0.0]), lift=0.0, friction=0.0), LAGRANGIAN)
    rollout = solver.run(np.zeros((60, 1, 1)))
    speed = rollout.velocities[:, 0, :, 0].mean(axis=1)
    rate = np.diff(1.0 / speed[20:]) / 0.008  # k
    side = 2 * scenes.SPACING
    assert rate == pytest.approx(np.full(len(rate), 1.1 / (2 * 1.67 * side)), rel=0.05)


def test_only_the_velocity_through_the_water_counts() -> None:
    """In a current it moves as in still water that is seen from a boat: bit for bit but for rounding."""
    current = np.array([0.1, -0.05, 0.02])
    moving, still = (
        Solver(replace(scene, robot=replace(scene.robot, velocities=scene.robot.velocities + away)), LAGRANGIAN)
        for scene, away in ((_muscles(), np.zeros(3)), (replace(_muscles(), surface_water=_still()), -current))
    )
    acts = scenes.actuation(moving, 10)
    here, there = (solver.run(acts) for solver in (moving, still))
    drift = current * 0.008 * np.arange(11)[:, None, None, None]
    assert np.abs(here.positions - there.positions - drift).max() < 1e-9


def _still() -> SurfaceWater:
    water = _muscles().surface_water
    assert water is not None
    return replace(water, current=(0.0, 0.0, 0.0))


def _collision() -> Scene:
    """Two cubes that meet, of which one feels the water."""
    water, pair = _muscles().surface_water, scenes.pair_scene(4.0, 0.5)
    assert water is not None
    hull = Hull(_box(np.array([0.1, 0.3, 0.3]), np.array([0.1, 0.3, 0.3]) + 3 * scenes.SPACING), scenes.SPACING)
    return replace(pair, surface_water=replace(water, hull=hull))


@pytest.mark.slow  # the conformance suite has that of a fish
@pytest.mark.parametrize("make", [_muscles, _collision])
def test_gradient_agrees_with_differences(make: Callable[[], Scene]) -> None:
    """Of every group of parameters, along a random direction, for random adjoints of the trajectory."""
    scenes.compare_with_differences(make(), 6, LAGRANGIAN)


def test_limbs_that_meet_push_each_other() -> None:
    """As out of the water, where drag lets them."""
    rollout = Solver(_collision(), LAGRANGIAN).run(np.zeros((6, 1, scenes.MUSCLES)))
    one, other = np.split(rollout.velocities[:, 0, :, 0], 2, axis=1)
    assert not rollout.divergences
    assert np.diff(other.mean(axis=1) - one.mean(axis=1)).max() > 0.5


@pytest.mark.slow  # test_tape.py stores states in every way, and the reverse of this scene would be compiled for it
def test_gradient_is_the_same_from_checkpoints() -> None:
    """States that are computed again give every bit of the gradient."""
    whole, pieces = (
        scenes.episode(_muscles(), 5, LAGRANGIAN, density_ratio_min=0.5, checkpoint_interval=interval)[2]
        for interval in (None, 2)
    )
    assert scenes.same(whole, pieces)


@pytest.mark.slow
def test_world_of_a_batch_equals_the_same_world_alone() -> None:
    """Path and gradient of two worlds agree bit for bit with those of one."""
    solver, rollout, gradient = scenes.episode(_muscles(), 4, LAGRANGIAN, worlds=2)
    weights = scenes.path_weights(solver, 4)
    for world in range(2):
        alone = Solver(solver.scene, LAGRANGIAN, gradients=True)
        path = alone.run(scenes.actuation(solver, 4)[:, world : world + 1])
        assert np.array_equal(path.positions[:, 0], rollout.positions[:, world])
        found = alone.backward(path, weights[0][:, world : world + 1], weights[1][:, world : world + 1])
        assert np.array_equal(found.actuation[:, 0], gradient.actuation[:, world])
        assert np.array_equal(found.occupancy[0], gradient.occupancy[world])


def test_water_is_the_only_effect_around_the_robot() -> None:
    """Neither contact nor a medium is simulated, and no grid is filled."""
    assert _cube().effects == {Effect.ELASTICITY, Effect.MUSCLE, Effect.FLUID, Effect.DAMPING}
    solver = Solver(_cube(), LAGRANGIAN)
    solver.substeps(1)
    assert not solver.launcher.nodes(solver.matter.window[0, 0]).any()


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"ground": Ground(0.0)}, "nothing else is in it"),
        ({"surface_water": SurfaceWater(density=0.0)}, "positive density"),
        ({"surface_water": SurfaceWater(normal_drag=-1.0)}, "drag of -1"),
        ({"surface_water": SurfaceWater(current=(np.inf, 0.0, 0.0))}, "not finite"),
    ],
)
def test_impossible_water_is_refused(change: dict[str, object], why: str) -> None:
    """With what to do."""
    with pytest.raises(SceneError, match=why):
        replace(_cube(), **change)  # type: ignore[arg-type]


def test_a_robot_on_the_grid_is_refused() -> None:
    """It is simulated in its rest frame alone."""
    with pytest.raises(UsageError, match="robot=lagrangian"):
        Solver(_cube(), scenes.fidelity())
