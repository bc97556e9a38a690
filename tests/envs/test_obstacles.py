"""Obstacles of firm ground."""

import numpy as np
import pytest

from zoobench import registry
from zoobench.envs.base import Environment
from zoobench.envs.obstacles import OBSTACLE
from zoobench.errors import SceneError, UsageError
from zoobench.registry import Kind
from zoobench.sim.equilibrium import equilibrated
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.scene import Scene
from zoobench.sim.solver import Solver
from zoobench.spec import Ref

GRID = Fidelity(1 / 64)


def _scene(env: str, design: str = "caterpillar") -> Scene:
    made: Environment = registry.create(Kind.ENV, Ref.parse(env))
    return made.scene(registry.create(Kind.DESIGN, Ref.parse(design)).body(GRID), GRID)


@pytest.mark.parametrize("kind", ["ceiling", "slot", "hurdle", "post", "pegs", "shaft"])
def test_an_obstacle_stands_where_it_is_asked_for_and_is_held(kind: str) -> None:
    """Before the robot at the distance asked for, a shaft at its sides; all of it is held."""
    scene = _scene(f"ground[obstacle={kind},obstacle_distance=0.04]")
    (thing,) = scene.objects
    assert thing.name == OBSTACLE
    assert len(thing.body.anchor) == 1
    robot, places, edge = scene.robot.positions, thing.body.positions, GRID.particle_edge
    axis = 2 if kind == "shaft" else 0
    gap = places[places[:, axis] > robot[:, axis].max(), axis].min() - robot[:, axis].max()
    assert gap == pytest.approx(0.04 + edge, abs=edge)


def test_the_opening_is_as_wide_as_asked_for() -> None:
    """No matter is in the opening of a slot, or below a ceiling; there is some beyond both edges."""
    for kind, axis in (("slot", 2), ("ceiling", 1)):
        scene = _scene(f"ground[obstacle={kind},obstacle_opening=0.06]")
        places = scene.objects[0].body.positions
        middle = np.ptp(scene.robot.positions[:, 2]) / 2 + scene.robot.positions[:, 2].min()
        away = np.abs(places[:, 2] - middle) - 0.03 if kind == "slot" else places[:, 1] - 0.06
        assert 0.0 < away.min() < GRID.particle_edge, axis


BRIDGE = "ground[obstacle=bridge,obstacle_length=0.1875]"


def test_a_robot_begins_on_the_first_bank_of_a_bridge() -> None:
    """As high above it as bodies carry each other; held is what is before and behind the span, from node to node."""
    scene = _scene(BRIDGE)
    (bridge,) = scene.objects
    (_, near), (far, _) = bridge.body.anchor
    assert far[0] - near[0] == pytest.approx(0.1875)
    assert (near[0] / GRID.grid_spacing) % 1.0 == pytest.approx(0.0)
    assert 0.03 < near[0] - scene.robot.positions[:, 0].max() - GRID.particle_edge / 2 < 0.03 + GRID.grid_spacing
    half = GRID.particle_edge / 2
    places, robot = bridge.body.positions, scene.robot
    assert places[:, 1].min() - half == pytest.approx(0.05)
    gap = (robot.sites[:, 1].min() - half) - (places[:, 1].max() + half)
    assert gap == pytest.approx(GRID.grid_spacing / 4, abs=1e-9)
    for axis in (0, 2):
        assert places[:, axis].min() < robot.positions[:, axis].min()
        assert places[:, axis].max() > robot.positions[:, axis].max()


def test_the_arena_has_room_for_a_bridge_in_a_short_episode() -> None:
    """Of any span: its far end is inside."""
    made: Environment = registry.create(Kind.ENV, Ref.parse("ground[obstacle=bridge,obstacle_length=1]"))
    scene = made.scene(registry.create(Kind.DESIGN, Ref("caterpillar")).body(GRID), GRID, 0.1)
    assert scene.objects[0].body.positions[:, 0].max() < scene.upper[0]


@pytest.mark.slow  # kernels of a body that is held in part
def test_a_bridge_sags_and_carries_its_robot_at_rest() -> None:
    """By several millimetres under its weight; on the bank the robot goes nowhere, and is on the bridge, not in it."""
    scene = _scene(BRIDGE)
    start = equilibrated(scene, GRID, registry.create(Kind.ENV, Ref("ground")).equilibration_frames)
    solver = Solver(scene, GRID, start=start)
    rollout = solver.run(np.zeros((25, 1, solver.muscle_count)))
    robot, bridge = (rollout.positions[:, 0, scene.slice_of(name)] for name in ("robot", OBSTACLE))
    sag = scene.objects[0].body.positions[:, 1] - bridge[-1, :, 1]
    assert 1e-3 < sag.max() < 0.02
    speed = (robot[-1].mean(axis=0) - robot[0].mean(axis=0)) / 0.2
    assert np.abs(speed[[0, 2]]).max() < 1e-6
    gap = robot[-1, :, 1].min() - scene.objects[0].body.positions[:, 1].max()
    assert 0.75 * GRID.particle_edge < gap < 1.25 * GRID.particle_edge + GRID.grid_spacing / 4


