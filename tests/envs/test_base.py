"""Scenes: positions of body and bed, and the bed at rest."""

import numpy as np
import pytest

from tests.envs.at_rest import made
from zoobench import registry
from zoobench.designs.caterpillar import Caterpillar
from zoobench.envs.base import FREE_ROOM, HIGHEST_SPEED, Environment
from zoobench.envs.bed import BED_THICKNESS
from zoobench.envs.desert import desert
from zoobench.envs.ground import ground
from zoobench.envs.ice import ice
from zoobench.errors import SceneError, UsageError
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.ground_skin import heights_above
from zoobench.sim.model.laws.sand import SandMaterial
from zoobench.sim.model.scene import Effect
from zoobench.spec import Ref

QUICK = Fidelity(1 / 64)


@pytest.mark.parametrize(("env", "friction"), [(ground(), 0.5), (ice(), 0.05)])
def test_land_without_a_medium(env: Environment, friction: float) -> None:
    """Ground and ice differ in friction only; the robot's lowest particles lie just above the plane."""
    scene = env.scene(Caterpillar().body(QUICK), QUICK)
    assert scene.medium is None
    assert scene.ground is not None
    assert scene.ground.friction == friction
    assert 0.0 < scene.robot.positions[:, 1].min() < QUICK.grid_spacing / 2
    assert scene.effects == {Effect.ELASTICITY, Effect.MUSCLE, Effect.DAMPING, Effect.FRICTION}


def test_the_desert_robot_stands_on_the_sand() -> None:
    """It neither overlaps the bed nor falls on it."""
    scene = desert().scene(Caterpillar().body(QUICK), QUICK)
    assert scene.medium is not None
    gap = scene.robot.positions[:, 1].min() - scene.medium.positions[:, 1].max()
    assert 0.0 < gap < QUICK.grid_spacing
    assert Effect.PLASTICITY in scene.effects


@pytest.mark.parametrize(
    "spacing", [1 / 40, 1 / 64, *(pytest.param(1 / n, marks=pytest.mark.slow) for n in (100, 128))]
)
@pytest.mark.parametrize("particles_per_cell", [1, 4, 8, 27])
def test_the_bed_has_its_mass_and_fills_its_box(spacing: float, particles_per_cell: int) -> None:
    """The volume is exact at every resolution; the bed is centred and not too thick."""
    fidelity = Fidelity(spacing, particles_per_cell=particles_per_cell)
    scene = desert().scene(Caterpillar().body(fidelity), fidelity)
    bed, (length, _, width) = scene.medium, scene.upper
    assert bed is not None
    assert bed.volumes.sum() == pytest.approx(length * width * BED_THICKNESS, rel=1e-12)
    # rows of a face-centred lattice alternate in number where the box ends in half cells
    enough = 1e-4 if particles_per_cell == 4 else 1e-6
    assert bed.positions.mean(axis=0) == pytest.approx([length / 2, BED_THICKNESS / 2, width / 2], rel=enough)
    assert bed.positions[:, 1].max() < BED_THICKNESS


@pytest.mark.parametrize(
    "spacing", [1 / 40, 1 / 64, *(pytest.param(1 / n, marks=pytest.mark.slow) for n in (100, 128))]
)
@pytest.mark.parametrize("length", [0.05, 0.1, 0.4])
def test_a_bed_that_follows_has_room_for_the_robot_to_turn(spacing: float, length: float) -> None:
    """On every side of its start in the middle, in whole cells, half of them on either side, however long the body."""
    fidelity = Fidelity(spacing)
    body = Caterpillar(length=length).body(fidelity)
    scene = desert().scene(body, fidelity)
    size = np.array(scene.upper)[[0, 2]]
    assert size == pytest.approx(2 * spacing * np.round(size / spacing / 2), rel=1e-12)
    assert scene.robot.positions.mean(axis=0)[[0, 2]] == pytest.approx(size / 2, abs=spacing)
    radius = np.hypot(*np.ptp(body.positions, axis=0)[[0, 2]]) / 2
    assert (size / 2 >= radius + max(FREE_ROOM, 5 * spacing) - 1e-12).all()


@pytest.mark.parametrize("name", ["ground", "ice", "desert", "clay", "wetland", "snow"])
def test_the_arena_of_level_land_follows_the_robot(name: str) -> None:
    """What that is worth is tested in `tests/sim/test_moving_arena.py`, and with published gaits if `slow`."""
    assert made(name).scene(Caterpillar().body(QUICK), QUICK).follows


