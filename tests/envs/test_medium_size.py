"""No score depends on where an arena ends: one of twice the length and width gives the same.

On level ground and solid beds the arena follows the robot, and published gaits score the same to within 1 %. In water
of particles waves are reflected by the walls of the tank, and "the same" means to within the noise floor: the spread of
the score over starts that differ by fractions of a grid cell.
"""

from dataclasses import replace

import numpy as np
import pytest

from zoobench import registry
from zoobench.arrays import Array
from zoobench.cell.driving import random_actuation
from zoobench.cell.motion import motion_of
from zoobench.cell.problem import Problem
from zoobench.db import published
from zoobench.designs.caterpillar import Caterpillar
from zoobench.envs.base import Environment
from zoobench.registry import Kind
from zoobench.sim.equilibrium import equilibrated
from zoobench.sim.solver import Solver
from zoobench.spec import Budget, Ref

SHIFTS = ((0.0, 0.0), (0.25, 0.5), (0.5, 0.25), (0.75, 0.75))  # of the robot's start along x and z [cells]
STRONG = Ref("sine-basis", params=(("scale", 1.0),))  # random controllers that use most of the muscles' range
WORLDS = 2
LAND = {"ground", "ice", "desert", "clay", "wetland", "snow"}


def _gait_scores(
    gait: published.PublishedRun, factor: float, frames: int, monkeypatch: pytest.MonkeyPatch
) -> tuple[float, float]:
    """A published gait in today's environment with an arena of `factor` times the length and width: the score, and
    what a hundredth of the robot's way changes it by.

    A score is a speed, and changes as the way does; an error [m] is a difference of two ways, and changes by a
    hundredth of one.
    """
    make = registry.create

    def widened(kind: Kind, ref: Ref) -> object:
        made = make(kind, ref)
        if isinstance(made, Environment):
            length, height, width = made.arena
            return replace(made, arena=(factor * length, height, factor * width))
        return made

    monkeypatch.setattr(registry, "create", widened)
    env = registry.resolve(Kind.ENV, Ref(gait.spec.env.name))
    spec = replace(gait.spec, env=env, frames=frames, budget=Budget.parse("1000 episodes"))
    found = Problem(spec, worlds=1).evaluate(np.array(gait.params))
    monkeypatch.undo()
    way = found.metrics["distance"].value if spec.task.name == "waypoint-following" else found.score
    return found.score, 0.01 * abs(way)


def _check(name: str, frames: int, monkeypatch: pytest.MonkeyPatch) -> None:
    gait = published.named(name)
    (usual, change), (wide, _) = (_gait_scores(gait, factor, frames, monkeypatch) for factor in (1.0, 2.0))
    assert usual == pytest.approx(wide, abs=change)


@pytest.mark.slow
@pytest.mark.parametrize("frames", [100, 200])
@pytest.mark.parametrize("name", [name for name in published.names() if name.split("/")[0].split(":")[1] in LAND])
def test_every_published_gait_scores_the_same_in_an_arena_of_twice_the_size(
    name: str, frames: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On land, over one and two times the frames that it was found for."""
    _check(name, frames, monkeypatch)


def scores(env: Environment, frames: int) -> Array:
    """Scores `[shifts, tasks, controllers]`."""
    grid = registry.create(Kind.FIDELITY, Ref("smoke"))
    body = Caterpillar().body(grid)
    actuation = random_actuation(registry.create(Kind.CONTROLLER, STRONG), body.muscle_count, frames, WORLDS, seed=0)
    tasks = [registry.create(Kind.TASK, Ref(name)) for name in ("movement-speed", "turning")]
    found = []
    for along, across in SHIFTS:
        start = (
            env.start[0] + along * grid.grid_spacing / env.arena[0],
            env.start[1] + across * grid.grid_spacing / env.arena[2],
        )
        scene = replace(env, start=start).scene(body, grid)
        solver = Solver(scene, grid, worlds=WORLDS, start=equilibrated(scene, grid, env.equilibration_frames))
        rollout = solver.run(actuation)
        assert not rollout.divergences
        motion = motion_of(rollout, body, scene)
        found.append([task.score(motion).numpy() for task in tasks])
    return np.array(found)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["shallow-water", "ocean[water=particles]"])
def test_tanks_are_as_large_as_the_robot_can_feel(name: str) -> None:
    """Over 60 frames, for movement speed and turning."""
    env: Environment = registry.create(Kind.ENV, Ref.parse(name))
    length, height, width = env.arena
    small, large = (
        scores(replace(env, arena=(factor * length, height, factor * width)), frames=60) for factor in (1.0, 2.0)
    )
    noise = (np.ptp(small, axis=0) + np.ptp(large, axis=0)) / 2
    assert not (np.abs(large.mean(axis=0) - small.mean(axis=0)) > noise).any()
