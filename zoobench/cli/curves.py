"""`zoobench curves`: best scores by the amount spent."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

from typer import Option

from zoobench.cli.options import DEFAULT_DATABASE, DatabaseOption, FormatOption, selection, takes
from zoobench.cli.output import Format, emit, say
from zoobench.spec import RunSelection

_POINTS = (Format.CSV, Format.JSON)
"""Forms that give every point in every currency, and so compare nothing."""


class Currency(StrEnum):
    """The amounts that a method spends."""

    SUBSTEPS = "substeps"
    EPISODES = "episodes"
    SECONDS = "seconds"


@takes(selection)
def curves(
    chosen: RunSelection,
    by: Annotated[Currency, Option("--by", help="The amount against which scores are shown.")] = Currency.SUBSTEPS,
    output: Annotated[Path | None, Option("--output", "-o", help="Draw into this file (.png, .pdf or .svg).")] = None,
    db: DatabaseOption = DEFAULT_DATABASE,
    form: FormatOption = Format.TABLE,
) -> None:
    """Show learning curves: best scores by the amount spent.

    A picture has a panel for each cell and a line for each method: the mean over seeds, in a band from the lowest to
    the highest. Without one, a table gives the means at shares of the amount that all methods of a cell have spent;
    csv and json give every point. Finished runs only; smoke runs are left out.
    """
    from zoobench.db.store import Store
    from zoobench.report import learning_curves as report
    from zoobench.report.curve_plot import draw
    from zoobench.report.provisional import footnotes
    from zoobench.report.run_results import choose_results

    with Store(db, create=False) as store:
        results = choose_results(store, chosen)
        known = {} if output is None and form in _POINTS else report.curves(store, results, by.value)
        if by is Currency.SECONDS:
            report.refuse_machines(store.origins(list(known)))
        if output is not None:
            count = draw(results, known, output)
            say(f"Drawn: {output}, {count} {'cell' if count == 1 else 'cells'}")
            return
        if form in _POINTS:
            listing = report.points_listing(store, results)
        else:
            listing = report.curves_overview(results, known, by.value)
    emit(listing, form)
    for note in footnotes(result.spec.env for result in results):
        say(note)
    if not listing.rows:
        say("No finished run has a curve yet. `zoobench run --env desert --task turning` makes some.")