def test_an_arena_that_does_not_follow_is_as_long_as_the_episode_needs() -> None:
    """Beds on a terrain, and firm ground on all sides; the hills around the start are the same in every one."""
    body = Caterpillar().body(QUICK)
    for name in ("ground[relief=0.02]", "desert[relief=0.02]"):
        short, long = (made(name).scene(body, QUICK, seconds) for seconds in (0.8, 1.6))
        for scene, seconds in ((short, 0.8), (long, 1.6)):
            assert scene.upper[0] - scene.robot.positions[:, 0].max() > HIGHEST_SPEED * seconds
        around = [scene.ground.terrain.heights_below(scene.robot.positions) for scene in (short, long)]  # type: ignore[union-attr]
        assert around[0] == pytest.approx(around[1], abs=1e-5)
    assert made("ground[relief=0.02]").scene(body, QUICK, 1.6).robot.positions[:, [0, 2]].min() > 1.6 * HIGHEST_SPEED
    assert made("shallow-water").scene(body, QUICK, 1.6).upper[0] == 0.625


@pytest.mark.parametrize("name", ["ground[slope=5]", "ground[slope=-7,step_height=0.01]", "ground[relief=0.02]"])
def test_an_episode_of_any_length_begins_alike_on_the_grid(name: str) -> None:
    """However long the arena is, the robot lies in the same places of the cells, and the ground as high in them."""
    body, h = Caterpillar().body(QUICK), QUICK.grid_spacing
    places = [made(name).scene(body, QUICK, seconds).robot.positions / h for seconds in (0.8, 1.6, 1.7)]
    for longer in places[1:]:
        apart = longer - places[0]
        assert apart == pytest.approx(np.round(apart), abs=1e-6 if "slope" in name else 0.05)


def test_a_body_larger_than_the_arena_is_refused() -> None:
    """The message names both sizes."""
    with pytest.raises(SceneError, match="does not fit"):
        made("desert[length=0.15,relief=0.01]").scene(Caterpillar(length=0.2).body(QUICK), QUICK, 0.0)


def test_all_bed_parameters_reach_the_scene() -> None:
    """Thickness and friction angle are used."""
    scene = made("desert[thickness=0.04,friction_angle=30]").scene(Caterpillar().body(QUICK), QUICK)
    assert scene.medium is not None
    assert isinstance(scene.medium.material, SandMaterial)
    assert scene.medium.material.friction_angle == 30.0
    assert np.ptp(scene.medium.positions[:, 1]) > 0.03


HILLS = {"relief": 0.03, "wavelength": 0.15, "terrain_seed": 4}
LAND = ("ground", "ice", "desert", "wetland", "clay", "snow")


def _hilly(name: str) -> Environment:
    env: Environment = registry.create(Kind.ENV, Ref(name, params=tuple(HILLS.items())))
    return env


@pytest.mark.parametrize("name", LAND[:2])
def test_the_skin_of_hills_carries_the_robot(name: str) -> None:
    """Its whole weight, as on a plane: the fewer particles reach the ground, the deeper they are."""
    for env in (_hilly(name), made(name)):
        scene = env.scene(Caterpillar().body(QUICK), QUICK)
        assert scene.ground is not None
        gap, normal = heights_above(scene.robot.positions, scene.ground.terrain)
        force = scene.ground.skin.force(gap, QUICK.particle_edge) / normal[:, 1]  # friction bears the rest
        weight = -scene.gravity[1] * scene.robot.material.density * scene.robot.volumes.sum()
        assert scene.robot.volumes @ force == pytest.approx(weight, rel=1e-9)


@pytest.mark.parametrize("name", LAND[2:])
def test_the_robot_starts_on_top_of_the_hills(name: str) -> None:
    """On a bed, the closest particle is as near to the ground below it as on a plane."""
    scene, level = (env.scene(Caterpillar().body(QUICK), QUICK) for env in (_hilly(name), made(name)))
    assert scene.ground is not None
    assert scene.ground.terrain is not None
    robot, terrain = scene.robot, scene.ground.terrain
    above = robot.positions[:, 1] - terrain.heights_below(robot.positions)
    assert above.min() == pytest.approx(level.robot.positions[:, 1].min(), abs=1e-12)


