"""Listings of runs: what `results`, `status` and `plan` print, and the card of one run."""

import math
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from zoobench.db.rows import AttemptRow, RunRow, RunState
from zoobench.report.labels import labels
from zoobench.report.leaderboard import BoardRow
from zoobench.report.listing import Listing
from zoobench.report.provisional import footnotes, marked
from zoobench.report.run_results import RunResult
from zoobench.spec import AXES, WALL_GAP, Ref, RunSpec, is_at_wall, repeat_command

_SHORT_AXES = ("env", "task", "design", "method", "fidelity")
_TELLING = ("controller", "frames", "budget")
"""Settings that are columns only where they differ."""


_MANY_HOURS = 100


def duration(seconds: float | None) -> str:
    """A time span [s] as a person says it: `42 s`, `3 min 05 s`, `2 h 10 min`, `1,350 days`; `unknown` for None."""
    if seconds is None:
        return "unknown"
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    if whole < _MANY_HOURS * 3600:
        return f"{whole // 3600} h {whole % 3600 // 60:02d} min"
    return f"{whole / 86400:,.0f} days" if whole >= 10 * 86400 else f"{whole / 86400:.1f} days"


def results_overview(results: Sequence[RunResult]) -> Listing:
    """One row per run with its score, for reading; with a controller, frames and budget where runs differ in it."""
    specs = [result.run.spec for result in results]
    names = _short_names(specs)
    telling = [name for name in _TELLING if len({getattr(spec, name) for spec in specs}) > 1]
    controllers = labels(spec.controller for spec in specs)
    rows = [
        (
            result.run.id,
            *names[index],
            *(str(controllers.get(value, value)) for value in (getattr(specs[index], name) for name in telling)),
            result.run.spec.seed,
            str(result.run.state),
            None if result.score is None else result.score.value,
            None if result.score is None else result.score.unit,
            duration(result.run.seconds) if result.run.attempt else None,
            result.run.reason or _wall_text(result),
        )
        for index, result in enumerate(results)
    ]
    return Listing(("run", *_SHORT_AXES, *telling, "seed", "state", "score", "unit", "time", "reason"), tuple(rows))


def _wall_text(result: RunResult) -> str | None:
    """What to keep in mind about a score that a side of the arena has a part in."""
    gap = result.finals.get(WALL_GAP)
    return f"at a wall: within {gap.value:.1f} cells of it" if gap is not None and is_at_wall(gap.value) else None


def results_listing(results: Sequence[RunResult]) -> Listing:
    """One row per run with everything: references with all parameters and every final value, its unit in brackets."""
    finals = sorted({(final.name, final.unit) for result in results for final in result.finals.values()})
    return Listing(results_columns(finals), tuple(results_rows(results, finals)))


def results_columns(finals: Sequence[tuple[str, str]]) -> tuple[str, ...]:
    """The columns of `results_listing`, for finals by name and unit."""
    return (
        "run", "key", *AXES, "seed", "frames", "budget_kind", "budget_amount", "state", "reason", "attempts",
        "seconds", "provisional", *(f"{name} [{unit}]" if unit else name for name, unit in finals),
    )  # fmt: skip


def results_rows(results: Iterable[RunResult], finals: Sequence[tuple[str, str]]) -> Iterator[tuple[Any, ...]]:
    """The rows of `results_listing` one by one."""
    for result in results:
        run, spec = result.run, result.run.spec
        values = {(final.name, final.unit): final.value for final in result.finals.values()}
        yield (
            run.id, run.key, *(str(getattr(spec, axis)) for axis in AXES), spec.seed, spec.frames, spec.budget.kind,
            spec.budget.amount, str(run.state), run.reason, run.attempt, round(run.seconds, 3),
            bool(footnotes([spec.env])), *(values.get(final) for final in finals),
        )  # fmt: skip


def results_records(results: Sequence[RunResult]) -> list[dict[str, Any]]:
    """The stable JSON form of results: the run, its whole spec, and `finals` as name -> value and unit."""
    return [{**_run_record(result), "finals": _finals_record(result)} for result in results]


