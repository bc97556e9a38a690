"""`zoobench export`: results as files for other programs."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

from typer import Option

from zoobench.cli.options import DEFAULT_DATABASE, DatabaseOption, selection, takes
from zoobench.cli.output import say
from zoobench.errors import UsageError
from zoobench.spec import RunSelection


class Exported(StrEnum):
    """What is exported."""

    RESULTS = "results"
    METRICS = "metrics"


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
