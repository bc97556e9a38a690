"""Measurements of the accuracy study as plain values, read from a database's runs or from an exported file."""

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from zoobench import registry
from zoobench.db.query import Reader
from zoobench.db.rows import MetricRow, RunRow, RunState, StudyRow
from zoobench.errors import UsageError, reason
from zoobench.inputs import named_runs
from zoobench.registry import KINDS, Kind, short
from zoobench.spec import FRAME_SECONDS, Ref

ENERGY_STUDY = "accuracy-energy"
FORMAT = 3

RANDOM = "random"
"""Stands in the place of a level for controllers that were drawn and not trained."""

Numbers = dict[str, float]
"""A number of each gait, by training run and stage as `training@stage`; none of a gait that diverged."""


@dataclass(frozen=True)
class Sample:
    """The gaits of one cell at one fidelity, from a run of the method `probe`.

    Attributes:
        env, task, design, fidelity: references with version and every parameter.
        found: the level at which the gaits were trained, or `RANDOM`.
        frames: of an episode.
        scores: of the gaits [the task's unit].
        slopes: gradients of the loss, of some gaits.
        seconds, gradient_seconds: CPU time of an episode, and of one with its gradient, of some gaits [s].
        substeps: per simulated second of a forward episode, mean over the gaits.
        particles: of the scene.
        peak_memory: of the run's process [bytes], 0 if unknown.
    """

    env: Ref
    task: Ref
    design: Ref
    fidelity: Ref
    found: str
    frames: int
    scores: Numbers
    slopes: dict[str, list[float]]
    seconds: Numbers
    gradient_seconds: Numbers
    substeps: float
    particles: int
    peak_memory: int


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
        """Energy lost (gained, if negative) without a physical cause, as a share of the energy put in."""
        gone = self.muscles - self.stored - self.viscous - self.plastic - self.contact
        return gone / self.put_in if self.put_in else math.nan


@dataclass(frozen=True)
class Measurements:
    """The input of the analysis; `origin` names the commits and machines that it was measured with."""

    samples: tuple[Sample, ...]
    origin: tuple[str, ...] = ()
    balances: tuple[Balance, ...] = ()


def is_present(item: Sample | Balance) -> bool:
    """Whether everything was measured in the version that is registered now."""
    refs = {kind: getattr(item, axis) for axis, kind in KINDS.items() if hasattr(item, axis)}
    return all(
        ref.name in registry.names(kind) and registry.get(kind, ref.name).version == ref.version
        for kind, ref in refs.items()
    )


def grid_spacing(fidelity: Ref) -> float:
    """The grid spacing of a resolved fidelity [m]."""
    spacing: float = registry.create(Kind.FIDELITY, fidelity).grid_spacing
    return spacing


def from_reader(reader: Reader) -> Measurements:
    """The probes' runs and the stored energy balances of a database.

    Probes of former versions, and the costs that were once a study of their own, are left out.
    """
    samples, origin = [], set()
    present = registry.get(Kind.METHOD, "probe").version
    runs = reader.runs(states=[RunState.DONE])
    homes = {run.key: run.spec.fidelity for run in runs}
    for run in runs:
        if (run.spec.method.name, run.spec.method.version) == ("probe", present):
            attempts = reader.attempts(run.id)
            memory = max((attempt.peak_memory or 0 for attempt in attempts), default=0)
            found = [fidelity for key, fidelity in homes.items() if key.startswith(tuple(named_runs(run.spec.method)))]
            finals = {final.name: final.value for final in reader.finals(run.id)}
            home = found[0].name if found else RANDOM
            samples.append(_sample(run, reader.metrics(run.id), finals, home, memory))
            origin |= {_origin(attempt.provenance) for attempt in attempts if attempt.outcome is RunState.DONE}
    rows = (_balance(row.document) for study in reader.studies(ENERGY_STUDY) for row in study.rows)
    balances = {(row.env, row.fidelity): row for row in rows}  # of repeated ones the newest
    return Measurements(tuple(samples), tuple(sorted(origin)), tuple(balances.values()))


def stored(item: Balance) -> StudyRow:
    """A balance as the database keeps it."""
    return StudyRow(f"{item.env.name} {short(Kind.FIDELITY, item.fidelity)}", "measured", _document(item))


