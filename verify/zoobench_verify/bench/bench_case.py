"""One case of `bench` in a process of its own: the case as JSON on standard input, the result on the output."""

import json
import math
import statistics
import sys
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from zoobench import registry
from zoobench.cell.driving import travelling_wave
from zoobench.cell.memory import peak_memory
from zoobench.envs.base import Environment
from zoobench.registry import Kind
from zoobench.sim.launch_clock import LaunchClock, work_clock
from zoobench.sim.model.fidelity import Device, Fidelity
from zoobench.sim.model.scene import Scene
from zoobench.sim.model.step_limits import choose_step
from zoobench.sim.solver import Solver
from zoobench.spec import FRAME_SECONDS, Ref
from zoobench_verify.bench import cpp_reference

_CLOSE_ENOUGH = 0.02  # relative to the wanted particle count
_EPISODE_WORK = 2_000_000  # particle-substeps of a measured episode, at least, where it is short enough
_FRAME_WORK = 20_000_000  # particle-substeps of a control frame, at most: it is shortened where there were more
_LARGEST_ARENA = 2**24  # grid nodes, about: a wider one is cut
_COARSEST = 1 / 16  # [m]: on a coarser grid an arena needs as many cells as here
_MARGIN = 0.1  # of a cut arena around the robot [m]
_LONGEST_EPISODE = 100  # frames, as many as an episode of a run has


def build_scene(name: str, particle_count: int, precision: int, device: Device = "cpu") -> tuple[Scene, Fidelity]:
    """The caterpillar in an environment, on the grid whose particle count comes closest to the one asked for.

    An arena that has far more nodes than a robot reaches in a measured episode is cut.
    """
    env: Environment = registry.create(Kind.ENV, Ref(name))
    design = registry.create(Kind.DESIGN, Ref("caterpillar"))

    def at(spacing: float) -> tuple[Scene, Fidelity]:
        fidelity = Fidelity(spacing, precision=64 if precision == 64 else 32, device=device)
        return env.scene(design.body(fidelity), fidelity), fidelity

    spacing = 1 / 64
    best = at(spacing)
    for _ in range(12):
        ratio = best[0].particle_count / particle_count
        if abs(ratio - 1) < _CLOSE_ENOUGH:
            break
        spacing = min(spacing * ratio ** (1 / 3), _COARSEST)
        trial = at(spacing)
        if abs(trial[0].particle_count - particle_count) < abs(best[0].particle_count - particle_count):
            best = trial
    return _cut(*best), best[1]


def _cut(scene: Scene, fidelity: Fidelity) -> Scene:
    """The scene with less of an arena that is too wide; the grid's nodes stay where they are."""
    lower, upper, h = np.array(scene.lower), np.array(scene.upper), fidelity.grid_spacing
    if scene.medium is not None or np.prod((upper - lower) / h) <= _LARGEST_ARENA:
        return scene
    near, far = (scene.robot.positions.min(0) - _MARGIN, scene.robot.positions.max(0) + _MARGIN)
    first = np.maximum(0.0, np.floor((near - lower) / h)) * [1, 0, 1]  # of the cells; the ground stays
    last = np.minimum((upper - lower) / h, np.ceil((far - lower) / h))
    lowest, highest = (tuple((lower + cells * h).tolist()) for cells in (first, last))
    return replace(scene, lower=lowest, upper=highest)


@dataclass(frozen=True)
class EpisodeTime:
    """Seconds of one episode, of processor time (on CUDA of wall time) unless it is called wall.

    Attributes:
        forward, backward: of the passes; backward is 0 without gradients.
        reverse: of the launches of the backward pass, without what it simulates again.
        wall: of both passes.
        substeps, recomputed: world-substeps, and those that the backward pass simulated again.
    """

    forward: float
    backward: float
    reverse: float
    wall: float
    substeps: int
    recomputed: int


