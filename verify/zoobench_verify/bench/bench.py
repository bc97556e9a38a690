"""`zoobench verify bench`: speed, compile time and memory of the simulator on this machine.

Every case is measured in two processes of its own, with an empty kernel cache for the cold compile time and with the
filled one for everything else, so that the peak memory is that of the case alone.
"""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from zoobench import registry
from zoobench.errors import UsageError, ZoobenchError
from zoobench.registry import Kind
from zoobench_verify.bench.bench_rows import CostRow, RateRow

LARGEST_PARTICLE_COUNT = 2_000_000


@dataclass(frozen=True)
class BenchCase:
    """The caterpillar in an environment, at the grid spacing that gives about this many particles.

    Attributes:
        asked: particles of one world to come close to.
        precision: 32 or 64 bits.
        gradients: measure the backward pass too.
        repeats: measured episodes, of which the median is given.
        frames: of an episode; 0 to choose as many as are needed to measure well.
        worlds: side by side.
        device: `cpu` or `cuda`.
        reference: the program of the C++ reference; empty to leave it out.
    """

    scene: str
    asked: int
    precision: int = 32
    gradients: bool = True
    repeats: int = 5
    frames: int = 0
    worlds: int = 1
    device: str = "cpu"
    reference: str = ""


def check_particle_count(count: int) -> None:
    """Refuse a number of particles out of range.

    Raises:
        UsageError: it is.
    """
    if not 50 <= count <= LARGEST_PARTICLE_COUNT:
        raise UsageError(f"{count} particles cannot be measured. Give 50 to {LARGEST_PARTICLE_COUNT:,}.")


def cases(
    scenes: Sequence[str], particles: Sequence[int], *, reference: Path | None = None, **settings: Any
) -> list[BenchCase]:
    """Every scene at every particle count.

    Args:
        scenes: names of environments; all if empty.
        particles: particle counts to come close to.
        settings: further fields of `BenchCase`.

    Raises:
        UnknownNameError: a scene that is not registered.
        UsageError: a number out of range.
    """
    scenes = scenes or registry.names(Kind.ENV)
    for scene in scenes:
        registry.get(Kind.ENV, scene)
    for count in particles:
        check_particle_count(count)
    program = str(reference or "")
    found = [BenchCase(scene, count, reference=program, **settings) for scene in scenes for count in particles]
    if found and (found[0].repeats < 1 or found[0].worlds < 1):
        raise UsageError(f"{found[0].repeats} repeats in {found[0].worlds} worlds measure nothing. Give at least 1.")
    return found


def bench(
    wanted: Iterable[BenchCase], on_case: Callable[[BenchCase], None] = lambda _: None
) -> Iterator[tuple[RateRow, CostRow]]:
    """Measure cases one after the other.

    Args:
        on_case: called before each case, for progress.

    Raises:
        ZoobenchError: the measuring process failed.
    """
    for case in wanted:
        on_case(case)
        with tempfile.TemporaryDirectory(prefix="zoobench-bench-") as cache:
            cold = _run_case(case, cache, only_compile=True)
            measured = _run_case(case, cache, only_compile=False)
        yield RateRow(**_of_case(RateRow, case) | measured["rate"]), _costs(case, cold, measured)  # frames as measured


def _of_case(kind: type[Any], case: BenchCase) -> dict[str, Any]:
    """The fields of a row that say which case it is."""
    names = {item.name for item in fields(kind)}
    return {name: value for name, value in asdict(case).items() if name in names}


def _costs(case: BenchCase, cold: dict[str, Any], measured: dict[str, Any]) -> CostRow:
    launch = {name: None if seconds is None else seconds * 1e6 for name, seconds in measured["launch"].items()}
    values: dict[str, Any] = {f"{name}_launch_us": micro for name, micro in launch.items()}
    values |= {f"{name}_cold_s": seconds for name, seconds in cold["compile"].items()}
    values |= {f"{name}_cached_s": seconds for name, seconds in measured["compile"].items()}
    values |= {name: measured[name] for name in ("particle_count", "peak_memory_mib")}
    return CostRow(**_of_case(CostRow, case), **values)


def _run_case(case: BenchCase, cache: str, *, only_compile: bool) -> dict[str, Any]:
    job = json.dumps(asdict(case) | {"only_compile": only_compile})
    done = subprocess.run(
        [sys.executable, "-m", "zoobench_verify.bench.bench_case"],
        input=job,
        env=os.environ | {"ZOOBENCH_CACHE": cache, "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        last = done.stderr.strip().splitlines()[-1:] or ["no message"]
        raise ZoobenchError(f"Measuring {case.scene} with {case.asked} particles failed: {last[0]}")
    result: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return result
