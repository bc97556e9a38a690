"""Measurements of the accuracy study as plain values, read from a database's runs or from an exported file."""

import json
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from zoobench import registry
from zoobench.arrays import Array
from zoobench.db.query import Reader
from zoobench.db.rows import FinalRow, MetricRow, RunRow, RunState, StudyRow
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.spec import FRAME_SECONDS, Ref

COST_STUDY = "accuracy-cost"
ENERGY_STUDY = "accuracy-energy"
FORMAT = 2


@dataclass(frozen=True)
class Sample:
    """Scores and trajectories of one environment at one fidelity, from a run of the method `probe`.

    Attributes:
        env, fidelity: references with version and every parameter.
        task: of which `slopes` are the gradients; the first of `scores`.
        frames: of an episode.
        scores: by task, of the draws in order [the task's unit]; NaN where the simulation diverged.
        slopes: `[close, parameters]` gradients of the loss; `close` is 0 where no trajectories were recorded.
        paths: `[close, points, 3]` centres of mass [m].
        spreads: `[close, points, 6]` gyration tensors [m^2].
        seconds_between: time between two points of a path [s].
        substeps: per simulated second of a forward episode, mean over the draws; NaN for a run with gradients.
        peak_memory: of the run's process [bytes], 0 if unknown.
    """

    env: Ref
    fidelity: Ref
    task: str
    frames: int
    scores: dict[str, list[float]]
    slopes: Array
    paths: Array
    spreads: Array
    seconds_between: float
    substeps: float
    peak_memory: int

    @property
    def is_close(self) -> bool:
        """Whether trajectories and gradients were recorded, rather than many scores."""
        return bool(len(self.paths))


@dataclass(frozen=True)
class FidelityCost:
    """Time per particle and substep of one environment at one fidelity on one machine.

    Attributes:
        particles: of the scene.
        forward, forward_least, forward_most: wall time per particle and substep, median, smallest and largest of the
            interleaved repeats [ns].
        gradient, gradient_least, gradient_most: likewise of an episode with its gradient, per forward substep [ns].
        compile_seconds: duration of the first call beyond the second [s].
    """

    env: Ref
    fidelity: Ref
    particles: int
    forward: float
    forward_least: float
    forward_most: float
    gradient: float
    gradient_least: float
    gradient_most: float
    compile_seconds: float


@dataclass(frozen=True)
class Balance:
    """The energy balance of one short episode.

    Attributes:
        put_in: work of the muscles, of each in each control frame where it is positive [J].
        muscles: all their work [J].
        stored: growth of kinetic, elastic and potential energy of all matter [J].
        viscous, plastic, contact: energy lost to viscosity, to yield, and to ground and walls [J].
    """

    env: Ref
    fidelity: Ref
    put_in: float
    muscles: float
    stored: float
    viscous: float
    plastic: float
    contact: float

    @property
    def unexplained(self) -> float:
        """Energy lost (gained, if negative) without a physical cause, as a share of what was put in."""
        gone = self.muscles - self.stored - self.viscous - self.plastic - self.contact
        return gone / self.put_in if self.put_in else math.nan


@dataclass(frozen=True)
class Measurements:
    """The input of the analysis; `origin` names the commits and machines that it was measured with."""

    samples: tuple[Sample, ...]
    costs: tuple[FidelityCost, ...]
    origin: tuple[str, ...] = ()
    balances: tuple[Balance, ...] = ()


M = TypeVar("M", FidelityCost, Balance)


def label(kind: Kind, ref: Ref) -> str:
    """A component's name with those parameters that are not the default ones."""
    defaults = registry.get(kind, ref.name, ref.version).defaults
    return str(Ref(ref.name, 0, tuple((key, value) for key, value in ref.params if defaults.get(key) != value)))


def variant_of(sample: Sample) -> str:
    """The variant of an environment: the fidelity's label, and the environment's if its parameters differ."""
    env, fidelity = label(Kind.ENV, sample.env), label(Kind.FIDELITY, sample.fidelity)
    return fidelity if env == sample.env.name else f"{fidelity} {env}"


def grid_spacing(fidelity: Ref) -> float:
    """The grid spacing of a resolved fidelity [m]."""
    spacing: float = registry.create(Kind.FIDELITY, fidelity).grid_spacing
    return spacing


def from_reader(reader: Reader) -> Measurements:
    """The probes' runs and the stored costs and energy balances of a database."""
    samples, origin = [], set()
    for run in reader.runs(states=[RunState.DONE]):
        if run.spec.method.name == "probe":
            attempts = reader.attempts(run.id)
            memory = max((attempt.peak_memory or 0 for attempt in attempts), default=0)
            samples.append(_sample(run, reader.metrics(run.id), reader.finals(run.id), memory))
            origin |= {_origin(attempt.provenance) for attempt in attempts if attempt.outcome is RunState.DONE}
    costs, balances = _newest(FidelityCost, reader, COST_STUDY), _newest(Balance, reader, ENERGY_STUDY)
    return Measurements(tuple(samples), costs, tuple(sorted(origin)), balances)


def _newest(kind: type[M], reader: Reader, study: str) -> tuple[M, ...]:
    """Stored costs or balances; of repeated ones the newest."""
    rows = (_from_document(kind, row.document) for found in reader.studies(study) for row in found.rows)
    return tuple({(row.env, row.fidelity): row for row in rows}.values())


