"""`zoobench accuracy exact`: error and time against exact answers."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Exit, Option

from zoobench.cli.options import DEFAULT_DATABASE, DatabaseOption, FormatOption
from zoobench.cli.output import Format, emit_several, listing_of, say
from zoobench.cli.studies import save_each
from zoobench.errors import UsageError

if TYPE_CHECKING:
    from zoobench.verify.accuracy.analytic import AnalyticRow

STUDY = "accuracy-exact"


def exact(
    quick: Annotated[bool, Option("--quick", help="Two grids of each case.")] = False,
    only_read: Annotated[bool, Option("--stored", help="Simulate nothing: judge what the database holds.")] = False,
    plots: Annotated[Path | None, Option("--plots", help="Draw error against time into this folder.")] = None,
    db: DatabaseOption = DEFAULT_DATABASE,
    form: FormatOption = Format.TABLE,
) -> None:
    """Compare with exact answers on finer and finer grids.

    Errors and times of cases of `validate` that have a closed form, and the observed order of accuracy beside that of
    the theory. Exit code 1 if an order is missed.
    """
    from zoobench.verify.accuracy.analytic import AnalyticRow, AnalyticSummary, figure, summarise
    from zoobench.verify.comparison_figure import draw

    rows = _stored(db) if only_read else list(_carry_out(db, levels=2 if quick else None))
    summaries = summarise(rows)
    if plots is not None:
        draw(figure(rows), plots / "accuracy-exact.png")
        say(f"drawn: {plots / 'accuracy-exact.png'}")
    emit_several({"rows": listing_of(AnalyticRow, rows), "orders": listing_of(AnalyticSummary, summaries)}, form)
    if any(summary.verdict == "missed" for summary in summaries):
        raise Exit(1)


def _carry_out(db: str, levels: int | None) -> "Iterator[AnalyticRow]":
    from dataclasses import asdict

    from zoobench.db.rows import StudyRow
    from zoobench.verify.accuracy.analytic import analytic

    def stored(row: "AnalyticRow") -> StudyRow:
        return StudyRow(f"{row.case} {row.cells} {row.quantity}", "measured", asdict(row))

    for row in save_each(db, STUDY, analytic(levels=levels), stored):
        say(f"{row.case}, {row.cells} cells: {row.quantity} off by {row.error:.2g}, {row.slowdown:.2g} s per second")
        yield row


def _stored(db: str) -> "list[AnalyticRow]":
    from zoobench.db.store import Store
    from zoobench.verify.accuracy.analytic import AnalyticRow

    with Store(db, create=False) as store:
        study = store.study(STUDY)
    if study is None:
        raise UsageError(f"{store.name} holds no errors against exact answers. Leave --stored out to measure them.")
    documents = [{**row.document, "settings": tuple(map(tuple, row.document["settings"]))} for row in study.rows]
    return [AnalyticRow(**document) for document in documents]