def running_listing(runs: Sequence[RunRow], now: float | None = None) -> Listing:
    """The runs in progress; ages and what is left of the lease in seconds at the time `now`."""
    moment = time.time() if now is None else now
    names = _short_names([run.spec for run in runs])
    columns = (
        "run", *_SHORT_AXES, "seed", "attempt", "progress", "score", "metric_age_s", "lease_s", "time_left"
    )  # fmt: skip
    rows = [
        (
            run.id,
            *names[index],
            run.spec.seed,
            run.attempt,
            f"{run.fraction:.0%}",
            run.score,
            None if run.progress_at is None else round(moment - run.progress_at),
            None if run.lease_until is None else round(run.lease_until - moment),
            duration(run.seconds_left),
        )
        for index, run in enumerate(runs)
    ]
    return Listing(columns, tuple(rows))


def plan_listing(specs: Sequence[RunSpec], states: Sequence[str], estimates: Sequence[float | None]) -> Listing:
    """The runs of a plan, one row each, with their states and estimated times."""
    names = _short_names(specs)
    rows = [
        (*names[index], spec.seed, str(spec.budget), state, None if state == "done" else duration(seconds))
        for index, (spec, state, seconds) in enumerate(zip(specs, states, estimates, strict=True))
    ]
    return Listing((*_SHORT_AXES, "seed", "budget", "state", "estimate"), tuple(rows))


def reasons_listing(runs: Sequence[RunRow | BoardRow]) -> Listing:
    """Runs without a score, one row each, with the reasons."""
    axes = ("env", "task", "design", "controller", "method")
    names = {axis: labels(getattr(run.spec, axis) for run in runs) for axis in axes}
    rows = tuple(
        (*(names[axis][getattr(run.spec, axis)] for axis in axes), run.spec.seed, str(run.state), run.reason or "")
        for run in runs
    )
    return Listing((*axes, "seed", "state", "reason"), rows)


def run_card(result: RunResult, attempts: Sequence[AttemptRow], specs: Sequence[RunSpec] = ()) -> dict[str, Any]:
    """Everything that is stored about one run, as plain data.

    `specs` are what has to be run to repeat it, where that is more than itself.
    """
    return {
        **_run_record(result),
        "finals": _finals_record(result),
        "attempts": [_attempt_record(attempt) for attempt in attempts],
        "repeat": " && ".join(repeat_command(spec) for spec in specs or (result.run.spec,)),
    }


def _short_names(specs: Sequence[RunSpec]) -> list[tuple[str, ...]]:
    axes: dict[str, Mapping[Ref, str]] = {axis: labels(getattr(spec, axis) for spec in specs) for axis in _SHORT_AXES}
    axes["env"] = marked(axes["env"])
    return [tuple(axes[axis][getattr(spec, axis)] for axis in _SHORT_AXES) for spec in specs]


def _run_record(result: RunResult) -> dict[str, Any]:
    run = result.run
    return {
        "run": run.id,
        "key": run.key,
        "spec": run.spec.to_dict(),
        "state": str(run.state),
        "reason": run.reason,
        "attempts": run.attempt,
        "seconds": round(run.seconds, 3),
        "is_smoke": result.is_smoke,
        "provisional": " ".join(footnotes([run.spec.env])) or None,
    }


def _finals_record(result: RunResult) -> dict[str, Any]:
    # JSON holds no NaN and no infinity: such a value is null.
    return {
        name: {"value": final.value if math.isfinite(final.value) else None, "unit": final.unit}
        for name, final in sorted(result.finals.items())
    }


def _attempt_record(attempt: AttemptRow) -> dict[str, Any]:
    return {
        "number": attempt.number,
        "outcome": str(attempt.outcome),
        "host": attempt.host,
        "started_at": attempt.started_at,
        "seconds": attempt.wall_seconds,
        "resumed": attempt.resumed,
        "exit_code": attempt.exit_code,
        "signal": attempt.signal,
        "peak_memory_bytes": attempt.peak_memory,
        "reason": attempt.reason,
        "traceback": attempt.traceback,
        "provenance": dict(attempt.provenance),
    }


def counts_text(counts: Mapping[RunState, int]) -> str:
    """For example `3 done, 1 running`; `no runs` for an empty database."""
    return ", ".join(f"{counts[state]} {state}" for state in RunState if counts.get(state)) or "no runs"
