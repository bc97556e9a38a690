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
    return made.scene(registry.create(Kind.DESIGN, Ref(design)).body(GRID), GRID)


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


@pytest.mark.slow  # kernels of three bodies
def test_a_beam_stays_on_pegs() -> None:
    """For half a second, in which it would fall by a metre: not further down than bodies carry each other."""
    scene = _scene(_PEGS)
    start = equilibrated(scene, GRID, registry.create(Kind.ENV, Ref("ground")).equilibration_frames)
    solver = Solver(scene, GRID, start=start)
    rollout = solver.run(np.zeros((60, 1, solver.muscle_count)))
    beam = scene.slice_of("object")
    moved = rollout.positions[-1, 0, beam] - scene.objects[0].body.positions
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
        ("object=box,obstacle=slot", SceneError, "obstacle begins within the object. .* it or the object smaller"),
        (_PEGS[7:-1].replace("object_height=0.03", "object_height=0.01"), SceneError, "begins within"),
    ],
)
def test_impossible_obstacles_are_refused(params: str, fault: type[Exception], told: str) -> None:
    """The error names the parameter or the reason."""
    with pytest.raises(fault, match=told):
        _scene(f"ground[{params}]")
