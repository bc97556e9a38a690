"""Ground that is not flat."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sim import scenes
from tests.sim.test_adjoint import Probe
from zoobench.errors import SceneError
from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.model.scene import Ground, Scene
from zoobench.sim.model.standing import standing
from zoobench.sim.model.terrain import Terrain
from zoobench.sim.solver import Solver

POINTS = 0.05 * np.arange(16)


def _hills(amplitude: float = 0.03) -> Terrain:
    """Smooth hills over the arena of these tests."""
    x, z = np.meshgrid(POINTS, POINTS, indexing="ij")
    return Terrain(amplitude * (1.0 + np.sin(9.0 * x) * np.cos(7.0 * z)), 0.05)


def test_height_and_normal_are_those_of_the_field() -> None:
    """The spline goes through its points, and its normal is that of the surface."""
    terrain = _hills()
    assert np.abs(terrain.heights_at(POINTS, POINTS) - terrain.heights).max() < 1e-15
    x, z, e = np.array([0.31]), np.array([0.47]), 1e-6
    slope_x = (terrain.heights_at(x + e, z) - terrain.heights_at(x - e, z)) / (2 * e)
    slope_z = (terrain.heights_at(x, z + e) - terrain.heights_at(x, z - e)) / (2 * e)
    normal = terrain.normals_at(x, z)[0, 0]
    assert np.linalg.norm(normal) == pytest.approx(1.0, abs=1e-14)
    assert normal[0] / normal[1] == pytest.approx(-slope_x[0, 0], abs=1e-8)
    assert normal[2] / normal[1] == pytest.approx(-slope_z[0, 0], abs=1e-8)
    below = terrain.heights_below(np.array([[0.31, 9.0, 0.47]]))
    assert below[0] == pytest.approx(terrain.heights_at(x, z)[0, 0], abs=1e-15)


def test_level_terrain_is_the_plane() -> None:
    """Path and gradient on a terrain of height 0 are those on the plane, bit for bit."""
    scene = scenes.ground_scene()
    assert scene.ground is not None
    level = replace(scene.ground, terrain=Terrain(np.zeros((4, 4)), 0.25))
    found = []
    for ground in (scene.ground, level):
        _, rollout, gradient = scenes.episode(replace(scene, ground=ground), 4)
        found.append((rollout.positions, gradient.actuation))
    assert np.array_equal(found[0][0], found[1][0])
    assert np.array_equal(found[0][1], found[1][1])
    assert found[0][1].any()


@pytest.mark.slow  # a block slides in tests/sim/kernels/test_boundary.py
@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_block_slides_down_a_slope_as_on_an_incline(friction: float) -> None:
    """A 45 degree slope, whose nodes lie on it exactly: g (sin - mu cos) along it, to 2 % of the distance."""
    block = scenes.passive_block((0.0, 0.0, 0.3), (6, 3, 3), np.zeros(3))
    root = np.sqrt(0.5)
    along, up = np.array([root, -root, 0.0]), np.array([root, root, 0.0])
    start = np.array([0.3, 1.5, 0.0])
    x, y, z = block.positions.T
    positions = start + x[:, None] * along + y[:, None] * up + z[:, None] * np.array([0.0, 0.0, 1.0])
    body: ElasticBody = replace(block, positions=positions)
    points = 0.1 * np.arange(21)
    slope = Terrain(np.repeat((1.8 - points)[:, None], 21, axis=1).clip(0.0), 0.1)
    scene = Scene(body, (0, 0, 0), (2.0, 2.0, 0.75), ground=Ground(friction, slope))
    solver = Solver(standing(scene, scenes.EDGE), scenes.fidelity())
    frames, first = 60, 20
    rollout = solver.run(np.zeros((frames, 1, 0)))
    assert not rollout.divergences
    path = rollout.positions[:, 0].mean(1)
    seconds = 0.008 * (frames - first)
    expected = rollout.velocities[first, 0].mean(0) @ along * seconds
    expected += 9.81 * root * (1.0 - friction) * seconds**2 / 2
    assert (path[-1] - path[first]) @ along == pytest.approx(expected, rel=0.02)
    # it neither sinks in nor lifts off by more than half a cell
    assert np.abs((path - path[0]) @ up).max() < 0.5 * scenes.SPACING


@pytest.mark.slow
def test_gradient_on_hills_matches_central_differences() -> None:
    """Through contact with a curved ground."""
    scene = scenes.ground_scene()
    terrain = _hills(0.02)
    robot = scene.robot
    lift = terrain.heights_below(robot.positions).max()
    robot = replace(robot, positions=robot.positions + np.array([0.0, lift, 0.0]))
    probe = Probe(replace(scene, robot=robot, ground=Ground(0.5, terrain)), frames := 16)
    gradient = probe.gradient()
    speed = probe.rollout.velocities[-1, 0, :, 1].mean()
    direction = np.random.default_rng(3).uniform(-1.0, 1.0, gradient.actuation.shape)
    assert probe.error(gradient, "actuation", direction, 1e-5) <= 1e-5
    # the body touches the hills, else this says nothing about them
    assert speed > -0.8 * 9.81 * 0.008 * frames


@pytest.mark.parametrize(
    ("heights", "message"),
    [
        (np.zeros((3, 8)), "4 x 4 heights"),
        (np.full((4, 4), -0.1), "between 0 and the top"),
        (np.full((4, 4), 9.0), "between 0 and the top"),
        (np.full((4, 4), np.nan), "between 0 and the top"),
    ],
)
def test_impossible_terrain_is_refused(heights: np.ndarray, message: str) -> None:
    """Too few points, and heights outside the arena."""
    with pytest.raises(SceneError, match=message):
        replace(scenes.ground_scene(), ground=Ground(0.5, Terrain(heights, 0.25)))
