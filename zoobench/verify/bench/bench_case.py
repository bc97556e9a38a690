"""One measurement of `bench` in a process of its own: a case as JSON on standard input, the result on the output."""

import json
import math
import statistics
import sys
import time
from typing import Any

import numpy as np

from zoobench import registry
from zoobench.cell.driving import travelling_wave
from zoobench.cell.memory import peak_memory
from zoobench.envs.base import Environment
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.scene import Scene
from zoobench.sim.solver import Solver
from zoobench.spec import Ref

_CLOSE_ENOUGH = 0.02  # relative to the wanted particle count


def build_scene(name: str, particle_count: int, precision: int) -> tuple[Scene, Fidelity]:
    """The caterpillar in an environment, on the grid whose particle count comes closest to the one asked for."""
    env: Environment = registry.create(Kind.ENV, Ref(name))
    design = registry.create(Kind.DESIGN, Ref("caterpillar"))

    def at(spacing: float) -> tuple[Scene, Fidelity]:
        fidelity = Fidelity(spacing, precision=64 if precision == 64 else 32)
        return env.scene(design.body(fidelity), fidelity), fidelity

    spacing = 1 / 64
    best = at(spacing)
    for _ in range(12):
        ratio = best[0].particle_count / particle_count
        if abs(ratio - 1) < _CLOSE_ENOUGH:
            break
        spacing *= ratio ** (1 / 3)
        trial = at(spacing)
        if abs(trial[0].particle_count - particle_count) < abs(best[0].particle_count - particle_count):
            best = trial
    return best


def measure(job: dict[str, Any]) -> dict[str, Any]:
    """Compile, then time the episodes of a case unless `only_compile` is set; the fields are of `bench.BenchRow`."""
    scene, fidelity = build_scene(job["scene"], job["particle_count"], job["precision"])
    solver = Solver(scene, fidelity, gradients=job["gradients"], device=job["device"])
    frames = max(job["frames"], math.ceil(job["episode_substeps"] / solver.substeps_per_frame))
    # the first frame beyond the second: compiling, or loading from the cache
    first, second = (_time_episodes(solver, 1, 1, solver.gradients) for _ in range(2))
    result: dict[str, Any] = {"compile_warm_s": sum(first[0] + first[1]) - sum(second[0] + second[1])}
    if not job["only_compile"]:
        result |= _rates(solver, *_time_episodes(solver, frames, job["repeats"], job["gradients"]))
        result |= {"scene": job["scene"], "precision": job["precision"]}
        peak = peak_memory()
        result["peak_memory_mib"] = None if peak is None else peak / 2**20
    return result


def _time_episodes(solver: Solver, frames: int, repeats: int, gradients: bool) -> tuple[list[float], list[float], int]:
    """Wall times of forward and of backward passes [s], and the substeps of an episode."""
    actuation = travelling_wave(frames, solver.muscle_count)
    forward, backward, substeps = [], [], 0
    for _ in range(repeats):
        begin = time.perf_counter()
        rollout = solver.run(actuation)
        forward.append(time.perf_counter() - begin)
        if rollout.divergences:
            raise RuntimeError(str(rollout.divergences[0]))
        substeps = rollout.substeps
        if gradients:
            adjoint = np.ones_like(rollout.positions)
            begin = time.perf_counter()
            solver.backward(rollout, adjoint, adjoint)
            backward.append(time.perf_counter() - begin)
    return forward, backward, substeps


def _rates(solver: Solver, forwards: list[float], backwards: list[float], substeps: int) -> dict[str, Any]:
    work = substeps * solver.particle_count / 1e6
    forward = statistics.median(forwards)
    backward = statistics.median(backwards) if backwards else None
    return {
        "particle_count": solver.particle_count,
        "robot_particle_count": solver.robot_count,
        "substeps": substeps,
        "forward_mps": work / forward,
        "forward_mps_min": work / max(forwards),
        "forward_mps_max": work / min(forwards),
        "both_mps": work / (forward + backward) if backward is not None else None,
        "backward_over_forward": backward / forward if backward is not None else None,
    }


if __name__ == "__main__":
    print(json.dumps(measure(json.loads(sys.stdin.read()))))
