"""`zoobench db`: commands on a database as a whole."""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Exit, Option

from zoobench.cli.app import App
from zoobench.cli.cancel import SweepOption, chosen_runs
from zoobench.cli.options import DEFAULT_DATABASE, DatabaseOption, RunsArgument, selection, takes
from zoobench.cli.output import say
from zoobench.errors import UsageError
from zoobench.spec import RunSelection

if TYPE_CHECKING:
    from zoobench.db.merge import MergeReport

db = App(no_args_is_help=True, help="Merge databases, export their results, remove runs.")


@db.callback()
def _group() -> None:
    """Merge databases, export their results, remove runs."""


@db.command("merge")
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


class Exported(StrEnum):
    """The kinds of data that can be exported."""

    RESULTS = "results"
    METRICS = "metrics"


@db.command("export")
@takes(selection)
def export(
    chosen: RunSelection,
    output: Annotated[Path, Option("--output", "-o", help="Output file, ending in .parquet.")] = Path(
        "zoobench.parquet"
    ),
    what: Annotated[
        Exported, Option("--what", help="results: a row per run; metrics: learning curves, a row per point.")
    ] = Exported.RESULTS,
    db: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Write results to a Parquet file.

    Needs the extra `parquet`. In Python, `zoobench.load("zoobench.db").results()` gives the same data as a pandas data
    frame. `zoobench results --format csv` prints it as text.
    """
    from zoobench.db.parquet import export_metrics, export_results

    if output.suffix != ".parquet":
        raise UsageError(f"{output} does not end in .parquet. For CSV there is `zoobench results --format csv`.")
    count = (export_results if what is Exported.RESULTS else export_metrics)(db, output, chosen)
    say(f"{count:,} rows in {output}")


@db.command("remove")
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
        chosen = chosen_runs(store, runs, sweep)
        others = dependents(store.runs(), {row.id for row in chosen})
        for rows, why in ((chosen, ""), (others, ", which depends on one of them")):
            for row in rows:
                say(visible(f"  {'removed' if yes else 'would remove'} {row.id} {row.spec}, {row.state}{why}"))
        if not yes:
            say("Nothing was removed. Type the same command again with --yes.")
            return
        store.remove([row.id for row in (*chosen, *others)])


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
