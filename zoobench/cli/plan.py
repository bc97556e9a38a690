"""`zoobench plan`: the runs that `run` would do, and their time. Nothing runs and nothing is written."""

from pathlib import Path
from typing import TYPE_CHECKING

from zoobench.cli.options import DEFAULT_DATABASE, DatabaseOption, FormatOption, WorkersOption, request, takes
from zoobench.cli.output import Format, emit, say
from zoobench.spec import RunSelection

if TYPE_CHECKING:
    from zoobench.harness.request import RunRequest
    from zoobench.report.run_results import RunResult


@takes(request)
def plan(
    asked: "RunRequest",
    jobs: WorkersOption = 2,
    db: DatabaseOption = DEFAULT_DATABASE,
    form: FormatOption = Format.TABLE,
) -> None:
    """Show the runs that `run` would do, and their time.

    Takes the options of `run`. The time is estimated from finished runs in the database. Nothing runs or is written.
    """
    from zoobench.harness.grid import Skip
    from zoobench.report.estimate import estimate_seconds, total_seconds
    from zoobench.report.provisional import footnotes
    from zoobench.report.views import duration, plan_listing
    from zoobench.verify.accuracy.tolerance import choose

    cells = asked.cells(db, choose, say)
    past = _past_results(db)
    states = {result.run.key: str(result.run.state) for result in past}
    specs = [cell for cell in cells if not isinstance(cell, Skip)]
    known = [states.get(spec.key(), "new") for spec in specs]
    estimates = [estimate_seconds(spec, past) for spec in specs]
    emit(plan_listing(specs, known, estimates), form)

    open_estimates = [seconds for seconds, state in zip(estimates, known, strict=True) if state in _TO_DO]
    skips = [cell for cell in cells if isinstance(cell, Skip)]
    say(
        f"{len(open_estimates)} runs to do of {len(specs)}, {len(skips)} skipped; "
        f"estimated time with {jobs} at once: {duration(total_seconds(open_estimates, jobs))}"
    )
    for note in footnotes(spec.env for spec in specs):
        say(note)
    for skip in skips:
        say(f"  skipped {skip.spec}: {skip.reason}")


_TO_DO = ("new", "queued", "running", "skipped")


def _past_results(db: str) -> "list[RunResult]":
    """The results from which times are estimated; none if there is no database yet."""
    if "://" not in db and not Path(db).exists():
        return []
    from zoobench.db.store import Store
    from zoobench.report.run_results import choose_results

    with Store(db, create=False) as store:
        return choose_results(store, RunSelection())
