"""Media are as large as a robot can feel: one of twice the length and width gives the same scores.

"The same" means to within the noise floor: the spread of the score over starts that differ by fractions of a grid cell.
"""

from dataclasses import replace

import numpy as np
import pytest

from zoobench import registry
from zoobench.arrays import Array
from zoobench.cell.driving import random_actuation
from zoobench.cell.motion import motion_of
from zoobench.designs.caterpillar import Caterpillar
from zoobench.envs.base import Environment
from zoobench.registry import Kind
from zoobench.sim.equilibrium import equilibrated
from zoobench.sim.solver import Solver
from zoobench.spec import Ref

SHIFTS = ((0.0, 0.0), (0.25, 0.5), (0.5, 0.25), (0.75, 0.75))  # of the robot's start along x and z [cells]
STRONG = Ref("sine-basis", params=(("scale", 1.0),))  # random controllers that use most of the muscles' range
WORLDS = 2


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
        motion = motion_of(rollout, body, env.robot.density)
        found.append([task.score(motion).numpy() for task in tasks])
    return np.array(found)


def feels_the_size(name: str, frames: int, scale: float = 1.0) -> bool:
    """Whether any score in a medium of `scale` times its length and width differs from that in twice the size."""
    env: Environment = registry.create(Kind.ENV, Ref.parse(name))
    length, height, width = env.arena
    small, large = (
        scores(replace(env, arena=(factor * length, height, factor * width)), frames) for factor in (scale, 2.0 * scale)
    )
    noise = (np.ptp(small, axis=0) + np.ptp(large, axis=0)) / 2
    return bool((np.abs(large.mean(axis=0) - small.mean(axis=0)) > noise).any())


@pytest.mark.slow
def test_few_frames_carry_nothing_to_the_end_of_a_bed_and_back() -> None:
    """Sand carries no waves: the scores are the same for walls at any distance."""
    assert not feels_the_size("desert", frames=5)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["desert", "clay", "wetland", "snow", "shallow-water", "ocean[water=particles]"])
def test_media_are_as_large_as_the_robot_can_feel(name: str) -> None:
    """Over 60 frames, for movement speed and turning."""
    assert not feels_the_size(name, frames=60)


@pytest.mark.slow
def test_a_tank_that_is_too_small_is_felt() -> None:
    """A swimmer between walls a centimetre away; after fewer frames the change is still of the size of the noise."""
    assert feels_the_size("ocean[water=particles]", frames=60, scale=0.55)
