"""Slopes, steps and gaps of the ground, and what they do to bodies and beds."""

import math

import numpy as np
import pytest

from tests.envs.at_rest import ENVS
from zoobench import registry
from zoobench.designs.caterpillar import Caterpillar
from zoobench.envs.base import Environment
from zoobench.envs.hills import LEVEL, Hills
from zoobench.envs.profile import Profile
from zoobench.errors import SceneError, UsageError
from zoobench.registry import Kind
from zoobench.sim.equilibrium import equilibrated
from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.lattice import fill_box, particle_volume
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.rollout import Rollout
from zoobench.sim.model.scene import Ground, Scene
from zoobench.sim.model.standing import standing
from zoobench.sim.model.terrain import Terrain
from zoobench.sim.solver import Solver
from zoobench.spec import Ref

DRAFT = Fidelity(1 / 64)
SIZE = (2.0, 0.4)
START = 0.5
FULL = "slope=5,step_height=0.01,gap_depth=0.01"


def _made(text: str) -> Environment:
    env: Environment = registry.create(Kind.ENV, Ref.parse(text))
    return env


def _terrain(profile: Profile, hills: Hills = LEVEL) -> Terrain:
    terrain = profile.terrain(SIZE, (START, 0.2), hills)
    assert terrain is not None
    return terrain


def _heights(terrain: Terrain, *ahead: float) -> np.ndarray:
    """Above the ground at the start, at these distances ahead of it."""
    x = START + np.array([0.0, *ahead])
    heights = terrain.heights_below(np.stack([x, 0.0 * x, 0.0 * x + 0.2], axis=1))
    return heights[1:] - heights[0]


@pytest.mark.parametrize("angle", [7.0, -20.0])
def test_a_slope_rises_at_its_angle(angle: float) -> None:
    """From end to end, whatever lies on it; the lowest ground is at 0."""
    terrain = _terrain(Profile(slope=angle))
    assert _heights(terrain, 0.1, 1.3) == pytest.approx(math.tan(math.radians(angle)) * np.array([0.1, 1.3]))
    assert terrain.heights.min() == 0.0


def test_a_staircase_rises_by_a_step_every_step_length() -> None:
    """Treads are level up to the edges, and the robot starts in the middle of one."""
    terrain = _terrain(Profile(step_height=0.02, step_length=0.2, edge=0.02))
    assert _heights(terrain, -0.085, 0.085, 0.1, 0.115, 0.285, 0.315) == pytest.approx(
        [0.0, 0.0, 0.01, 0.02, 0.02, 0.04], abs=2e-4
    )


def test_gaps_come_at_their_distance() -> None:
    """As wide and deep as they are said to be, the robot starting between two."""
    terrain = _terrain(Profile(gap_depth=0.03, gap_width=0.06, gap_distance=0.3, edge=0.02))
    assert _heights(terrain, 0.1, 0.12, 0.15, 0.18, 0.2, 0.45) == pytest.approx(
        [0.0, -0.015, -0.03, -0.015, 0.0, -0.03], abs=3e-4
    )


def test_hills_lie_on_the_profile() -> None:
    """Heights add up."""
    hills = Hills(relief=0.02, wavelength=0.2, terrain_seed=3)
    bare, slope, both = (
        _heights(terrain, 0.13, 0.4)
        for terrain in (_terrain(Profile(), hills), _terrain(Profile(slope=4.0)), _terrain(Profile(slope=4.0), hills))
    )
    assert both == pytest.approx(bare + slope, abs=1e-4)


def test_without_profile_the_hills_are_what_they_were() -> None:
    """The same field to the last bit, and none on level ground."""
    hills = Hills(relief=0.02)
    kept, bare = Profile().terrain(SIZE, (START, 0.2), hills), hills.terrain(SIZE, (START, 0.2))
    assert kept is not None
    assert bare is not None
    np.testing.assert_array_equal(kept.heights, bare.heights)
    assert Profile().terrain(SIZE, (START, 0.2), LEVEL) is None


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("slope=60", "slope of 60 degrees"),
        ("gap_depth=-0.1", "would be a ridge"),
        ("step_height=0.01,step_length=0.01", "have no room"),
        ("gap_depth=0.01,gap_width=0.25", "have no room"),
        ("step_height=0.01,edge=0", "have no room"),
    ],
)
def test_a_profile_that_has_no_room_is_refused(text: str, told: str) -> None:
    """When the environment is made."""
    with pytest.raises(UsageError, match=told):
        _made(f"ground[{text}]")


def test_a_grid_that_would_miss_an_edge_is_refused() -> None:
    """The message has the remedy; a grid that is fine enough is not."""
    body = Caterpillar().body(DRAFT)
    with pytest.raises(SceneError, match="longer edge or a finer fidelity"):
        _made("ground[step_height=0.01,edge=0.015]").scene(body, DRAFT)
    _made("ground[step_height=0.01,edge=0.016]").scene(body, DRAFT)