_PEGS = "ground[obstacle=pegs,obstacle_opening=0.03,object=beam,object_size=0.16,object_height=0.03,object_gap=0.04]"


@pytest.mark.parametrize("design", ["caterpillar", "arm"])
def test_a_beam_lies_on_pegs(design: str) -> None:
    """Across both, as far above them as bodies carry each other, however high the robot is above the ground."""
    beam, pegs = (each.body for each in _scene(_PEGS, design).objects)
    gap = beam.sites[:, 1].min() - GRID.particle_edge / 2 - 0.03
    assert gap == pytest.approx(GRID.grid_spacing / 4, abs=1e-9)
    for side in (-1, 1):
        own = pegs.positions[side * (pegs.positions[:, 2] - pegs.positions[:, 2].mean()) > 0]
        over = (np.abs(beam.positions[:, None, ::2] - own[None, :, ::2]) < GRID.particle_edge / 2).all(axis=-1)
        assert over.any()


_TABLE = "obstacle_length=0.1,object=box,object_size=0.05,object_mass=0.05,object_gap=0.055"


@pytest.mark.slow  # kernels of three bodies
@pytest.mark.parametrize(
    "place",
    [
        _PEGS,
        f"ground[obstacle=hurdle,obstacle_opening=0.04,object_height=0.04,{_TABLE}]",
        f"ground[obstacle=ceiling,obstacle_opening=0.06,object_height=0.09125,{_TABLE}]",
    ],
)
def test_an_object_stays_on_an_obstacle(place: str) -> None:
    """For half a second, in which it would fall by a metre: not further down than bodies carry each other."""
    scene = _scene(place)
    start = equilibrated(scene, GRID, registry.create(Kind.ENV, Ref("ground")).equilibration_frames)
    solver = Solver(scene, GRID, start=start)
    rollout = solver.run(np.zeros((60, 1, solver.muscle_count)))
    item = scene.slice_of("object")
    moved = rollout.positions[-1, 0, item] - scene.objects[0].body.positions
    assert not rollout.divergences
    assert len(moved) == scene.objects[0].body.particle_count
    assert np.abs(moved.mean(axis=0)).max() < 0.25 * GRID.grid_spacing


@pytest.mark.parametrize(
    ("params", "fault", "told"),
    [
        ("obstacle=post,obstacle_opening=0", UsageError, "obstacle_opening of 0"),
        ("obstacle=post,obstacle_friction=-1", UsageError, "obstacle_friction of -1"),
        ("obstacle=post,obstacle_opening=0.001", SceneError, "Give an obstacle_opening of 0.01562 m or more"),
        ("obstacle=hurdle,obstacle_length=0.01", SceneError, "Give an obstacle_length of 0.01562 m or more"),
        ("obstacle=slot,obstacle_opening=0.3", SceneError, "0 m for a wall .* obstacle_opening of 0.169 m or less"),
        ("obstacle=ceiling,obstacle_distance=5", SceneError, "obstacle_distance of 5, .* beyond the arena.* smaller"),
        ("obstacle=ceiling,obstacle_opening=0.5", SceneError, "obstacle_opening of 0.5 .* beyond the arena"),
        ("obstacle=slot,relief=0.02", SceneError, "level ground"),
        ("object=box,object_height=0.1,relief=0.02", SceneError, "above level ground"),
        ("obstacle=bridge,relief=0.02", SceneError, "level ground"),
        ("obstacle=bridge,object=box", SceneError, "free, without objects"),
        ("obstacle=bridge,obstacle_opening=0.4", SceneError, "obstacle_opening of 0.4 .* beyond the arena"),
        ("obstacle=bridge,obstacle_length=0.01", SceneError, "Give an obstacle_length of 0.01562 m or more"),
        ("obstacle=bridge,obstacle_length=1000", SceneError, "grid cells, too many to hold"),
        ("obstacle=bridge,obstacle_stiffness=0", UsageError, "obstacle_stiffness of 0"),
        ("obstacle=slot,obstacle_stiffness=1e5", UsageError, "no effect on a slot"),
        ("obstacle_stiffness=1e5", UsageError, "no effect without an obstacle"),
        ("object=box,obstacle=slot", SceneError, "obstacle begins within the object. .* it or the object smaller"),
        (_PEGS[7:-1].replace("object_height=0.03", "object_height=0.01"), SceneError, "begins within"),
    ],
)
def test_impossible_obstacles_are_refused(params: str, fault: type[Exception], told: str) -> None:
    """The error names the parameter or the reason."""
    with pytest.raises(fault, match=told):
        _scene(f"ground[{params}]")


@pytest.mark.parametrize("design", ["arm", "arm[base_speed=0.1]", "gripper"])
def test_what_is_held_at_its_base_walks_over_no_bridge(design: str) -> None:
    """It hangs above the ground."""
    with pytest.raises(SceneError, match="not held at its base"):
        _scene(BRIDGE, design)
