"""`zoobench cancel`, `remove` and `merge`: what is done with runs as a whole."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Exit, Option

from zoobench.cli.options import DEFAULT_DATABASE, DatabaseOption, RunsArgument
from zoobench.cli.output import say
from zoobench.errors import UsageError

if TYPE_CHECKING:
    from zoobench.db.merge import MergeReport
    from zoobench.db.rows import RunRow
    from zoobench.db.store import Store

SweepOption = Annotated[int | None, Option("--sweep", help="All runs of this sweep.")]


def cancel(runs: RunsArgument = None, sweep: SweepOption = None, db: DatabaseOption = DEFAULT_DATABASE) -> None:
    """Cancel runs that are queued or in progress.

    Workers stop them within seconds. `zoobench run --retry cancelled` resumes them from their checkpoints.
    """
    from zoobench.db.store import Store

    with Store(db, create=False) as store:
        chosen = _chosen(store, runs, sweep)
        cancelled = store.cancel([row.id for row in chosen])
    say(f"{len(cancelled)} cancelled, {len(chosen) - len(cancelled)} had ended before")


def remove(
    runs: RunsArgument = None,
    sweep: SweepOption = None,
    yes: Annotated[bool, Option("--yes", "-y", help="Remove the runs. Without it they are only listed.")] = False,
    db: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Remove runs, and the runs that depend on them.

    Their results go with them. A run depends on the runs that its settings name as start, gait or body. Scores from
    `evaluate` are removed, too.
    """
    from zoobench.db.removal import dependents
    from zoobench.db.store import Store
    from zoobench.report.foreign_text import visible

    with Store(db, create=False) as store:
        chosen = _chosen(store, runs, sweep)
        others = dependents(store.runs(), {row.id for row in chosen})
        for rows, why in ((chosen, ""), (others, ", which depends on one of them")):
            for row in rows:
                say(visible(f"  {'removed' if yes else 'would remove'} {row.id} {row.spec}, {row.state}{why}"))
        if not yes:
            say("Nothing was removed. Type the same command again with --yes.")
            return
        store.remove([row.id for row in (*chosen, *others)])


def merge(
    target: Annotated[str, Argument(help="Target database: a file, or a PostgreSQL URL.")],
    source: Annotated[str, Argument(help="Source database. It is not changed.")],
) -> None:
    """Add the runs of one database to another.

    Runs with equal settings are the same run. If both databases have its result, the results must be equal bit for bit;
    differing runs are listed, and the exit code is 1. Sweeps and studies, such as the scores of `evaluate`, are not
    merged; their numbers are printed.
    """
    from zoobench.db.query import Reader
    from zoobench.db.store import Store

    if not (target and source):
        raise UsageError("A database with an empty name was given. Name two: the one to add to, then the other.")
    if target == source or (Path(target).exists() and Path(source).exists() and Path(target).samefile(source)):
        raise UsageError(f"{target} and {source} are the same database. Name two.")
    if "://" not in source and not Path(source).exists():
        raise UsageError(f"There is no database {source} to take runs from. Name one that exists.")
    with Reader(source, create=False) as other, Store(target) as store:
        report = store.merge(other)
    _tell_merge(report)
    if report.differing or report.left_out:
        raise Exit(1)


def _chosen(store: "Store", runs: list[str] | None, sweep: int | None) -> "list[RunRow]":
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


def _tell_merge(report: "MergeReport") -> None:
    from zoobench.report.foreign_text import visible

    groups = {
        "added": report.added,
        "completed from the source": report.completed,
        "identical in both": report.agreeing,
        "unchanged in the target": report.kept,
        "differing": report.differing,
        "left out": report.left_out,
    }
    say(", ".join(f"{len(found)} {name}" for name, found in groups.items() if found) or "no runs")
    for item in report.differing:
        say(
            f"  run {item.here} of the target and run {item.there} of the source differ in {', '.join(item.parts)}; "
            "the target keeps its own"
        )
    for run_id, reason in report.left_out:
        say(visible(f"  run {run_id} of the source {reason}"))
    if report.unproved:
        names = ", ".join(map(str, report.unproved[:10])) + (", ..." if len(report.unproved) > 10 else "")
        say(f"{len(report.unproved)} runs without a digest, whose results cannot be verified, in the target: {names}")
    left = [f"{report.sweeps} sweeps"] if report.sweeps else []
    left += [f"{count} rows of {name}" for name, count in report.studies.items()]
    if left:
        say(f"Not merged: {', '.join(left)}")