@pytest.mark.parametrize(("name", "spacing"), [("clay[slope=45]", 1 / 64), ("ground[slope=-45]", 1 / 192)])
def test_the_steepest_slope_is_no_lower_than_its_arena(name: str, spacing: float) -> None:
    """By rounding its lowest point was at -3e-17 m, where the start is a whole number of cells high, and refused."""
    fidelity = Fidelity(spacing)
    scene = _made(name).scene(Caterpillar().body(fidelity), fidelity, 0.8)
    assert scene.ground is not None
    assert scene.ground.terrain is not None
    assert scene.ground.terrain.heights.min() == 0.0


@pytest.mark.parametrize("name", ENVS)
def test_the_profile_reaches_every_scene(name: str) -> None:
    """The robot's lowest particle is above the ground, or in water clear of it, and the bed is above the ground."""
    water = ",water=particles" if name == "ocean" else ""
    scene = _made(f"{name}[{FULL}{water}]").scene(Caterpillar().body(DRAFT), DRAFT)
    assert scene.ground is not None
    terrain = scene.ground.terrain
    assert terrain is not None
    assert (scene.robot.positions[:, 1] > terrain.heights_below(scene.robot.positions)).all()
    if scene.medium is not None and name not in ("ocean", "shallow-water"):
        assert (scene.medium.positions[:, 1] > terrain.heights_below(scene.medium.positions)).all()


def _block(terrain: Terrain, place: float, angle: float = 0.0) -> ElasticBody:
    """A damped block of 0.12 m on the ground `place` [m] along x, turned by an angle [degrees] down."""
    lattice = fill_box(np.zeros(3), np.array([0.12, 0.06, 0.12]), DRAFT.grid_spacing, 8)
    root = math.radians(angle)
    along, up = np.array([math.cos(root), -math.sin(root), 0.0]), np.array([math.sin(root), math.cos(root), 0.0])
    floor = terrain.heights_below(np.array([[place, 0.0, 0.2]]))[0]
    corner = np.array([place, floor, 0.14])
    positions = corner + lattice[:, [0]] * along + lattice[:, [1]] * up + lattice[:, [2]] * np.array([0.0, 0.0, 1.0])
    material = ElasticMaterial(youngs_modulus=1e5, poissons_ratio=0.2, density=1000.0, viscosity=20.0)
    return ElasticBody.passive(material, positions, np.full(len(positions), particle_volume(DRAFT.grid_spacing, 8)))


def _run(terrain: Terrain, body: ElasticBody, friction: float, frames: int) -> Rollout:
    top = float(terrain.heights.max()) + 0.3
    scene = Scene(body, (0.0, 0.0, 0.0), (SIZE[0], top, SIZE[1]), ground=Ground(friction, terrain))
    rollout = Solver(standing(scene, DRAFT.particle_edge), DRAFT).run(np.zeros((frames, 1, 0)))
    assert not rollout.divergences
    return rollout


@pytest.mark.parametrize(
    ("angle", "friction"), [*(pytest.param(15.0, each, marks=pytest.mark.slow) for each in (0.0, 0.1)), (25.0, 0.2)]
)
def test_a_block_slides_down_a_slope(angle: float, friction: float) -> None:
    """By g (sin a - mu cos a) to 1 %, at draft, where the slope's plane lies between the nodes."""
    terrain = _terrain(Profile(slope=-angle))
    rollout = _run(terrain, _block(terrain, START, angle), friction, 40)
    root, first = math.radians(angle), 15
    speed = rollout.velocities[[first, -1], 0].mean(axis=1) @ [math.cos(root), -math.sin(root), 0.0]
    gained = (speed[1] - speed[0]) / (0.008 * (40 - first))
    assert gained == pytest.approx(9.81 * (math.sin(root) - friction * math.cos(root)), rel=0.01)


@pytest.mark.slow
def test_a_body_slides_down_as_far_as_an_episode_lasts() -> None:
    """From rest by g sin a cos a t^2 / 2 along x, for 2 s and 6.3 m: no end of the arena is on its way."""
    frames, smoke = 250, Fidelity(1 / 32)
    body = registry.create(Kind.DESIGN, Ref("block")).body(smoke)
    scene = _made("ground[slope=-20,friction=0]").scene(body, smoke, 0.008 * frames)
    rollout = Solver(scene, smoke).run(np.zeros((frames, 1, body.muscle_count)))
    assert not rollout.divergences
    start, end = rollout.positions[[0, -1], 0, :, 0].mean(axis=1)
    root = math.radians(20.0)
    expected = 9.81 * math.sin(root) * math.cos(root) * (0.008 * frames) ** 2 / 2
    assert end - start == pytest.approx(expected, rel=0.01)


