"""`zoobench results` and `table`: the results of runs in a database."""

import math
from itertools import zip_longest
from typing import TYPE_CHECKING, Annotated, NamedTuple

from typer import Option

from zoobench.cli.curves import FOR_PEOPLE, Currency
from zoobench.cli.options import (
    DEFAULT_DATABASE,
    DatabaseOption,
    FormatOption,
    UnitOption,
    selection,
    takes,
)
from zoobench.cli.output import Format, emit, emit_json, print_text, say
from zoobench.errors import UsageError
from zoobench.spec import RunSelection

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence

    from zoobench.db.many_rows import OriginRow
    from zoobench.db.store import Store
    from zoobench.report.footer import Footer
    from zoobench.report.listing import Listing
    from zoobench.report.look import Look
    from zoobench.report.run_results import RunResult
    from zoobench.report.tables import Table
    from zoobench.spec import Ref


@takes(selection)
def results(
    chosen: RunSelection,
    db: DatabaseOption = DEFAULT_DATABASE,
    form: FormatOption = Format.TABLE,
) -> None:
    """Print one row per run.

    The table shows the score. csv, json and md have every final value and all settings.
    """
    from zoobench.db.store import Store
    from zoobench.report.run_results import OVERVIEW, iterate_results
    from zoobench.report.views import results_listing, results_overview, results_record

    noted = _Noted()
    with Store(db, create=False) as store:
        if form in (Format.TABLE, Format.LATEX):
            emit(results_overview(noted.each(iterate_results(store, chosen, OVERVIEW))), form)
        elif form is Format.CSV:
            _stream_csv(store.final_names(chosen), noted.each(iterate_results(store, chosen)))
        elif form is Format.JSON:
            emit_json([results_record(result) for result in noted.each(iterate_results(store, chosen))])
        else:
            emit(results_listing(list(noted.each(iterate_results(store, chosen)))), form)
    _note_results(noted.envs, has_smoke=noted.has_smoke)


class _Noted:
    """The facts for the notes below results that are read one by one."""

    def __init__(self) -> None:
        self.envs: set[Ref] = set()
        self.has_smoke = False

    def each(self, results: "Iterator[RunResult]") -> "Iterator[RunResult]":
        """The results as they come."""
        for result in results:
            self.envs.add(result.spec.env)
            self.has_smoke = self.has_smoke or result.is_smoke
            yield result


def _stream_csv(finals: "Sequence[tuple[str, str]]", results: "Iterator[RunResult]") -> None:
    """Print runs as CSV, a line at a time: there may be any number of them."""
    from zoobench.report.listing import csv_lines
    from zoobench.report.views import results_columns, results_rows

    for line in csv_lines(results_columns(finals), results_rows(results, finals)):
        print(line)


def _note_results(envs: "Collection[Ref]", *, has_smoke: bool) -> None:
    """Print notes on the runs that were printed."""
    from zoobench.report.provisional import footnotes

    for note in footnotes(envs):
        say(note)
    if has_smoke:
        say("Runs of the fidelity smoke only test the installation. Their scores mean nothing; tables leave them out.")


def _look(
    columns: Annotated[str, Option("--columns", help="Columns to show, in this order, as in env,design,cmaes.")] = "",
    rename: Annotated[
        list[str] | None,
        Option("--rename", help="Rename a row or column, as in lion='Lion (ours)'. Can be given several times."),
    ] = None,
    unit: UnitOption = "",
    caption: Annotated[str, Option("--caption", help="Caption of a LaTeX table.")] = "",
    label: Annotated[str, Option("--label", help="Label of a LaTeX table, as in tab:speeds.")] = "",
) -> "Look":
    """How tables for people look."""
    from zoobench.report.look import Look

    return Look.of(columns, rename or (), unit, caption, label)


@takes(selection, _look)
def table(
    chosen: RunSelection,
    look: "Look",
    normalised: Annotated[
        bool,
        Option("--normalised", help="Also show normalised scores: 0 for the baseline, 1 for the best mean of the row."),
    ] = False,
    pivot: Annotated[
        bool, Option("--pivot", help="Show environments as columns, with a row per task, design and method.")
    ] = False,
    aggregated: Annotated[
        bool, Option("--aggregate", help="Also compare the methods over all rows, and state the statistics used.")
    ] = False,
    by: Annotated[
        Currency | None, Option("--by", help="Compare the methods at an equal amount spent, in this unit.")
    ] = None,
    at: Annotated[
        float | None,
        Option(
            "--at",
            help="With --by: the amount at which to compare. Default: the largest that all runs of a row have spent.",
        ),
    ] = None,
    db: DatabaseOption = DEFAULT_DATABASE,
    form: FormatOption = Format.TABLE,
) -> None:
    """Compare the methods, with 95 % intervals.

    A cell is the mean score over seeds with its Student-t interval. Each method has a column. Each fidelity, budget,
    episode length and quantity has a table, with its provenance below. Lower errors are better. For a paper, use
    --format latex with --columns, --rename, --unit, --caption and --label. With --by, one table compares the best
    scores of runs of any budget at an equal amount spent. Smoke runs are left out. A normalised score is 0 for the
    better of an idle robot and the mean random controller, and 1 for the best mean of the row. The mark ‡ means that
    the fidelity is too coarse to rank this mean against the row's best.
    """
    from dataclasses import replace

    from zoobench.accuracy.tolerance import orders
    from zoobench.db.store import Store
    from zoobench.report.equal_costs import stored_tables
    from zoobench.report.footer import footer
    from zoobench.report.run_results import choose_results
    from zoobench.report.undecided import footnotes, mark_undecided

    if look.options() and form in (Format.CSV, Format.JSON):
        raise UsageError(FOR_PEOPLE.format(look.options()[0], form))
    if aggregated and form is Format.CSV:
        raise UsageError("A CSV file has one table. Leave --aggregate out, or choose another --format.")
    switches = {"--normalised": normalised, "--pivot": pivot, "--aggregate": aggregated}
    flags = [*(flag for flag, is_on in switches.items() if is_on), *_spending_flags(by, at)]
    with Store(db, create=False) as store:
        if by is None:
            tables = stored_tables(store, chosen)
        else:
            tables = _spending_tables(store, choose_results(store, chosen), by, at)
        tables = mark_undecided(tables, orders)
        command = ["zoobench", "table", *chosen.options(), *flags, *look.options(), "--format", str(form)]
        origins = store.origins([run for item in tables for run in item.runs])
        foot = replace(footer(tables, origins, command), undecided=footnotes(tables, orders))
        for note in _changed_code(store, tables, origins):
            say(note)
    style = TableStyle(normalised, pivot, aggregated)
    look.check([(part, style.listing(part)) for item in tables for part in item.parts()])
    print_tables(tables, foot, form, style, look)
    if not tables:
        say("No finished run to compare yet. Try: zoobench run --env desert --task turning")