def stored(item: FidelityCost | Balance) -> StudyRow:
    """A cost or a balance as the database keeps it."""
    return StudyRow(f"{item.env.name} {label(Kind.FIDELITY, item.fidelity)}", "measured", _document(item))


def write(measurements: Measurements, path: Path) -> None:
    """Export to a JSON file.

    Raises:
        UsageError: the file cannot be written.
    """
    document = {
        "format": FORMAT,
        "origin": list(measurements.origin),
        "samples": [_plain(_document(sample)) for sample in measurements.samples],
        "costs": [_plain(_document(cost)) for cost in measurements.costs],
        "balances": [_plain(_document(balance)) for balance in measurements.balances],
    }
    lines = json.dumps(document, allow_nan=False).replace('{"env"', '\n{"env"')
    try:
        path.write_text(lines + "\n", encoding="utf-8")
    except OSError as error:
        raise UsageError(f"Cannot write {path}: {error.strerror}. Choose another place.") from None


def read(path: Path) -> Measurements:
    """The inverse of `write`.

    Raises:
        UsageError: the file cannot be read, or is not an export.
    """
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        if document["format"] != FORMAT:
            raise ValueError(f"format {document['format']} where {FORMAT} was expected")
        samples = tuple(_sample_from(item) for item in document["samples"])
        costs = tuple(_from_document(FidelityCost, item) for item in document["costs"])
        balances = tuple(_from_document(Balance, item) for item in document["balances"])
        return Measurements(samples, costs, tuple(document["origin"]), balances)
    except OSError as error:
        raise UsageError(f"Cannot read {path}: {error.strerror}.") from None
    except (ValueError, LookupError, TypeError, AttributeError, UsageError) as error:
        raise UsageError(f"{path} holds no accuracy measurements ({error}). Give a file of --export.") from None


def _sample(run: RunRow, metrics: Iterable[MetricRow], finals: Iterable[FinalRow], memory: int) -> Sample:
    spec = run.spec
    curves: dict[str, dict[int, float]] = {}
    for metric in metrics:
        curves.setdefault(metric.name, {})[metric.step] = metric.value
    totals = {final.name: final.value for final in finals}
    count = int(totals["episodes"])
    also = [name for name in str(spec.method.kwargs["also"]).split("+") if name]
    names = {spec.task.name: "score_current"} | {name: f"score_{name}" for name in also}
    scores = {
        task: [curves.get(name, {}).get(draw, math.nan) for draw in range(1, count + 1)] for task, name in names.items()
    }
    close = [draw for draw in range(int(spec.method.kwargs["gradients"])) if f"path_x_{draw}" in curves]
    steps = sorted(curves[f"path_x_{close[0]}"]) if close else [0, 1]
    pairs = ("xx", "yy", "zz", "yz", "xz", "xy")
    return Sample(
        env=spec.env,
        fidelity=spec.fidelity,
        task=spec.task.name,
        frames=spec.frames,
        scores=scores,
        slopes=np.array([_values(curves.get(f"slope_{draw}", {})) for draw in close]),
        paths=np.array([np.stack([_values(curves[f"path_{axis}_{draw}"]) for axis in "xyz"], 1) for draw in close]),
        spreads=np.array([np.stack([_values(curves[f"spread_{pair}_{draw}"]) for pair in pairs], 1) for draw in close]),
        seconds_between=(steps[1] - steps[0]) * FRAME_SECONDS,
        substeps=totals["forward_substeps"] / (count * spec.frames * FRAME_SECONDS),
        peak_memory=memory,
    )


def _values(curve: Mapping[int, float]) -> Array:
    return np.array([curve[step] for step in sorted(curve)])


def _origin(provenance: Mapping[str, Any]) -> str:
    code, cpu = provenance.get("code", {}), provenance.get("cpu", {})
    state = " with changes" if code.get("dirty") else ""
    return f"commit {str(code.get('commit') or 'unknown')[:12]}{state}, {cpu.get('model') or 'unknown processor'}"


def _document(item: Sample | FidelityCost | Balance) -> dict[str, Any]:
    return asdict(item) | {"env": str(item.env), "fidelity": str(item.fidelity)}


def _plain(value: Any) -> Any:
    """Data that JSON can hold: arrays as lists, numbers with seven digits, NaN as null."""
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float):
        return float(f"{value:.7g}") if math.isfinite(value) else None
    return value


def _sample_from(item: Mapping[str, Any]) -> Sample:
    scores = {task: [math.nan if v is None else v for v in values] for task, values in item["scores"].items()}
    arrays = {name: np.array(item[name], float) for name in ("slopes", "paths", "spreads")}
    refs = {name: Ref.parse(item[name]) for name in ("env", "fidelity")}
    return Sample(**{**item, **arrays, **refs, "scores": scores})


def _from_document(kind: type[M], item: Mapping[str, Any]) -> M:
    """The inverse of `stored` and of `_plain`."""
    readers: dict[str, Callable[[Any], Any]] = {"env": Ref.parse, "fidelity": Ref.parse, "particles": int}
    values: dict[str, Any] = {
        name: math.nan if value is None else readers.get(name, float)(value) for name, value in item.items()
    }
    return kind(**values)
