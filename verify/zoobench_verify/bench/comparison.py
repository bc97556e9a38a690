"""What follows from the results of `bench`: growth with the number of particles, and ratios to an earlier run."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from zoobench_verify.bench.bench_rows import BenchResults, CostRow, RateRow


@dataclass(frozen=True)
class GrowthRow:
    """How the time of a substep grows with the number of particles.

    Attributes:
        direction: `forward`, or `both` for forward and backward.
        fewest, most: particles of all worlds together.
        exponent: slope of the logarithm of a substep's seconds by that of the particles; 1 is linear.
    """

    scene: str
    worlds: int
    precision: int
    device: str
    direction: str
    fewest: int
    most: int
    exponent: float


@dataclass(frozen=True)
class RatioRow:
    """One case's results by those of an earlier run, new over old.

    Attributes:
        forward, reverse, both: of the rates; above 1 is faster.
        forward_calibrated, reverse_calibrated, both_calibrated: likewise, each rate by that of the C++ reference on its
            machine; None where one of them has none.
        advance_launch, reverse_launch, compile_cold, compile_cached, peak_memory: of costs; below 1 is cheaper.
    """

    scene: str
    asked: int
    worlds: int
    precision: int
    device: str
    forward: float | None
    reverse: float | None
    both: float | None
    forward_calibrated: float | None
    reverse_calibrated: float | None
    both_calibrated: float | None
    advance_launch: float | None = None
    reverse_launch: float | None = None
    compile_cold: float | None = None
    compile_cached: float | None = None
    peak_memory: float | None = None


@dataclass(frozen=True)
class RunRatioRow:
    """A run's processor and wall time by those of an earlier one, new over old, and its share of kernels in both."""

    command: str
    cpu: float | None
    wall: float | None
    kernel_share_old: float
    kernel_share_new: float


Case = tuple[str, int, int, str, int]
"""Scene, worlds, precision, device and particles asked for: what makes two rows those of one case."""


def case_of(row: RateRow | CostRow) -> Case:
    """The case of a row."""
    return (row.scene, row.worlds, row.precision, row.device, row.asked)


def growth(rows: Sequence[RateRow]) -> list[GrowthRow]:
    """Exponents of every scene that was measured at two numbers of particles or more."""
    found = []
    for (scene, worlds, precision, device), group in groupby(sorted(rows, key=case_of), lambda row: case_of(row)[:4]):
        sizes = {row.particle_count: row for row in group}
        for direction in ("forward", "both"):
            rates = {count: getattr(row, f"{direction}_mps") for count, row in sizes.items()}
            counts = [count for count, rate in rates.items() if rate]
            if len(counts) > 1:
                slope = exponent(counts, [count / rates[count] for count in counts])
                ends = (min(counts) * worlds, max(counts) * worlds)
                found.append(GrowthRow(scene, worlds, precision, device, direction, *ends, slope))
    return found


def exponent(sizes: Sequence[float], seconds: Sequence[float]) -> float:
    """The slope of log seconds by log size, by least squares."""
    return float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])


def ratios(new: BenchResults, old: BenchResults) -> list[RatioRow]:
    """New results by old ones of the same cases; cases that are not in both are left out."""
    rates = {case_of(row): row for row in old.rates}
    costs, new_costs = ({case_of(row): row for row in results.costs} for results in (old, new))
    return [
        _ratio_row(row, rates[case_of(row)], new_costs.get(case_of(row)), costs.get(case_of(row)))
        for row in new.rates
        if case_of(row) in rates
    ]


def run_ratios(new: BenchResults, old: BenchResults) -> Iterator[RunRatioRow]:
    """New runs by old ones of the same command."""
    known = {run.command: run for run in old.runs}
    for run in new.runs:
        if before := known.get(run.command):
            yield RunRatioRow(
                run.command, _by(run.cpu_s, before.cpu_s), _by(run.wall_s, before.wall_s), before.kernel_share,
                run.kernel_share,
            )  # fmt: skip


def _ratio_row(new: RateRow, old: RateRow, new_cost: CostRow | None, old_cost: CostRow | None) -> RatioRow:
    plain = {name: _by(getattr(new, f"{name}_mps"), getattr(old, f"{name}_mps")) for name in _RATES}
    machine = _by(new.reference_mps, old.reference_mps)
    calibrated = {f"{name}_calibrated": _by(ratio, machine) for name, ratio in plain.items()}
    costs = {}
    if new_cost is not None and old_cost is not None:
        costs = {name: _by(getattr(new_cost, item), getattr(old_cost, item)) for name, item in _COSTS.items()}
    return RatioRow(new.scene, new.asked, new.worlds, new.precision, new.device, **plain, **calibrated, **costs)


_RATES = ("forward", "reverse", "both")
_COSTS = {
    "advance_launch": "advance_launch_us",
    "reverse_launch": "reverse_launch_us",
    "compile_cold": "compile_cold_s",
    "compile_cached": "compile_cached_s",
    "peak_memory": "peak_memory_mib",
}


def _by(new: float | None, old: float | None) -> float | None:
    """Their ratio, None where it does not exist."""
    return new / old if new is not None and old else None
