"""No score depends on where an arena ends: one of twice the length and width gives the same.

On level ground and solid beds the arena follows the robot, with objects or obstacles it has room for an episode, and
water by forces has no bounds: published solutions score the same to within 1 %. In water of particles waves are
reflected by the walls of the tank, and "the same" means to within the noise floor: the spread of the score over starts
that differ by fractions of a grid cell.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from zoobench import registry
from zoobench.arrays import Array
from zoobench.cell.driving import random_actuation
from zoobench.cell.episode import Evaluation
from zoobench.cell.motion import motion_of
from zoobench.cell.problem import Problem
from zoobench.db import published
from zoobench.designs.caterpillar import Caterpillar
from zoobench.envs.base import Environment
from zoobench.errors import UsageError
from zoobench.inputs import make_known, named_runs, run_name
from zoobench.registry import KINDS, Kind
from zoobench.sim.equilibrium import equilibrated
from zoobench.sim.solver import Solver
from zoobench.spec import AXES, FRAME_SECONDS, Ref, RunSpec

SHIFTS = ((0.0, 0.0), (0.25, 0.5), (0.5, 0.25), (0.75, 0.75))  # of the robot's start along x and z [cells]
STRONG = Ref("sine-basis", params=(("scale", 1.0),))  # random controllers that use most of the muscles' range
WORLDS = 2


def _today(spec: RunSpec) -> bool:
    """Whether the versions and parameters of the run's components are still registered."""
    try:
        return all(registry.resolve(KINDS[axis], getattr(spec, axis)) for axis in AXES)
    except UsageError:
        return False


def _published() -> list[Any]:
    """The published solutions that can be evaluated, and how many cannot."""
    every = published.solutions()
    today = [pytest.param(run, id=run.full_name) for run in every if _today(run.spec)]
    reason = f"{len(every) - len(today)} of {len(every)} published solutions are of earlier versions of components"
    earlier = pytest.param(None, id="earlier", marks=pytest.mark.skip(reason))
    return today if len(today) == len(every) else [*today, earlier]


def _evaluated(spec: RunSpec, params: tuple[float, ...], factor: float, monkeypatch: pytest.MonkeyPatch) -> Evaluation:
    """In an arena of `factor` times the length and width."""
    make = registry.create

    def widened(kind: Kind, ref: Ref) -> object:
        made = make(kind, ref)
        if isinstance(made, Environment):
            length, height, width = made.arena
            return replace(made, arena=(factor * length, height, factor * width))
        return made

    with monkeypatch.context() as patched:
        patched.setattr(registry, "create", widened)
        return Problem(spec, worlds=1).evaluate(np.array(params))


def _check(run: published.PublishedRun, spec: RunSpec, monkeypatch: pytest.MonkeyPatch) -> None:
    """A score changes by a hundredth, an error by a hundredth of the robot's way, of which it is a difference."""
    for key in named_runs(spec.design, spec.controller):
        make_known(run_name(key), published.with_key(key).start)
    usual, wide = (_evaluated(spec, run.params, factor, monkeypatch) for factor in (1.0, 2.0))
    assert np.isfinite(usual.score)
    way = abs(usual.score)
    if "error" in registry.get(Kind.TASK, spec.task.name).tags:
        way = usual.metrics["distance"].value / (spec.frames * FRAME_SECONDS if run.unit == "m/s" else 1.0)
    print(f"{run.full_name}, {spec.frames} frames: {abs(wide.score - usual.score) / way:.3%}")
    assert wide.score == pytest.approx(usual.score, abs=0.01 * way)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["best:gaits/ground/movement-speed/caterpillar", "best:gaits/desert/movement-speed/caterpillar"]
)
def test_a_published_gait_scores_the_same_in_an_arena_of_twice_the_size(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With today's versions of its components, whichever it was found with."""
    run = published.named(name)
    today = {axis: replace(getattr(run.spec, axis), version=0) for axis in AXES}
    _check(run, replace(run.spec, frames=200, **today), monkeypatch)


@pytest.mark.slow
@pytest.mark.parametrize("frames", [100, 200])
@pytest.mark.parametrize("run", _published())
def test_every_published_solution_scores_the_same_in_an_arena_of_twice_the_size(
    run: published.PublishedRun, frames: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In the environment of its row, with its settings."""
    _check(run, replace(run.spec, frames=frames), monkeypatch)


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