class TimedSolver:
    """A solver whose episodes are timed; its kernels are compiled, or loaded from the cache.

    Attributes:
        solver: the solver itself.
        loading: seconds of that by kernel.
        launch: seconds of a launch of no substeps by kernel, None without gradients for the reverse.
    """

    def __init__(self, scene: Scene, fidelity: Fidelity, job: dict[str, Any], *, gradients: bool) -> None:
        worlds = job["worlds"]
        work = scene.particle_count * worlds * choose_step(scene, fidelity, FRAME_SECONDS).substeps_per_frame
        self.solver = Solver(
            scene, fidelity, worlds=worlds, gradients=gradients,
            frame_seconds=FRAME_SECONDS * min(1.0, _FRAME_WORK / work),
        )  # fmt: skip
        self._seconds = work_clock(job["device"])
        self._clock = LaunchClock(self.solver.launcher, self._seconds)
        for _ in range(2):
            self.episode(1)
        self.loading = {name: times.loading_s for name, times in self._clock.times().items()}
        self.launch = {name: self._clock.launch_seconds(name) for name in ("advance", "reverse")}

    def episode(self, frames: int) -> EpisodeTime:
        """Time an episode of a travelling wave in every world, and its backward pass.

        Raises:
            RuntimeError: it diverges.
        """
        solver, seconds = self.solver, self._seconds
        actuation = np.tile(travelling_wave(frames, solver.muscle_count), (1, solver.worlds, 1))
        recomputed, reversed_before = solver.meter.recomputed, len(self._clock.spent["reverse"])
        wall, begin = time.perf_counter(), seconds()
        rollout = solver.run(actuation)
        forward = seconds() - begin
        if rollout.divergences:
            raise RuntimeError(str(rollout.divergences[0]))
        backward = 0.0
        if solver.gradients:
            adjoint = np.ones_like(rollout.positions)
            begin = seconds()
            solver.backward(rollout, adjoint, adjoint)
            backward = seconds() - begin
        return EpisodeTime(
            forward,
            backward,
            reverse=sum(self._clock.spent["reverse"][reversed_before:]),
            wall=time.perf_counter() - wall,
            substeps=int(rollout.counts.sum()),
            recomputed=solver.meter.recomputed - recomputed,
        )


def measure(job: dict[str, Any]) -> dict[str, Any]:
    """Compile, then time the episodes of a case unless `only_compile` is set.

    Returns:
        `compile`, `launch` and unless `only_compile` is set `rate`, with fields of `bench_rows`.
    """
    scene, fidelity = build_scene(job["scene"], job["asked"], job["precision"], job["device"])
    timed = {gradients: TimedSolver(scene, fidelity, job, gradients=gradients) for gradients in _passes(job)}
    # both load the same kernels: who comes first has the reverse, too, where there is one
    first = next(iter(timed.values()))
    loading = {name: first.loading.get(name) for name in first.launch}
    result: dict[str, Any] = {
        "compile": {**loading, "compile": sum(first.loading.values())},
        "launch": first.launch,
        "particle_count": first.solver.particle_count,
    }
    if not job["only_compile"]:
        result["rate"] = _rates(timed, job)
    peak = peak_memory()
    result["peak_memory_mib"] = None if peak is None else peak / 2**20
    return result


def _passes(job: dict[str, Any]) -> Sequence[bool]:
    """Whether there are gradients, for each solver to measure."""
    return (True, False) if job["gradients"] else (False,)


def _rates(timed: dict[bool, TimedSolver], job: dict[str, Any]) -> dict[str, Any]:
    """The fields of `RateRow` that the measured episodes give."""
    solver = timed[False].solver
    work = solver.substeps_per_frame * solver.particle_count * solver.worlds
    frames = job["frames"] or min(_LONGEST_EPISODE, math.ceil(_EPISODE_WORK / work))
    taken: dict[bool, list[EpisodeTime]] = {gradients: [] for gradients in timed}
    references = []
    for _ in range(job["repeats"]):  # in turn, so that what else the machine does meets all alike
        for gradients, subject in timed.items():
            taken[gradients].append(subject.episode(frames))
        if job["reference"]:
            references.append(cpp_reference.rate(Path(job["reference"])))
    forward, both = taken[False], taken.get(True, [])
    million = solver.particle_count / 1e6
    return {
        "particle_count": solver.particle_count,
        "robot_particle_count": solver.robot_count,
        "frames": frames,
        "substeps": forward[0].substeps,
        **_spread("forward_mps", [million * each.substeps / each.forward for each in forward]),
        **_spread("reverse_mps", [million * each.substeps / each.reverse for each in both]),
        **_spread("both_mps", [million * each.substeps / (each.forward + each.backward) for each in both]),
        "backward_over_forward": _median(each.backward / each.forward for each in both),
        "recomputed": _median(each.recomputed / each.substeps for each in both),
        "forward_cpu_s": _median(each.forward for each in forward),
        "forward_wall_s": _median(each.wall for each in forward),
        "both_cpu_s": _median(each.forward + each.backward for each in both),
        "both_wall_s": _median(each.wall for each in both),
        "reference_mps": _median(references),
    }


def _median(values: Iterable[float]) -> float | None:
    """The median of some values, None of none."""
    known = list(values)
    return statistics.median(known) if known else None


def _spread(name: str, values: Sequence[float]) -> dict[str, float | None]:
    """Median, least and largest as fields of a row."""
    ends = (min(values), max(values)) if values else (None, None)
    return {name: _median(values), f"{name}_min": ends[0], f"{name}_max": ends[1]}


if __name__ == "__main__":
    print(json.dumps(measure(json.loads(sys.stdin.read()))))
