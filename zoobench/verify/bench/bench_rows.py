"""The results of `bench` as rows, and the JSON document that holds them with the machine they were measured on."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from types import NoneType
from typing import Any, TypeVar, get_args

from zoobench.errors import UsageError


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


Row = TypeVar("Row")


@dataclass(frozen=True)
class BenchResults:
    """Everything that one `zoobench bench` has measured.

    Attributes:
        machine: where and with what, as plain JSON data.
    """

    machine: Mapping[str, Any] = field(default_factory=dict)
    rates: Sequence[RateRow] = ()
    costs: Sequence[CostRow] = ()
    runs: Sequence[RunShare] = ()

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON data."""
        rows = {name: [asdict(row) for row in getattr(self, name)] for name in _KINDS}
        return {"machine": dict(self.machine), **rows}

    @classmethod
    def from_dict(cls, data: Any) -> "BenchResults":
        """The inverse of `to_dict`; what else the data holds is left out.

        Raises:
            ValueError: they are something else.
        """
        if not isinstance(data, dict) or not isinstance(data.get("machine"), dict):
            raise ValueError("no object with a `machine`")
        return cls(data["machine"], **{name: _rows(kind, data.get(name, [])) for name, kind in _KINDS.items()})


_KINDS: dict[str, type[Any]] = {"rates": RateRow, "costs": CostRow, "runs": RunShare}


def read(path: Path) -> BenchResults:
    """The results in a file that `zoobench bench` has written, with --output or as JSON.

    Raises:
        UsageError: the file cannot be read, or is something else.
    """
    try:
        return BenchResults.from_dict(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, RecursionError) as error:
        raise UsageError(
            f"{str(path)!r} holds no results of bench: {error}. Write them with `zoobench bench --output FILE`."
        ) from error


def joined(parts: Sequence[BenchResults]) -> BenchResults:
    """The rows of all parts, which were measured on one machine: that of the first."""
    return BenchResults(
        parts[0].machine, **{name: [row for part in parts for row in getattr(part, name)] for name in _KINDS}
    )


def _rows(kind: type[Row], records: Any) -> tuple[Row, ...]:
    if not isinstance(records, list):
        raise ValueError(f"{records!r} is no list of {kind.__name__}")
    return tuple(_row(kind, record) for record in records)


def _row(kind: type[Row], record: Any) -> Row:
    """One row from its JSON object.

    Raises:
        ValueError: a field is missing or of another type.
    """
    if not isinstance(record, dict):
        raise ValueError(f"{record!r} is no row of {kind.__name__}")
    values = {}
    for item in fields(kind):  # type: ignore[arg-type]  # Row is bound to no protocol: every row is a dataclass
        if item.name not in record:
            raise ValueError(f"a row of {kind.__name__} has no {item.name}")
        value = record[item.name]
        allowed = get_args(item.type) or (item.type,)
        is_whole = isinstance(value, int) and float in allowed
        if isinstance(value, bool) or not (is_whole or isinstance(value, allowed)):
            raise ValueError(f"{item.name} is {value!r}, where {_named(allowed)} belongs")
        values[item.name] = value
    return kind(**values)


def _named(kinds: Sequence[type]) -> str:
    names = {str: "text", int: "a whole number", float: "a number", NoneType: "null"}
    return " or ".join(names[kind] for kind in kinds)
