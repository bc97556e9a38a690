"""Estimated times of runs: from finished runs in the database, else from measured rates of the simulator."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from statistics import median
from typing import NamedTuple, Protocol

from zoobench import registry
from zoobench.db.rows import RunState
from zoobench.registry import Kind
from zoobench.report.run_results import RunResult
from zoobench.spec import FRAME_SECONDS, Ref, RunSpec

_SUBSTEPS = ("forward_substeps", "backward_substeps")


class Rate(Protocol):
    """What a simulated second costs, as it was measured; None where it was not."""

    @property
    def substeps(self) -> float | None:
        """Forward substeps."""

    @property
    def seconds(self) -> float | None:
        """Wall time [s]."""

    @property
    def gradient_seconds(self) -> float | None:
        """Wall time with the gradient [s]."""


class Basis(StrEnum):
    """What an estimate rests on."""

    STATED = "its budget"
    SAME_CELL = "runs of the same cell"
    SAME_PLACE = "runs in the same place"
    RATE = "measured rates"


class Estimate(NamedTuple):
    """An expected wall time of a run on one core [s]."""

    seconds: float
    basis: Basis


@dataclass(frozen=True)
class Estimator:
    """Estimates from finished runs, and where those say nothing from `rate` of an environment and a fidelity."""

    past: Sequence[RunResult]
    rate: Callable[[Ref, Ref], Rate | None] = lambda _env, _fidelity: None

    def __call__(self, spec: RunSpec) -> Estimate | None:
        """The expected wall time of a run; None if nothing in the database is comparable and no rate was measured.

        The median time of finished runs that differ by the seed only. Without any, for a budget in substeps: the
        amount times the median time per substep of runs with the same environment, design and fidelity, those of the
        same method before others. Else the work of the method by its settings at the measured rate, times `pace`.
        """
        if spec.budget.kind == "seconds":
            return Estimate(spec.budget.amount, Basis.STATED)
        if same_cell := self._seconds_of_cell.get(spec.cell()):
            return Estimate(median(same_cell), Basis.SAME_CELL)
        alike = self._by_place.get(_place(spec), [])
        if spec.budget.kind == "substeps" and alike:
            same_method = [result for result in alike if result.run.spec.method.name == spec.method.name]
            paces = [result.run.seconds / _substeps(result) for result in same_method or alike]
            return Estimate(spec.budget.amount * median(paces), Basis.SAME_PLACE)
        seconds = self._by_rate(spec)
        return None if seconds is None else Estimate(seconds * self.pace, Basis.RATE)

    @cached_property
    def pace(self) -> float:
        """How many times the time by measured rates finished runs have taken, all together; 1 without any."""
        pairs = [(result.run.seconds, expected) for result in self._done if (expected := self._expected(result))]
        taken, by_rate = (sum(times) for times in zip(*pairs, strict=True)) if pairs else (1.0, 1.0)
        return taken / by_rate

    @cached_property
    def _done(self) -> list[RunResult]:
        return [result for result in self.past if result.run.state is RunState.DONE and result.run.seconds > 0]

    @cached_property
    def _seconds_of_cell(self) -> dict[tuple[str, ...], list[float]]:
        found: dict[tuple[str, ...], list[float]] = {}
        for result in self._done:
            found.setdefault(result.run.spec.cell(), []).append(result.run.seconds)
        return found

    @cached_property
    def _by_place(self) -> dict[tuple[object, ...], list[RunResult]]:
        found: dict[tuple[object, ...], list[RunResult]] = {}
        for result in self._done:
            if _substeps(result):
                found.setdefault(_place(result.run.spec), []).append(result)
        return found

    def _expected(self, result: RunResult) -> float | None:
        """The time of a finished run by the measured rate and its substeps [s]."""
        rate = self.rate(result.run.spec.env, result.run.spec.fidelity)
        if rate is None or rate.seconds is None or not rate.substeps:
            return None
        forward, backward = (result.finals[name].value if name in result.finals else 0.0 for name in _SUBSTEPS)
        with_gradient = rate.gradient_seconds or 0.0
        return ((forward - backward) * rate.seconds + backward * with_gradient) / rate.substeps

    def _by_rate(self, spec: RunSpec) -> float | None:
        """The time of a run by its method's settings, its budget and the measured rate [s]."""
        rate = self.rate(spec.env, spec.fidelity)
        method = registry.create(Kind.METHOD, spec.method)
        if rate is None or not hasattr(method, "work"):
            return None
        work = method.work(spec.frames)
        costs = ((work.frames, rate.seconds), (work.gradient_frames, rate.gradient_seconds))
        if any(frames and cost is None for frames, cost in costs) or spec.budget.kind == "episodes":
            return None
        an_iteration = FRAME_SECONDS * sum(frames * cost for frames, cost in costs if cost is not None)
        limits = [an_iteration * work.iterations] if work.iterations else []
        if spec.budget.kind == "iterations":
            limits.append(an_iteration * spec.budget.amount)
        elif rate.substeps:
            # a gradient is simulated forward and in reverse
            substeps = rate.substeps * FRAME_SECONDS * (work.frames + 2 * work.gradient_frames)
            limits.append(an_iteration * spec.budget.amount / substeps)
        return min(limits, default=None)


def total_seconds(estimates: Sequence[float | None], jobs: int) -> float | None:
    """Wall time [s] of all runs on this many workers that each take the next one; None if one is unknown."""
    busy = [0.0] * jobs
    for seconds in estimates:
        if seconds is None:
            return None
        busy[busy.index(min(busy))] += seconds
    return max(busy)


def basis_text(estimates: Iterable[Estimate | None], pace: float, origin: str) -> str:
    """What estimates rest on, in words: how many on what, and of measured rates where they come from.

    Args:
        pace: of the estimator.
        origin: of the measured rates.
    """
    found = list(estimates)
    counts = {basis: sum(each is not None and each.basis is basis for each in found) for basis in Basis}
    words = [f"{count:,} by {basis}" for basis, count in counts.items() if count]
    if counts[Basis.RATE]:
        here = f"times {pace:.2g}, as finished runs took here" if pace != 1.0 else "no finished run here corrects it"
        words[-1] += f" ({origin}; {here})"
    if unknown := found.count(None):
        words.append(f"{unknown:,} unknown")
    return ", ".join(words)


def _place(spec: RunSpec) -> tuple[object, ...]:
    return spec.env, spec.design, spec.fidelity


def _substeps(result: RunResult) -> float:
    return sum(result.finals[name].value for name in _SUBSTEPS if name in result.finals)
