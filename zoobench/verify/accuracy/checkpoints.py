"""What the checkpoint interval of a gradient costs in time and memory; the gradient is the same to the last bit."""

import statistics
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from zoobench import registry
from zoobench.arrays import Array
from zoobench.cell.driving import travelling_wave
from zoobench.registry import Kind
from zoobench.spec import Ref

if TYPE_CHECKING:
    from zoobench.designs.base import Design
    from zoobench.envs.base import Environment
    from zoobench.sim.model.fidelity import Fidelity
    from zoobench.sim.model.rollout import Rollout
    from zoobench.sim.solver import Solver


INTERVALS = (1, 10, 20, 50, 0)
"""Control frames between two stored states; 0 chooses what stores the fewest, which is what a run gets."""


@dataclass(frozen=True)
class CheckpointRow:
    """One interval.

    Attributes:
        interval: control frames between two checkpoints; the chosen one where it was left to the solver.
        chosen: by the solver.
        states: held at once at most: checkpoints, and those of the segment that is recomputed.
        memory: of these states [MiB].
        seconds: wall time of an episode with its gradient, median [s].
        ratio: by that of the first interval.
        same: the gradient is that of the first interval, bit for bit.
    """

    env: str
    interval: int
    chosen: bool
    states: int
    memory: float
    seconds: float
    ratio: float
    same: bool


def checkpoints(
    env: Ref, fidelity: Ref, *, frames: int = 100, intervals: Sequence[int] = INTERVALS, repeats: int = 3
) -> Iterator[CheckpointRow]:
    """Time the same gradient at every interval, all in turn and again."""
    solvers = [_solver(env, fidelity, interval) for interval in intervals]
    actuation = travelling_wave(frames, solvers[0].muscle_count)
    times: list[list[float]] = [[] for _ in solvers]
    gradients: list[Array] = []
    rollouts: list[Rollout] = []
    for number in range(repeats + 1):  # the first compiles
        for place, solver in enumerate(solvers):
            begin = time.perf_counter()
            rollout = solver.run(actuation)
            pull = np.ones_like(rollout.positions)
            gradient = solver.backward(rollout, pull, pull)
            if number:
                times[place].append(time.perf_counter() - begin)
            else:
                gradients.append(gradient.actuation)
                rollouts.append(rollout)
    first = statistics.median(times[0])
    for solver, asked, rollout, taken, slopes in zip(solvers, intervals, rollouts, times, gradients, strict=True):
        states = _states(rollout)
        seconds = statistics.median(taken)
        yield CheckpointRow(
            env=env.name,
            interval=rollout.interval,
            chosen=asked == 0,
            states=states,
            memory=states * solver.matter.bytes_per_slot() / 2**20,
            seconds=seconds,
            ratio=seconds / first,
            same=bool(np.array_equal(slopes, gradients[0])),
        )


def _solver(env: Ref, fidelity: Ref, interval: int) -> "Solver":
    from zoobench.sim.equilibrium import equilibrated
    from zoobench.sim.solver import Solver

    place: Environment = registry.create(Kind.ENV, env)
    design: Design = registry.create(Kind.DESIGN, Ref("caterpillar"))
    grid: Fidelity = registry.create(Kind.FIDELITY, fidelity)
    scene = place.scene(design.body(grid), grid)
    start = equilibrated(scene, grid, place.equilibration_frames)
    return Solver(scene, grid, gradients=True, start=start, checkpoint_interval=interval or None)


def _states(rollout: "Rollout") -> int:
    """Checkpoints, and one state more than the longest segment has substeps."""
    counts = rollout.counts[:, 0]
    begins = range(0, len(counts), rollout.interval)
    segments = [int(counts[begin : begin + rollout.interval].sum()) for begin in begins]
    return len(segments) + max(segments) + 1
