"""How fast this machine simulates: control frames of a robot per second of processor time."""

import math
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from zoobench import registry
from zoobench.cell.driving import travelling_wave
from zoobench.envs.base import Environment
from zoobench.errors import DivergenceError
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.runtime import check_device, work_clock
from zoobench.sim.solver import Solver
from zoobench.spec import Ref

_EPISODE_WORK = 2_000_000  # particle-substeps of a measured episode, at least, where it is short enough
_LONGEST_EPISODE = 100  # frames, as many as an episode of a run has


@dataclass(frozen=True)
class EpisodeRate:
    """The speed of an episode: the median of the repeats, with the least and the largest.

    Times are of the processor; on CUDA, whose work is not done by the processor, they are wall times.

    Attributes:
        fps, least, largest: control frames of a robot per second, all worlds together [1/s].
        mps: million particle-substeps per second.
    """

    fps: float
    least: float
    largest: float
    mps: float


@dataclass(frozen=True)
class Speed:
    """The speed of the caterpillar in one environment.

    Attributes:
        particles: of robot and medium in one world.
        frames: control frames of a measured episode.
        forward: of an episode.
        gradient: of an episode with its backward pass; None if that was not measured.
    """

    env: str
    fidelity: str
    worlds: int
    particles: int
    frames: int
    forward: EpisodeRate
    gradient: EpisodeRate | None


def measure(env: Ref, fidelity: Ref, *, worlds: int = 1, gradients: bool = True, repeats: int = 5) -> Speed:
    """Measure episodes with full muscle activation in a travelling wave.

    Raises:
        UsageError: this machine lacks the device of the fidelity, or the device cannot simulate the scene.
        DivergenceError: the simulation diverged.
    """
    environment: Environment = registry.create(Kind.ENV, env)
    grid: Fidelity = environment.simulated(registry.create(Kind.FIDELITY, fidelity))
    check_device(grid.device)
    scene = environment.scene(registry.create(Kind.DESIGN, Ref("caterpillar")).body(grid), grid)
    solvers = [Solver(scene, grid, worlds=worlds, gradients=each) for each in (False, True)[: 1 + gradients]]
    seconds = work_clock(grid.device)
    work = solvers[0].substeps_per_frame * solvers[0].particle_count * worlds
    frames = min(_LONGEST_EPISODE, math.ceil(_EPISODE_WORK / work))
    # in turn, so that other work on the machine slows all of them; the first round compiles
    rounds = [[_episode(solver, frames, seconds) for solver in solvers] for _ in range(1 + repeats)][1:]
    particles = solvers[0].particle_count
    forward, *gradient = (_rate(taken, frames * worlds, particles) for taken in zip(*rounds, strict=True))
    return Speed(str(env), str(fidelity), worlds, particles, frames, forward, gradient[0] if gradient else None)


def _episode(solver: Solver, frames: int, seconds: Callable[[], float]) -> tuple[float, int]:
    """Seconds of an episode in every world, with its backward pass where the solver has gradients, and its substeps."""
    actuation = np.tile(travelling_wave(frames, solver.muscle_count), (1, solver.worlds, 1))
    begin = seconds()
    rollout = solver.run(actuation)
    if rollout.divergences:
        raise DivergenceError(rollout.divergences[0])
    if solver.gradients:
        adjoint = np.ones_like(rollout.positions)
        solver.backward(rollout, adjoint, adjoint)
    return seconds() - begin, int(rollout.counts.sum())


def _rate(episodes: Sequence[tuple[float, int]], frames: int, particles: int) -> EpisodeRate:
    """The speed by the seconds and substeps of each episode."""
    rates = [frames / spent for spent, _ in episodes]
    mps = statistics.median(particles * substeps / spent / 1e6 for spent, substeps in episodes)
    return EpisodeRate(statistics.median(rates), min(rates), max(rates), mps)
