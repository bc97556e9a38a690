"""Listings of runs: what `results`, `status` and `run --dry-run` print, and the card of one run."""

import math
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from zoobench.db.rows import AttemptRow, RunRow, RunState
from zoobench.report.labels import labels
from zoobench.report.leaderboard import BoardRow
from zoobench.report.listing import Listing, percent
from zoobench.report.normalise import REFERENCES
from zoobench.report.provisional import footnotes, marked
from zoobench.report.run_results import SCORE, RunResult, finals_record
from zoobench.spec import AXES, WALL_GAP, Budget, Ref, RunSpec, is_at_wall, repeat_command
from zoobench.tasks.quantities import heading, quantity_of

_SHORT_AXES = ("env", "task", "design", "method", "fidelity")
_MANY_HOURS = 100


def duration(seconds: float | None) -> str:
    """A time span [s] as a person says it: `42 s`, `3 min 05 s`, `2 h 10 min`, `1,350 days`.

    `unknown` for None and NaN.
    """
    if seconds is None or math.isnan(seconds):
        return "unknown"
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    if whole < _MANY_HOURS * 3600:
        return f"{whole // 3600} h {whole % 3600 // 60:02d} min"
    return f"{whole / 86400:,.0f} days" if whole >= 10 * 86400 else f"{whole / 86400:.1f} days"


def results_overview(results: Iterable[RunResult]) -> Listing:
    """One row per run with its score, for reading; with a controller, frames and budget where runs differ in it.

    Of each result little is kept, so that there may be any number of them.
    """
    kept = [(result.spec, _overview(result)) for result in results]
    specs = [spec for spec, _ in kept]
    columns, names = _settings(specs, ("controller", "frames", "budget"))
    rows = tuple((run, *own, spec.seed, *rest) for (spec, (run, *rest)), own in zip(kept, names, strict=True))
    name = heading({quantity_of(task) for task in _distinct(spec.task for spec in specs)})
    return Listing(("run", *columns, "seed", "state", name, "unit", "time", "reason"), rows, texts={"time": duration})


def _overview(result: RunResult) -> tuple[Any, ...]:
    """A run's number, state, score, unit, time [s] and notes."""
    run, score, quantity = result.run, result.score, result.quantity
    value, unit = (None, None) if score is None else (quantity.sign * score.value, quantity.unit_text)
    seconds = run.seconds if run.attempt else None
    return run.id, str(run.state), value, unit, seconds, run.reason or _wall_text(result)


def _wall_text(result: RunResult) -> str | None:
    """A note on a score that a side of the arena has influenced."""
    gap = result.finals.get(WALL_GAP)
    return f"at a wall: within {gap.value:.1f} cells of it" if gap is not None and is_at_wall(gap.value) else None


def _told(value: Any, controllers: Mapping[Ref, str]) -> Any:
    return controllers[value] if isinstance(value, Ref) else str(value) if isinstance(value, Budget) else value


def _differs(specs: Sequence[RunSpec], name: str) -> bool:
    """Whether a setting tells runs apart."""
    return len({id(getattr(spec, name)) for spec in specs}) > 1 and len({getattr(spec, name) for spec in specs}) > 1


def _distinct(refs: Iterable[Ref]) -> list[Ref]:
    """Each once; of very many runs most share the objects, and to compare those takes long."""
    return list({id(ref): ref for ref in refs}.values())


def results_listing(results: Sequence[RunResult]) -> Listing:
    """One row per run with everything: references with all parameters and every final value, its unit in brackets."""
    finals = sorted({(final.name, final.unit) for result in results for final in result.finals.values()})
    return Listing(results_columns(finals), tuple(results_rows(results, finals)))


def results_columns(finals: Sequence[tuple[str, str]]) -> tuple[str, ...]:
    """The columns of `results_listing`, for finals by name and unit."""
    own = (
        "run", "key", *AXES, "seed", "frames", "budget_kind", "budget_amount", "state", "reason", "attempts",
        "seconds", "provisional",
    )  # fmt: skip
    # a final may have any name: one that is taken is told apart
    return (*own, *(f"{name} [{unit}]" if unit else f"final {name}" if name in own else name for name, unit in finals))


def results_rows(results: Iterable[RunResult], finals: Sequence[tuple[str, str]]) -> Iterator[tuple[Any, ...]]:
    """The rows of `results_listing` one by one."""
    for result in results:
        run, spec = result.run, result.run.spec
        values = {(final.name, final.unit): final.value for final in result.finals.values()}
        yield (
            run.id, run.key, *_axes(spec), spec.seed, spec.frames, spec.budget.kind,
            spec.budget.amount, str(run.state), run.reason, run.attempt, round(run.seconds, 3),
            bool(footnotes([spec.env])), *(values.get(final) for final in finals),
        )  # fmt: skip


def results_record(result: RunResult) -> dict[str, Any]:
    """The stable JSON form of a result: the run, its whole spec, and `finals` as name -> value and unit."""
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
        "finals": finals_record(result.finals),
    }