@pytest.mark.parametrize("name", LAND[2:])
def test_the_bed_follows_the_hills(name: str) -> None:
    """It has the thickness and volume of the bed on a plane."""
    env = _hilly(name)
    scene = env.scene(Caterpillar().body(QUICK), QUICK)
    assert env.bed is not None
    assert scene.medium is not None
    assert scene.ground is not None
    assert scene.ground.terrain is not None
    level = env.bed.fill(np.array(scene.upper), 9.81, QUICK)
    rise = scene.medium.positions - level.positions
    assert (rise[:, [0, 2]] == 0.0).all()
    assert rise[:, 1] == pytest.approx(scene.ground.terrain.heights_below(level.positions), abs=1e-15)
    assert np.ptp(rise[:, 1]) > 0.01
    assert (scene.medium.volumes == level.volumes).all()


# Table 6 of SoftZoo's appendix: what each environment covers besides the elastic robot; contact of robot and medium is
# ours.
TABLE_6 = {
    "ground": {Effect.FRICTION},
    "ice": {Effect.FRICTION},
    "desert": {Effect.FRICTION, Effect.PLASTICITY, Effect.CONTACT},
    "wetland": {Effect.FRICTION, Effect.PLASTICITY, Effect.FLUID, Effect.CONTACT},
    "clay": {Effect.FRICTION, Effect.PLASTICITY, Effect.CONTACT},
    "snow": {Effect.FRICTION, Effect.PLASTICITY, Effect.CONTACT},
    "shallow-water": {Effect.FRICTION, Effect.FLUID, Effect.CONTACT},
    "ocean": {Effect.FLUID},
}


@pytest.mark.parametrize(("name", "effects"), TABLE_6.items())
def test_effects_derived_from_the_scene_are_those_of_table_6(name: str, effects: set[Effect]) -> None:
    """They follow from the materials of the scene."""
    scene = made(name).scene(Caterpillar().body(QUICK), QUICK)
    assert scene.effects == effects | {Effect.ELASTICITY, Effect.MUSCLE, Effect.DAMPING}


@pytest.mark.parametrize("name", ["shallow-water", pytest.param("ocean[water=particles]", marks=pytest.mark.slow)])
def test_water_makes_room_for_the_robot(name: str) -> None:
    """No water is left where the robot is solid, and the displaced volume is that of the robot below the surface.

    A bed particle gives up the share of its place that lies in a robot's cube, (1 - |d|/e) along each axis; it is left
    with half of its place only beyond a distance of sqrt(3) (1 - 2^(-1/3)) e = 0.357 e from a full one. What a particle
    with less than 2 % of its place loses besides is 1 % of the body's volume at most. Layers that are
    a e apart, a < 1, give a cube up to a (3 - 2 a) of its volume, which is 9/8 at most.
    """
    env = made(name)
    body = Caterpillar().body(QUICK)
    scene = env.scene(body, QUICK)
    bed = env.bed
    assert scene.medium is not None
    assert bed is not None
    edge = QUICK.particle_edge
    alone = bed.fill(np.array(env.arena), 9.81, QUICK)
    whole = body.volumes > 0.999 * edge**3
    mostly = scene.medium.volumes > 0.5 * alone.volumes.max()
    gaps = np.linalg.norm(scene.medium.positions[mostly][:, None] - scene.robot.positions[whole][None], axis=2)
    assert gaps.min() > np.sqrt(3.0) * (1.0 - 0.5 ** (1.0 / 3.0)) * edge
    bottoms = (body.sites + scene.robot.positions - body.positions)[:, 1] - edge / 2
    below = body.volumes @ ((bed.thickness - bottoms) / edge).clip(0.0, 1.0)
    # in places: water at depth is denser than in the tank at rest
    displaced = (alone.volumes * alone.history).sum() - (scene.medium.volumes * scene.medium.history).sum()
    assert displaced == pytest.approx(below, rel=0.125 if name == "shallow-water" else 0.01)


def test_the_swimmer_is_clear_of_floor_and_surface() -> None:
    """It floats at half the depth of water at least 2.5 times as deep as it is tall."""
    env = made("ocean[water=grid]")
    scene = env.scene(Caterpillar().body(QUICK), QUICK)
    heights = scene.robot.positions[:, 1]
    assert env.arena[1] >= 2.5 * np.ptp(heights)
    assert heights.min() == pytest.approx(env.arena[1] - heights.max(), abs=QUICK.grid_spacing / 2)


@pytest.mark.parametrize("setting", ["friction=-1", "thickness=0", "length=-0.3", "thickness=0.5"])
def test_an_impossible_environment_is_refused_at_creation(setting: str) -> None:
    """Before a run is queued."""
    with pytest.raises(UsageError, match="Give"):
        made(f"desert[{setting}]")
