"""The results of `bench` as rows, and the JSON document that holds them with the machine they were measured on."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from zoobench.errors import UsageError, reason


@dataclass(frozen=True)
class RateRow:
    """The speed of one case: medians over the repeats, with the least and the largest.

    Rates are million particle-substeps per second of processor time; of wall time on CUDA, whose work is not done by
    the processor.

    Attributes:
        asked: particles that were asked for; `particle_count` came closest, robot and medium of one world.
        frames, substeps: of one measured episode, those of all worlds together.
        forward_mps: of an episode without gradients.
        reverse_mps: of the backward pass's launches alone, without what it simulates again.
        both_mps: of an episode with gradients and its backward pass.
        backward_over_forward: time of a backward pass by that of its forward pass.
        recomputed: substeps that the backward pass simulated again, by those of the episode.
        forward_cpu_s, forward_wall_s: of an episode without gradients [s].
        both_cpu_s, both_wall_s: of one with gradients and its backward pass [s].
        reference_mps: rate of the C++ reference, measured in turn with the episodes; None without a compiler.
    """

    scene: str
    asked: int
    particle_count: int
    robot_particle_count: int
    worlds: int
    precision: int
    device: str
    frames: int
    substeps: int
    forward_mps: float
    forward_mps_min: float
    forward_mps_max: float
    reverse_mps: float | None
    reverse_mps_min: float | None
    reverse_mps_max: float | None
    both_mps: float | None
    both_mps_min: float | None
    both_mps_max: float | None
    backward_over_forward: float | None
    recomputed: float | None
    forward_cpu_s: float
    forward_wall_s: float
    both_cpu_s: float | None
    both_wall_s: float | None
    reference_mps: float | None


@dataclass(frozen=True)
class CostRow:
    """What one case costs beside its substeps, in processor time (on CUDA wall time).

    Attributes:
        advance_launch_us, reverse_launch_us: of a launch of no substeps [us].
        advance_cold_s, reverse_cold_s, compile_cold_s: to compile these kernels, and all, with an empty cache [s].
        advance_cached_s, reverse_cached_s, compile_cached_s: to load them from the cache [s].
        peak_memory_mib: largest resident memory of the process [MiB]; None where the system does not tell it.
    """

    scene: str
    asked: int
    particle_count: int
    worlds: int
    precision: int
    device: str
    advance_launch_us: float
    reverse_launch_us: float | None
    advance_cold_s: float
    reverse_cold_s: float | None
    compile_cold_s: float
    advance_cached_s: float
    reverse_cached_s: float | None
    compile_cached_s: float
    peak_memory_mib: float | None


@dataclass(frozen=True)
class RunShare:
    """Where the processor time of `zoobench run` goes: of all its processes together [s].

    Attributes:
        command: the options of the run.
        processes: that have simulated.
        cpu_s, wall_s: of the command, from its start to its end.
        advance_s, reverse_s, survey_s: inside these kernels.
        launching_s: cost of the launches themselves; that of surveys is not known apart and is in `survey_s`.
        loading_s: loading kernels from the cache, or compiling them.
        rest_s: everything else.
        kernel_share: of advance and reverse in `cpu_s`.
    """

    command: str
    processes: int
    cpu_s: float
    wall_s: float
    advance_s: float
    reverse_s: float
    survey_s: float
    launching_s: float
    loading_s: float
    rest_s: float
    kernel_share: float


@dataclass(frozen=True)
class BenchResults:
    """Everything that one `zoobench verify bench` has measured.

    Attributes:
        machine: where and with what, as plain JSON data.
    """

    machine: Mapping[str, Any]
    rates: tuple[RateRow, ...] = ()
    costs: tuple[CostRow, ...] = ()
    runs: tuple[RunShare, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON data."""
        return asdict(self)


def read(path: Path) -> BenchResults:
    """The results in a file that `bench` has written, with --output or as JSON; what else it holds is ignored.

    Raises:
        UsageError: the file cannot be read, or is something else.
    """
    try:
        return TypeAdapter(BenchResults).validate_json(path.read_bytes(), strict=True)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        fault = f"{'.'.join(map(str, first['loc'])) or 'content'}: {first['msg']}"
    except OSError as error:
        fault = reason(error)
    raise UsageError(
        f"{str(path)!r} holds no results of bench: {fault}. Write them with `zoobench verify bench --output FILE`."
    )


def joined(parts: Sequence[BenchResults]) -> BenchResults:
    """The rows of all parts, which were measured on one machine: that of the first."""
    rows = {name: tuple(row for part in parts for row in getattr(part, name)) for name in ("rates", "costs", "runs")}
    return BenchResults(parts[0].machine, **rows)