def running_listing(runs: Sequence[RunRow], now: float | None = None) -> Listing:
    """The runs in progress, for programs.

    `progress` is the share of the budget that is used, `score` that of the incumbent. Ages [s] and the remaining lease
    [s] are those at the time `now`, and the time left [s] is that by its pace so far.
    """
    times = ("metric_age_s", "lease_s", "time_left_s")
    rows = (
        (run.id, *_axes(run.spec), run.spec.seed, run.attempt, run.fraction, run.score, *_times(run, now))
        for run in runs
    )
    return Listing(("run", *AXES, "seed", "attempt", "progress", "score", *times), tuple(rows))


def _times(run: RunRow, now: float | None) -> tuple[int | None, int | None, float | None]:
    """Time since a run last reported anything, that its worker's lease still lasts, and that it still takes [s]."""
    moment = time.time() if now is None else now
    age = None if run.progress_at is None else round(moment - run.progress_at)
    return age, None if run.lease_until is None else round(run.lease_until - moment), run.seconds_left


def running_overview(runs: Sequence[RunRow], now: float | None = None) -> Listing:
    """The same for people."""
    settings, names = _settings([run.spec for run in runs])
    quantities = [quantity_of(run.spec.task) for run in runs]
    rows = [
        (
            run.id, *own, run.spec.seed, run.attempt, run.fraction,
            None if run.score is None else quantity.sign * run.score, *_times(run, now),
        )
        for run, own, quantity in zip(runs, names, quantities, strict=True)
    ]  # fmt: skip
    texts = {"progress": percent, "time left": duration}
    ages = ("metric age [s]", "lease [s]", "time left")
    columns = ("run", *settings, "seed", "attempt", "progress", heading(quantities), *ages)
    return Listing(columns, tuple(rows), texts=texts)


def plan_listing(specs: Sequence[RunSpec], states: Sequence[str], estimates: Sequence[float | None]) -> Listing:
    """The runs of a plan, one row each, with their states, for programs.

    `estimate_s` is the expected wall time of the rest [s], None where it is not known.
    """
    columns = (*AXES, "seed", "frames", "budget_kind", "budget_amount", "state", "estimate_s")
    rows = (
        (
            *_axes(spec), spec.seed, spec.frames, spec.budget.kind, spec.budget.amount, state,
            None if state == "done" else seconds,
        )
        for spec, state, seconds in zip(specs, states, estimates, strict=True)
    )  # fmt: skip
    return Listing(columns, tuple(rows))


def plan_overview(specs: Sequence[RunSpec], states: Sequence[str], estimates: Sequence[float | None]) -> Listing:
    """The same for people; controller and frames are columns where they tell runs apart."""
    settings, names = _settings(specs, ("controller", "frames"))
    rows = [
        (
            *own, spec.seed, str(spec.budget), state,
            None if state == "done" else math.nan if seconds is None else seconds,
        )
        for own, spec, state, seconds in zip(names, specs, states, estimates, strict=True)
    ]  # fmt: skip
    columns = (*settings, "seed", "budget", "state", "estimate")
    return Listing(columns, tuple(rows), texts={"estimate": duration})


def _axes(spec: RunSpec) -> tuple[str, ...]:
    """The components of a run with every parameter stated, in the order of `AXES`."""
    return tuple(str(getattr(spec, axis)) for axis in AXES)


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

    `specs` are the runs that repeat it, where there are more than itself.
    """
    return {
        **results_record(result),
        "attempts": [_attempt_record(attempt) for attempt in attempts],
        "repeat": " && ".join(repeat_command(spec) for spec in specs or (result.run.spec,)),
    }


def _settings(specs: Sequence[RunSpec], telling: Iterable[str] = ()) -> tuple[list[str], list[tuple[Any, ...]]]:
    """Columns for people and their cells, of each run: short names, and of `telling` the settings that differ."""
    refs = {axis: _distinct(getattr(spec, axis) for spec in specs) for axis in _SHORT_AXES}
    axes: dict[str, Mapping[Ref, str]] = {axis: labels(found) for axis, found in refs.items()}
    axes["env"] = marked(axes["env"])
    by_id = {axis: {id(ref): axes[axis][ref] for ref in found} for axis, found in refs.items()}
    differing = [name for name in telling if _differs(specs, name)]
    controllers = labels(_distinct(spec.controller for spec in specs))
    cells = [
        (
            *(by_id[axis][id(getattr(spec, axis))] for axis in _SHORT_AXES),
            *(_told(getattr(spec, name), controllers) for name in differing),
        )
        for spec in specs
    ]
    return [*_SHORT_AXES, *differing], cells


def score_text(task: Ref, score: float, unit: str = "", digits: int = 4) -> str:
    """A score as it is said, see `Quantity.text`."""
    return quantity_of(task, unit).text(score, digits)


def finals_shown(task: Ref, finals: Mapping[str, Mapping[str, Any]]) -> list[tuple[str, float | None, str]]:
    """Names, values and units of the finals of a run's card, for people: scores as errors where the task's are."""
    quantity = quantity_of(task)
    shown = []
    for name, final in finals.items():
        is_score = name in (SCORE, *REFERENCES)
        value = final["value"]
        if is_score and value is not None:
            value *= quantity.sign
        shown.append((name.replace("score", quantity.noun) if is_score else name, value, final["unit"]))
    return shown


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
