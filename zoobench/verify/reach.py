"""Is the medium large enough: does a robot feel that its bed or tank ends?

A bed is as large as the robot can feel if one of twice the length and width gives the same scores. "The same" means to
within the noise floor: what the score changes by when the robot starts elsewhere by a fraction of a grid cell, which is
no change of the question at all.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from time import process_time
from typing import TYPE_CHECKING

import numpy as np

from zoobench import registry
from zoobench.arrays import Array
from zoobench.cell.driving import random_actuation
from zoobench.cell.motion import motion_of
from zoobench.errors import DivergenceError, UsageError
from zoobench.registry import Kind
from zoobench.spec import Ref
from zoobench.tasks.base import Motion

if TYPE_CHECKING:
    from zoobench.controllers.base import Controller
    from zoobench.designs.base import Body
    from zoobench.envs.base import Environment
    from zoobench.sim.model.fidelity import Fidelity
    from zoobench.tasks.base import Task


SHIFTS = ((0.0, 0.0), (0.25, 0.5), (0.5, 0.25), (0.75, 0.75))
"""Where the robot starts besides its place, in cells along x and z."""

STRONG = Ref("sine-basis", params=(("scale", 1.0),))
"""Random controllers that use most of the muscles' range: they go further than those that a method starts from."""


@dataclass(frozen=True)
class ReachRow:
    """One environment, task and controller in two sizes of the medium.

    Attributes:
        controller: number of the random draw of its parameters.
        length, width: of the smaller medium [m]; the larger has twice of each.
        score, score_doubled: mean over the shifts, in the task's unit.
        change: between the two.
        noise: the score's spread (largest minus smallest) over the shifts, mean of the two sizes.
        wall: the shortest way that was left between the robot and a wall of the smaller medium [m].
        particles, particles_doubled: of the whole scene.
        seconds, seconds_doubled: processor time of one forward episode.
    """

    env: str
    task: str
    controller: int
    length: float
    width: float
    score: float
    score_doubled: float
    change: float
    noise: float
    wall: float
    particles: int
    particles_doubled: int
    seconds: float
    seconds_doubled: float

    @property
    def is_enough(self) -> bool:
        """The larger medium makes no difference that could be told from noise."""
        return abs(self.change) <= self.noise


def reach(
    envs: Sequence[Ref],
    tasks: Sequence[Ref],
    *,
    design: Ref = Ref("caterpillar"),  # noqa: B008  (frozen)
    controller: Ref = STRONG,
    fidelity: Ref = Ref("draft"),  # noqa: B008
    frames: int = 200,
    controllers: int = 3,
    scale: float = 1.0,
    seed: int = 0,
) -> Iterator[ReachRow]:
    """Compare each environment's medium, `scale` times its length and width, with one of twice that.

    Raises:
        UnknownNameError, UsageError: a name or number that cannot be used, or an environment without a medium.
        DivergenceError: an episode blew up.
    """
    if frames < 1 or controllers < 1 or scale <= 0.0:
        raise UsageError(f"{controllers} controllers over {frames} frames at scale {scale:g} compare nothing.")
    grid = registry.create(Kind.FIDELITY, fidelity)
    body: Body = registry.create(Kind.DESIGN, design).body(grid)
    driver: Controller = registry.create(Kind.CONTROLLER, controller)
    actuation = random_actuation(driver, body.muscle_count, frames, controllers, seed)
    for name in envs:
        env: Environment = registry.create(Kind.ENV, name)
        if env.bed is None:
            raise UsageError(f"The environment {name.name!r} has no medium that could be too small.")
        small, large = (
            [_episode(_resized(env, factor, shift, grid), body, grid, actuation) for shift in SHIFTS]
            for factor in (scale, 2.0 * scale)
        )
        for task in tasks:
            yield from _rows(name.name, task, small, large)


@dataclass(frozen=True)
class _Episode:
    """What the robot did in all worlds (controllers) of one place."""

    arena: tuple[float, float, float]
    motion: Motion
    particles: int
    seconds: float

    def scores(self, task: "Task") -> Array:
        scores: Array = task.score(self.motion).numpy()
        return scores

    def wall(self) -> Array:
        """The shortest way to a wall along x or z, `[worlds]` [m]."""
        place = self.motion.positions.numpy()[..., [0, 2]]
        room = np.minimum(place, np.array(self.arena)[[0, 2]] - place)
        shortest: Array = room.min(axis=(0, 2, 3))
        return shortest


def _rows(env: str, name: Ref, small: Sequence[_Episode], large: Sequence[_Episode]) -> Iterator[ReachRow]:
    task: Task = registry.create(Kind.TASK, name)
    one, two = (np.array([episode.scores(task) for episode in part]) for part in (small, large))
    walls = np.min([episode.wall() for episode in small], axis=0)
    noise = (np.ptp(one, axis=0) + np.ptp(two, axis=0)) / 2
    for number in range(one.shape[1]):
        yield ReachRow(
            env=env,
            task=name.name,
            controller=number,
            length=small[0].arena[0],
            width=small[0].arena[2],
            score=float(one[:, number].mean()),
            score_doubled=float(two[:, number].mean()),
            change=float(two[:, number].mean() - one[:, number].mean()),
            noise=float(noise[number]),
            wall=float(walls[number]),
            particles=small[0].particles,
            particles_doubled=large[0].particles,
            seconds=float(np.mean([episode.seconds for episode in small])),
            seconds_doubled=float(np.mean([episode.seconds for episode in large])),
        )


def _resized(env: "Environment", factor: float, shift: tuple[float, float], grid: "Fidelity") -> "Environment":
    """The environment `factor` times as long and wide, its robot moved by a fraction of a cell [cells]."""
    length, height, width = env.arena
    arena = (factor * length, height, factor * width)
    start = (
        env.start[0] + shift[0] * grid.grid_spacing / arena[0],
        env.start[1] + shift[1] * grid.grid_spacing / arena[2],
    )
    return replace(env, arena=arena, start=start)


def _episode(env: "Environment", body: "Body", grid: "Fidelity", actuation: Array) -> _Episode:
    """All controllers in one place, one beside the other."""

    from zoobench.sim.equilibrium import equilibrated
    from zoobench.sim.solver import Solver

    scene = env.scene(body, grid)
    solver = Solver(scene, grid, worlds=actuation.shape[1], start=equilibrated(scene, grid, env.equilibration_frames))
    began = process_time()  # one thread does it all
    rollout = solver.run(actuation)
    seconds = (process_time() - began) / actuation.shape[1]
    if rollout.divergences:
        raise DivergenceError(next(iter(rollout.divergences.values())))
    motion = motion_of(rollout, body, env.robot.density)
    return _Episode(env.arena, motion, scene.particle_count, seconds)
