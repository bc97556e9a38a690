"""`zoobench curves`: best scores by the amount spent."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

from typer import Option

from zoobench.cli.options import DEFAULT_DATABASE, DatabaseOption, FormatOption, UnitOption, selection, takes
from zoobench.cli.output import Format, emit, say
from zoobench.errors import UsageError
from zoobench.spec import RunSelection

_POINTS = (Format.CSV, Format.JSON)
"""Forms that give every point in every currency, and so compare nothing."""

FOR_PEOPLE = "{} changes tables for people, and {} has the data unchanged. Leave it out."
"""The message for an option and a format that do not go together."""


class Currency(StrEnum):
    """The amounts that a method spends."""

    SUBSTEPS = "substeps"
    EPISODES = "episodes"
    SECONDS = "seconds"


@takes(selection)
def curves(
    chosen: RunSelection,
    by: Annotated[Currency, Option("--by", help="Unit of the horizontal axis, the amount spent.")] = Currency.SUBSTEPS,
    output: Annotated[
        Path | None, Option("--output", "-o", help="Draw the curves into this .png, .pdf or .svg file.")
    ] = None,
    width: Annotated[
        float | None,
        Option("--width", min=20.0, max=1000.0, help="Width of the figure [mm], as in 85 for a column of a paper."),
    ] = None,
    rename: Annotated[
        list[str] | None,
        Option("--rename", help="Rename a name in the figure, as in cmaes=CMA-ES. Can be given several times."),
    ] = None,
    unit: UnitOption = "",
    db: DatabaseOption = DEFAULT_DATABASE,
    form: FormatOption = Format.TABLE,
) -> None:
    """Show learning curves.

    They are best scores so far over the budget spent. The figure has a panel per cell and a line per method: the mean
    over seeds, with a band from minimum to maximum. With --width it is drawn for a paper: the caption is printed
    instead of drawn. Without -o, a table gives the means at fractions of the budget that all methods of a cell have
    spent; csv and json give every point. Only finished runs are shown. Smoke runs are left out.
    """
    from zoobench.db.store import Store
    from zoobench.report import learning_curves as report
    from zoobench.report.curve_plot import CAPTION, draw
    from zoobench.report.look import new_names, words
    from zoobench.report.provisional import footnotes
    from zoobench.report.run_results import choose_results
    from zoobench.report.units import check_units

    if width is not None and output is None:
        raise UsageError("--width is the width of a figure. Name its file with -o, as in -o curves.pdf.")
    if rename and output is None:
        raise UsageError("--rename is for a figure. Name its file with -o, as in -o curves.pdf.")
    if unit and output is None and form in _POINTS:
        raise UsageError(FOR_PEOPLE.format("--unit", form))
    renamed, units = new_names(rename or ()), words(unit)
    with Store(db, create=False) as store:
        results = choose_results(store, chosen)
        known = {} if output is None and form in _POINTS else report.curves(store, results, by.value)
        if by is Currency.SECONDS:
            report.refuse_machines(store.origins(list(known)))
        if known:
            check_units(units, {result.quantity.unit for result in results if result.run.id in known})
        if output is not None:
            count = draw(results, known, output, width, renamed, units)
            say(f"Drawn: {output}, {count} {'cell' if count == 1 else 'cells'}")
            if width is not None:
                say(f"Caption: {CAPTION}")
            return
        if form in _POINTS:
            listing = report.points_listing(store, results)
        else:
            listing = report.curves_overview(results, known, by.value, units)
    emit(listing, form)
    for note in footnotes(result.spec.env for result in results):
        say(note)
    if not listing.rows:
        say("No finished run has a learning curve yet. Try: zoobench run --env desert --task turning")