def _changed_code(store: "Store", tables: "list[Table]", origins: "list[OriginRow]") -> "list[str]":
    """Warnings of plug-ins whose code differs from that of the runs in these tables."""
    from zoobench.harness.provenance import changed_plugins

    stored = [origin.provenance["plugins"] for origin in origins if "plugins" in origin.provenance]
    if not stored:
        return []
    runs = store.runs(ids=[run for table in tables for run in table.runs])
    return list(changed_plugins((run.spec for run in runs), stored))


def _spending_flags(by: Currency | None, at: float | None) -> list[str]:
    """--by and --at as they are typed.

    Raises:
        UsageError: an amount of nothing.
    """
    if at is not None and (by is None or not 0.0 < at < math.inf):
        raise UsageError(f"--at {at:g} is no amount. Give a positive number, together with --by.")
    return [*(["--by", by.value] if by else []), *(["--at", f"{at:.10g}"] if at is not None else [])]


def _spending_tables(store: "Store", results: "list[RunResult]", by: Currency, at: float | None) -> "list[Table]":
    from zoobench.report.learning_curves import curves, refuse_machines, spending_tables

    tables = spending_tables(results, curves(store, results, by.value), by.value, at)
    if by is Currency.SECONDS:
        refuse_machines(store.origins([run for item in tables for run in item.runs]))
    return tables


def print_tables(
    tables: "Sequence[Table]", foot: "Footer", form: Format, style: "TableStyle", look: "Look | None" = None
) -> None:
    """Print tables of scores and the footer below them; in JSON one object with both, in LaTeX it is a comment.

    Raises:
        UsageError: the look names a column or an entry that the tables do not have.
    """
    from dataclasses import asdict

    from zoobench.report.aggregate import HOW, aggregate, aggregate_listing, aggregate_records
    from zoobench.report.foreign_text import in_markdown
    from zoobench.report.latex import PREAMBLE
    from zoobench.report.table_forms import long_listing

    over_rows = [aggregate(item) for item in tables] if style.aggregated else []
    if form is Format.JSON:
        more = {"over_rows": [aggregate_records(found).records() for found in over_rows]} if over_rows else {}
        emit_json({"cells": long_listing(tables).records(), **more, "provenance": asdict(foot)})
        return
    if form is Format.CSV:
        emit(long_listing(tables), form)
        for line in foot.lines():
            say(line)
        return
    shown = [style.listings(item, look) for item in tables]
    if form is Format.LATEX and tables:
        print(PREAMBLE)
    parts = [
        listing
        for listings, over in zip_longest(shown, over_rows)
        for listing in (*listings, *([] if over is None else [aggregate_listing(over)]))
    ]
    for number, listing in enumerate(parts, start=1):
        _print_part(listing, form, look, number)
    mark = {Format.MD: "- ", Format.LATEX: "% "}.get(form, "")
    for line in (*([HOW] if over_rows else []), *foot.lines()) if tables else ():
        text = in_markdown(line) if form is Format.MD else line.replace("\n", " ")
        print_text(f"{mark}{text}")


def _print_part(listing: "Listing", form: Format, look: "Look | None", number: int) -> None:
    """Print one of several tables, whose labels in LaTeX are numbered from the second on."""
    from zoobench.report.latex import to_latex

    if form is Format.LATEX:
        caption, label = ("", "") if look is None else (look.caption, look.label)
        print(
            to_latex(listing, caption=caption or listing.title, label=label and f"{label}{f'-{number}' * (number > 1)}")
        )
    else:
        emit(listing, form)
    print()


class TableStyle(NamedTuple):
    """Options of tables: normalised scores, environments as columns, methods over all rows."""

    normalised: bool = False
    pivot: bool = False
    aggregated: bool = False

    def listings(self, table: "Table", look: "Look | None" = None) -> "list[Listing]":
        """The listings of a table, one for each quantity, as the look wants them."""
        parts = [(part, 1.0) if look is None else look.in_units(part) for part in table.parts()]
        listings = [(self.listing(part), factor) for part, factor in parts]
        return [listing if look is None else look.apply(listing, factor) for listing, factor in listings]

    def listing(self, part: "Table") -> "Listing":
        """The listing of a table of one quantity."""
        from zoobench.report.table_forms import pivot_listing, table_listing

        return (pivot_listing if self.pivot else table_listing)(part, self.normalised)
