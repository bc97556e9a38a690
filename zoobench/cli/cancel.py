"""`zoobench cancel`: stop runs."""

from typing import TYPE_CHECKING, Annotated

from typer import Option

from zoobench.cli.options import DEFAULT_DATABASE, DatabaseOption, RunsArgument
from zoobench.cli.output import say
from zoobench.errors import UsageError

if TYPE_CHECKING:
    from zoobench.db.rows import RunRow
    from zoobench.db.store import Store

SweepOption = Annotated[int | None, Option("--sweep", help="All runs of this sweep.")]


def cancel(runs: RunsArgument = None, sweep: SweepOption = None, db: DatabaseOption = DEFAULT_DATABASE) -> None:
    """Cancel runs that are queued or in progress.

    Workers stop them within seconds. `zoobench run --retry cancelled` resumes them from their checkpoints.
    """
    from zoobench.db.store import Store

    with Store(db, create=False) as store:
        chosen = chosen_runs(store, runs, sweep)
        cancelled = store.cancel([row.id for row in chosen])
    say(f"{len(cancelled)} cancelled, {len(chosen) - len(cancelled)} had ended before")


def chosen_runs(store: "Store", runs: list[str] | None, sweep: int | None) -> "list[RunRow]":
    """The runs that are named, or those of a sweep.

    Raises:
        UsageError: none or both are given, or there are no such runs.
    """
    if bool(runs) == (sweep is not None):
        raise UsageError("Name runs by their numbers, or give --sweep. `zoobench status` lists those in progress.")
    found = store.runs(sweep=sweep) if sweep is not None else [store.run(name) for name in runs or ()]
    if not found:
        raise UsageError(f"There is no sweep {sweep} here. `zoobench run --no-wait` prints its number.")
    return list({row.id: row for row in found}.values())
