"""Estimated times of runs: from finished runs in the database, else from measured rates of the simulator."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property
from heapq import heapreplace
from statistics import median
from typing import NamedTuple, Protocol

from zoobench import registry
from zoobench.db.many_rows import PastRun, PastTotal
from zoobench.registry import Kind
from zoobench.spec import FRAME_SECONDS, Ref, RunSpec


class Rate(Protocol):
    """The measured cost of a simulated second; None where it was not measured."""

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
    """The basis of an estimate."""

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
    """Estimates from finished runs, and where those say nothing from `rate` of an environment and a fidelity.

    `past` are the finished runs in the places of the runs to be estimated, `totals` gives the sums of all.
    """

    past: Sequence[PastRun] = ()
    rate: Callable[[Ref, Ref], Rate | None] = lambda _env, _fidelity: None
    totals: Callable[[], Sequence[PastTotal]] = tuple

    def __call__(self, spec: RunSpec) -> Estimate | None:
        """The expected wall time of a run; None if nothing in the database is comparable and no rate was measured.

        The median time of finished runs that differ by the seed only. Without any, for a budget in substeps: the
        amount times the median time per substep of runs with the same environment, design and fidelity, those of the
        same method before others. Else the work of the method by its settings at the measured rate, times `pace`.
        """
        if spec.budget.kind == "seconds":
            return Estimate(spec.budget.amount, Basis.STATED)
        if same_cell := self._by_cell.get(replace(spec, seed=0)):
            return Estimate(median(run.seconds for run in same_cell), Basis.SAME_CELL)
        same_place = self._by_place.get(_place(spec), [])
        if spec.budget.kind == "substeps" and same_place:
            same_method = [run for run in same_place if run.spec.method.name == spec.method.name]
            paces = [run.seconds / (run.forward + run.backward) for run in same_method or same_place]
            return Estimate(spec.budget.amount * median(paces), Basis.SAME_PLACE)
        seconds = self._by_rate(spec)
        return None if seconds is None else Estimate(seconds * self.pace, Basis.RATE)

    @cached_property
    def pace(self) -> float:
        """How many times the time by measured rates finished runs have taken, all together; 1 without any."""
        pairs = [(total.seconds, expected) for total in self.totals() if (expected := self._expected(total))]
        taken, by_rate = (sum(times) for times in zip(*pairs, strict=True)) if pairs else (1.0, 1.0)
        return taken / by_rate

    @cached_property
    def _by_cell(self) -> dict[RunSpec, list[PastRun]]:
        found: dict[RunSpec, list[PastRun]] = {}
        for run in self.past:
            found.setdefault(replace(run.spec, seed=0), []).append(run)
        return found

    @cached_property
    def _by_place(self) -> dict[tuple[object, ...], list[PastRun]]:
        found: dict[tuple[object, ...], list[PastRun]] = {}
        for run in self.past:
            if run.forward + run.backward:
                found.setdefault(_place(run.spec), []).append(run)
        return found

    def _expected(self, total: PastTotal) -> float | None:
        """The time of finished runs by the measured rate and their substeps [s]."""
        rate = self.rate(total.env, total.fidelity)
        if rate is None or rate.seconds is None or not rate.substeps:
            return None
        with_gradient = rate.gradient_seconds or 0.0
        return ((total.forward - total.backward) * rate.seconds + total.backward * with_gradient) / rate.substeps

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
    busy = [0.0] * min(jobs, max(len(estimates), 1))
    for seconds in estimates:
        if seconds is None:
            return None
        heapreplace(busy, busy[0] + seconds)
    return max(busy)


def basis_text(estimator: Estimator, estimates: Iterable[Estimate | None], origin: str) -> str:
    """The bases of estimates, in words: how many have each, and where measured rates come from.

    Args:
        origin: of the measured rates.
    """
    found = list(estimates)
    counts = {basis: sum(each is not None and each.basis is basis for each in found) for basis in Basis}
    words = [f"{count:,} by {basis}" for basis, count in counts.items() if count]
    if counts[Basis.RATE]:
        pace = estimator.pace
        here = f"times {pace:.2g}, as finished runs took here" if pace != 1.0 else "no finished run here corrects it"
        words[-1] += f" ({origin}; {here})"
    if unknown := found.count(None):
        words.append(f"{unknown:,} unknown")
    return ", ".join(words)


def _place(spec: RunSpec) -> tuple[object, ...]:
    return spec.env, spec.design, spec.fidelity
