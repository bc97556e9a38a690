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


def _scene(env: str) -> Scene:
    made: Environment = registry.create(Kind.ENV, Ref.parse(env))
    return made.scene(registry.create(Kind.DESIGN, Ref("caterpillar")).body(GRID), GRID)


@pytest.mark.parametrize("kind", ["ceiling", "slot", "hurdle", "post", "pegs", "shaft"])
def test_an_obstacle_stands_where_it_is_asked_for_and_is_held(kind: str) -> None:
    """Before the robot at the distance asked for, a shaft at its sides; all of it is held."""
    scene = _scene(f"ground[obstacle={kind},obstacle_distance=0.04]")
    (thing,) = scene.objects
    assert thing.name == OBSTACLE
    assert thing.body.anchor is not None
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


_PEGS = "ground[obstacle=pegs,obstacle_opening=0.03,object=beam,object_size=0.16,object_height=0.03]"


def test_a_beam_lies_on_pegs() -> None:
    """Across both, as far above them as bodies carry each other; one that is put lower begins within them."""
    beam, pegs = (each.body.positions for each in _scene(_PEGS).objects)
    top = pegs[:, 1].max() + GRID.particle_edge / 2
    assert beam[:, 1].min() - GRID.particle_edge / 2 - top == pytest.approx(GRID.grid_spacing / 4, abs=GRID.particle_edge / 2)
    for side in (-1, 1):
        own = pegs[side * (pegs[:, 2] - pegs[:, 2].mean()) > 0]
        over = (np.abs(beam[:, None, ::2] - own[None, :, ::2]) < GRID.particle_edge / 2).all(axis=-1)
        assert over.any()
    with pytest.raises(SceneError, match="begins within"):
        _scene(_PEGS.replace("object_height=0.03", "object_height=0.01"))


@pytest.mark.slow  # kernels of three bodies
def test_a_beam_stays_on_pegs() -> None:
    """For half a second, in which it would fall by a metre."""
    made: Environment = registry.create(Kind.ENV, Ref.parse(_PEGS))
    scene = made.scene(registry.create(Kind.DESIGN, Ref("caterpillar")).body(GRID), GRID)
    solver = Solver(scene, GRID, start=equilibrated(scene, GRID, made.equilibration_frames))
    rollout = solver.run(np.zeros((60, 1, solver.muscle_count)))
    beam = scene.slice_of("object")
    assert not rollout.divergences
    start, end = (rollout.positions[frame, 0] for frame in (0, -1))
    assert len(end) >= beam.stop
    assert np.abs((end - start)[beam].mean(axis=0)).max() < 1e-3


@pytest.mark.parametrize(
    ("params", "fault", "told"),
    [
        ("obstacle=post,obstacle_opening=0", UsageError, "obstacle_opening of 0"),
        ("obstacle=post,obstacle_friction=-1", UsageError, "obstacle_friction of -1"),
        ("obstacle=post,obstacle_opening=0.001", SceneError, "thinner than a cell"),
        ("obstacle=slot,relief=0.02", SceneError, "level ground"),
    ],
)
def test_impossible_obstacles_are_refused(params: str, fault: type[Exception], told: str) -> None:
    """The error names the parameter or the reason."""
    with pytest.raises(fault, match=told):
        _scene(f"ground[{params}]")