def test_a_step_stops_what_is_too_slow_to_climb_it() -> None:
    """A block at 0.5 m/s has the energy to rise by 13 mm: a step of 40 mm holds it back, and it stays outside."""
    terrain = _terrain(Profile(step_height=0.04, step_length=0.4))
    body = _block(terrain, START + 0.05)
    body.velocities[:, 0] = 0.5
    rollout = _run(terrain, body, 0.0, 40)
    # the step's middle is 0.2 m ahead of the start
    assert rollout.positions[:, 0, :, 0].max() < START + 0.2 + DRAFT.grid_spacing
    assert rollout.velocities[-1, 0, :, 0].mean() < 0.05


def test_a_block_falls_into_a_gap_that_is_wider() -> None:
    """Down to the gap's floor, which stops it where contact is felt, 0.6 cells above."""
    terrain = _terrain(Profile(gap_depth=0.05, gap_width=0.3, gap_distance=0.7))
    body = _block(terrain, START + 0.29)
    dropped = body.positions + np.array([0.0, 0.05, 0.0])
    rollout = _run(terrain, ElasticBody.passive(body.material, dropped, body.volumes), 0.5, 25)
    lowest = rollout.positions[:, 0, :, 1].mean(axis=1).min()
    assert lowest == pytest.approx(body.positions[:, 1].mean(), abs=0.6 * DRAFT.grid_spacing)


@pytest.mark.slow
def test_a_robot_stands_on_a_step() -> None:
    """At rest, as high above the tread as above level ground, between one step down and one step up."""
    heights = []
    for text in ("ground", "ground[step_height=0.03]"):
        env = _made(text)
        scene = env.scene(Caterpillar().body(DRAFT), DRAFT)
        solver = Solver(scene, DRAFT, start=equilibrated(scene, DRAFT, env.equilibration_frames))
        path = solver.run(np.zeros((20, 1, solver.muscle_count))).positions[:, 0]
        assert np.abs(path[-1].mean(axis=0) - path[0].mean(axis=0)).max() < 1e-4
        assert scene.ground is not None
        terrain = scene.ground.terrain
        tread = 0.0 if terrain is None else terrain.heights_below(path[-1]).mean()
        heights.append(path[-1, :, 1].mean() - tread)
    assert heights[1] == pytest.approx(heights[0], abs=DRAFT.grid_spacing / 4)


@pytest.mark.parametrize("name", [pytest.param("ocean[water=particles,", marks=pytest.mark.slow), "shallow-water["])
def test_water_on_terrain_has_a_level_surface(name: str) -> None:
    """It is as deep as the ground is low, to a cell, and each particle carries the weight of the water above it."""
    env = _made(f"{name}slope=2]")
    bed, (length, _, width) = env.bed, env.arena
    terrain = env.profile.terrain((length, width), (length / 2, width / 2), env.hills)
    assert bed is not None
    assert terrain is not None
    filled = bed.fill(np.array(env.arena), 9.81, DRAFT, terrain)
    tops = [filled.positions[np.abs(filled.positions[:, 0] - x) < 0.02, 1].max() for x in (0.05, 0.1)]
    assert np.ptp(tops) < DRAFT.particle_edge / 4
    depth = np.clip(bed.thickness - terrain.heights, 0.0, None).mean()
    volume = env.arena[0] * env.arena[2]
    assert (filled.volumes * filled.history).sum() == pytest.approx(volume * depth, abs=volume * DRAFT.grid_spacing)
    strain = 9.81 * 1000.0 * (bed.thickness - filled.positions[:, 1]) / getattr(bed.material, "bulk_modulus", 0.0)
    assert -np.log(filled.history) == pytest.approx(strain, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("text", ["shallow-water[slope=2]", "ocean[water=particles,slope=5,width=0.125]"])
def test_water_comes_to_rest_on_terrain(text: str) -> None:
    """Laid on the ground itself and not on the nodes that hold it, or without friction, it streams at 20 to 50 mm/s."""
    env = _made(text)
    scene = env.scene(Caterpillar().body(DRAFT), DRAFT)
    solver = Solver(scene, DRAFT, start=equilibrated(scene, DRAFT, env.equilibration_frames))
    solver.run(np.zeros((20, 1, solver.muscle_count)))
    speed = solver.matter.v[0, 0, scene.robot.particle_count :]
    assert float(speed.square().sum(dim=1).mean().sqrt()) < 4e-3


def test_terrain_without_room_for_the_swimmer_is_refused() -> None:
    """Ground that reaches the swimmer leaves no room; the message has the remedy."""
    body = Caterpillar().body(DRAFT)
    with pytest.raises(SceneError, match=r"(?s)no room above.*Give lower terrain"):
        _made("ocean[water=particles,slope=40]").scene(body, DRAFT)


def test_water_on_a_grid_has_a_level_floor() -> None:
    """The message says what has one that is not."""
    with pytest.raises(UsageError, match="use water=particles"):
        _made("ocean[slope=5]")