def write(measurements: Measurements, path: Path) -> None:
    """Export to a JSON file.

    Raises:
        UsageError: the file cannot be written.
    """
    document = {
        "format": FORMAT,
        "origin": list(measurements.origin),
        "samples": [rounded(_document(sample)) for sample in measurements.samples],
        "balances": [rounded(_document(balance)) for balance in measurements.balances],
    }
    lines = json.dumps(document, allow_nan=False).replace('{"env"', '\n{"env"')
    try:
        path.write_text(lines + "\n", encoding="utf-8")
    except OSError as error:
        raise UsageError(f"Cannot write {path}: {reason(error)}. Choose another place.") from None


def read(path: Path) -> Measurements:
    """The inverse of `write`.

    Raises:
        UsageError: the file cannot be read, or is not an export.
    """
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        if document["format"] != FORMAT:
            raise ValueError(f"format {document['format']} where {FORMAT} was expected")
        samples = tuple(Sample(**_with_refs(item)) for item in document["samples"])
        balances = tuple(_balance(item) for item in document["balances"])
        return Measurements(samples, tuple(document["origin"]), balances)
    except OSError as error:
        raise UsageError(f"Cannot read {path}: {reason(error)}.") from None
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError, UsageError) as error:
        raise UsageError(f"{path} holds no accuracy measurements ({error}). Give a file of --export.") from None


def rounded(value: Any, digits: int = 7) -> Any:
    """Data with so many digits of each number."""
    if isinstance(value, Mapping):
        return {key: rounded(item, digits) for key, item in value.items()}
    if isinstance(value, list):
        return [rounded(item, digits) for item in value]
    return float(f"{value:.{digits}g}") if isinstance(value, float) else value


def _sample(run: RunRow, metrics: Iterable[MetricRow], finals: Mapping[str, float], found: str, memory: int) -> Sample:
    spec = run.spec
    curves: dict[str, dict[int, float]] = {}
    for metric in metrics:
        curves.setdefault(metric.name, {})[metric.step] = metric.value
    trained = named_runs(spec.method)
    name = {
        step: f"{trained[int(number)] if trained else int(number)}@{int(curves['stage'][step])}"
        for step, number in curves["run"].items()
    }
    with_gradient = int(spec.method.kwargs["gradients"])
    seconds = curves["cpu_seconds"]
    slopes = {step: curves.get(f"slope_{step - 1}", {}) for step in name if step <= with_gradient}
    return Sample(
        env=spec.env,
        task=spec.task,
        design=spec.design,
        fidelity=spec.fidelity,
        found=found,
        frames=spec.frames,
        scores={name[step]: value for step, value in curves.get("score_current", {}).items()},
        slopes={name[step]: [curve[place] for place in sorted(curve)] for step, curve in slopes.items() if curve},
        seconds=_warm({name[step]: seconds[step] for step in sorted(seconds) if step > with_gradient}),
        gradient_seconds=_warm({name[step]: seconds[step] for step in sorted(seconds) if step <= with_gradient}),
        substeps=finals["forward_substeps"] / (finals["episodes"] * spec.frames * FRAME_SECONDS),
        particles=int(max(curves["particles"].values())),
        peak_memory=memory,
    )


def _warm(seconds: Numbers) -> Numbers:
    """Times of episodes but for the first, which also compiles, if there are others."""
    return dict(list(seconds.items())[1:]) or seconds


def _origin(provenance: Mapping[str, Any]) -> str:
    code, cpu = provenance.get("code", {}), provenance.get("cpu", {})
    state = " with changes" if code.get("dirty") else ""
    return f"commit {str(code.get('commit') or 'unknown')[:12]}{state}, {cpu.get('model') or 'unknown processor'}"


def _document(item: Sample | Balance) -> dict[str, Any]:
    return {name: str(value) if isinstance(value, Ref) else value for name, value in vars(item).items()}


def _with_refs(item: Mapping[str, Any]) -> dict[str, Any]:
    refs = ("env", "task", "design", "fidelity")
    return {name: Ref.parse(value) if name in refs else value for name, value in item.items()}


def _balance(document: Mapping[str, Any]) -> Balance:
    """The inverse of `stored`."""
    return Balance(**_with_refs(document))
