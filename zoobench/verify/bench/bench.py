"""`zoobench bench`: speed, compile time and memory of the simulator on this machine.

Every case is measured in two processes of its own, with an empty kernel cache for the cold compile time and with the
filled one for everything else, so that the peak memory is that of the case alone.
"""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from zoobench import registry
from zoobench.errors import UsageError, ZoobenchError
from zoobench.registry import Kind

LARGEST_PARTICLE_COUNT = 2_000_000


@dataclass(frozen=True)
class BenchCase:
    """The caterpillar in an environment, at the grid spacing that gives about this many particles.

    Attributes:
        precision: 32 or 64 bits.
        gradients: measure the backward pass too.
        repeats: measured episodes, of which the median is given.
        frames, episode_substeps: least lengths of an episode.
        device: `cpu` or `cuda`.
    """

    scene: str
    particle_count: int
    precision: int = 32
    gradients: bool = True
    repeats: int = 5
    frames: int = 10
    episode_substeps: int = 0
    device: str = "cpu"


@dataclass(frozen=True)
class BenchRow:
    """One measured case. Rates are medians over the repeats, in million particle-substeps per second.

    Attributes:
        particle_count: particles of one world, robot and medium.
        robot_particle_count: particles of the robot.
        substeps: of one measured episode.
        forward_mps, forward_mps_min, forward_mps_max: rate of the forward simulation.
        both_mps: rate of forward and backward together, or None without gradients.
        backward_over_forward: time of the backward pass, with its recomputation, by that of the forward pass.
        compile_cold_s: time to compile forward (and gradient) kernels with an empty cache [s].
        compile_warm_s: time to load them from the cache [s].
        peak_memory_mib: largest resident memory of the process [MiB]; None where the system does not report it.
    """

    scene: str
    particle_count: int
    robot_particle_count: int
    precision: int
    substeps: int
    forward_mps: float
    forward_mps_min: float
    forward_mps_max: float
    both_mps: float | None
    backward_over_forward: float | None
    compile_cold_s: float
    compile_warm_s: float
    peak_memory_mib: float | None


def check_particle_count(count: int) -> None:
    """Refuse a number of particles out of range.

    Raises:
        UsageError: it is.
    """
    if not 50 <= count <= LARGEST_PARTICLE_COUNT:
        raise UsageError(f"{count} particles cannot be measured. Give 50 to {LARGEST_PARTICLE_COUNT:,}.")


def bench(
    scenes: Sequence[str],
    particles: Sequence[int],
    *,
    repeats: int = 5,
    on_case: Callable[[BenchCase], None] = lambda _: None,
    **settings: Any,
) -> list[BenchRow]:
    """Measure every scene at every particle count, one after the other.

    Args:
        scenes: names of environments; all if empty.
        particles: particle counts to come close to.
        on_case: called before each case, for progress.
        settings: further fields of `BenchCase`.

    Raises:
        UnknownNameError: a scene that is not registered.
        UsageError: a particle count or a number of repeats out of range.
        ZoobenchError: the measuring process failed.
    """
    scenes = scenes or registry.names(Kind.ENV)
    for scene in scenes:
        registry.get(Kind.ENV, scene)
    if repeats < 1:
        raise UsageError(f"{repeats} repeats measure nothing. Give at least 1.")
    for count in particles:
        check_particle_count(count)
    rows = []
    for scene in scenes:
        for count in particles:
            case = BenchCase(scene, count, repeats=repeats, **settings)
            on_case(case)
            with tempfile.TemporaryDirectory(prefix="zoobench-bench-") as cache:
                cold = _run_case(case, cache, only_compile=True)
                warm = _run_case(case, cache, only_compile=False)
            rows.append(BenchRow(**warm | {"compile_cold_s": cold["compile_warm_s"]}))
    return rows


def _run_case(case: BenchCase, cache: str, *, only_compile: bool) -> dict[str, Any]:
    job = json.dumps(asdict(case) | {"only_compile": only_compile})
    done = subprocess.run(
        [sys.executable, "-m", "zoobench.verify.bench.bench_case"],
        input=job,
        env=os.environ | {"ZOOBENCH_CACHE": cache, "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        last = done.stderr.strip().splitlines()[-1:] or ["no message"]
        raise ZoobenchError(f"Measuring {case.scene} with {case.particle_count} particles failed: {last[0]}")
    result: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return result
