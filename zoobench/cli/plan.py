"""`zoobench run --dry-run`: the runs that would be done, and their time. Nothing runs and nothing is written."""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from zoobench.cli.options import coarsest_fidelity
from zoobench.cli.output import Format, emit, say
from zoobench.errors import UsageError
from zoobench.spec import Ref, RunSpec

if TYPE_CHECKING:
    from zoobench.db.many_rows import PastTotal
    from zoobench.db.rows import RunState
    from zoobench.harness.grid import Skip
    from zoobench.harness.request import RunRequest
    from zoobench.report.estimate import Estimate, Estimator, Rate


def show_plan(asked: "RunRequest", jobs: int, db: str, form: Format) -> None:
    """Print the runs that are asked for, and their time.

    The estimate uses finished runs in the database, or else measured rates of the simulator; the last lines name its
    source. For a suite with parts they also give the time of each part.
    """
    from zoobench.accuracy.rates import origin, rate
    from zoobench.harness import suites
    from zoobench.harness.grid import Skip
    from zoobench.report.estimate import basis_text, total_seconds
    from zoobench.report.provisional import footnotes
    from zoobench.report.views import duration, plan_listing, plan_overview

    cells = asked.cells(db, coarsest_fidelity, say)
    specs = [cell for cell in cells if not isinstance(cell, Skip)]
    states, estimator = known_runs(db, specs, rate)
    for note in _changed_code(db, specs):
        say(note)
    known = [str(states.get(spec.key(), "new")) for spec in specs]
    estimates = [estimator(spec) for spec in specs]
    planned = specs, known, [each and each.seconds for each in estimates]
    emit(plan_overview(*planned), form, programs=plan_listing(*planned))

    to_do = [(spec, each) for spec, each, state in zip(specs, estimates, known, strict=True) if state in _TO_DO]
    skips = [cell for cell in cells if isinstance(cell, Skip)]
    total = duration(total_seconds([each and each.seconds for _, each in to_do], jobs))
    say(
        f"{len(to_do)} runs to do of {len(specs)}, {len(skips)} skipped; "
        f"estimated time with {jobs} in parallel: {total}"
    )
    for line in _part_lines(suites.load(asked.suite).parts if asked.suite else {}, to_do):
        say(line)
    if to_do:
        say(f"Estimated: {basis_text(estimator, [each for _, each in to_do], origin())}")
        if memory := expected_memory(spec for spec, _ in to_do):
            say(f"Memory: up to {memory / 2**20:.0f} MiB per run, as measured; --memory sets a limit")
    for note in footnotes(spec.env for spec in specs):
        say(note)
    for skip in skips:
        say(f"  skipped {skip.spec}: {skip.reason}")
    check_anything_is_left(cells)


def check_anything_is_left(cells: "Iterable[RunSpec | Skip]") -> None:
    """Raise UsageError if every combination was skipped."""
    from zoobench.harness.grid import Skip

    if all(isinstance(cell, Skip) for cell in cells):
        raise UsageError(
            "Nothing is left to run: every combination was skipped, for the reasons above. Change what they name."
        )


_TO_DO = ("new", "queued", "running", "skipped")


def _part_lines(parts: Mapping[str, Collection[str]], to_do: "Sequence[tuple[RunSpec, Estimate | None]]") -> list[str]:
    """The runs and the computing of each part of a suite that still has something to do, as lines of text."""
    from zoobench.report.views import duration

    lines = []
    for name, keys in parts.items():
        own = [each for spec, each in to_do if spec.key() in keys]
        seconds = sum(each.seconds for each in own if each is not None)
        more = f" and {own.count(None):,} of unknown time" if None in own else ""
        lines += [f"  part {name}: {len(own):,} runs, {duration(seconds)} of one core{more}"] if own else []
    return lines


def expected_memory(specs: Iterable[RunSpec]) -> int | None:
    """The most that the process of one of these runs takes, by measurement [bytes]; None where nothing was measured."""
    from zoobench.accuracy.rates import rate

    places = {(spec.env, spec.fidelity) for spec in specs}
    known = [found.memory for place in places if (found := rate(*place)) is not None and found.memory]
    return round(max(known) * 2**20) if known else None


def _changed_code(db: str, specs: Sequence[RunSpec]) -> list[str]:
    """Warnings of plug-ins whose code differs from that of the runs in the database."""
    from zoobench.db.store import Store
    from zoobench.harness.provenance import changed_plugins

    if not _is_there(db):
        return []
    with Store(db, create=False) as store:
        return list(changed_plugins(specs, store.plugins()))


def _is_there(db: str) -> bool:
    return "://" in db or Path(db).exists()


def known_runs(
    db: str, specs: Sequence[RunSpec], rate: "Callable[[Ref, Ref], Rate | None]"
) -> "tuple[dict[str, RunState], Estimator]":
    """The states of these runs by key, and the estimator of their times; without a database no state is known."""
    from zoobench.report.estimate import Estimator

    if not _is_there(db):
        return {}, Estimator(rate=rate)
    from zoobench.db.store import Store

    def totals() -> "Sequence[PastTotal]":
        with Store(db, create=False) as store:
            return store.totals()

    with Store(db, create=False) as store:
        return store.states([spec.key() for spec in specs]), Estimator(store.past(specs), rate, totals)
