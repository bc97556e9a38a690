"""A report as one HTML file that needs nothing else: style, script and Vega-Lite are in it."""

from base64 import b64encode
from collections.abc import Callable, Sequence
from functools import cache
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from zoobench.db.rows import RunState
from zoobench.errors import extra
from zoobench.report.aggregate import HOW, aggregate, aggregate_listing
from zoobench.report.foreign_text import visible
from zoobench.report.page.charts import Chart, accuracy_chart, cost_chart, curve_chart, profile_chart
from zoobench.report.page.sections import Accuracy, Level, Section
from zoobench.report.page.vega import LIBRARY, bundle
from zoobench.report.table_forms import pivot_listing, table_listing
from zoobench.report.tables import Table, repeat_commands
from zoobench.report.views import duration, reasons_listing

if TYPE_CHECKING:
    from jinja2 import Environment

_MOST_LOST = 500  # runs without a score that are listed one by one


def page(sections: Sequence[Section], levels: Sequence[Level], accuracy: Accuracy, command: str, mark: str = "") -> str:
    """The page.

    Args:
        sections: its contents.
        levels: errors and costs of fidelities.
        accuracy: the error of a fidelity, for single scores.
        command: that makes it again.
        mark: of the exports that it was made from, as `leaderboard_files.read_exports`.

    Raises:
        UsageError: the extra `report` is not installed.
    """
    check_tools()
    charts: list[Chart] = []
    shown = [_section(section, levels, accuracy, charts) for section in sections]
    return _environment().get_template("page.html").render(
        sections=shown, charts=charts, command=command, mark=mark, how=HOW, vega=bundle()
    )  # fmt: skip


def check_tools() -> None:
    """Check that a page can be made.

    Raises:
        UsageError: the extra `report` is not installed.
    """
    with extra("report", "Reports need"):
        for module in ("jinja2", LIBRARY):
            if find_spec(module) is None:
                raise ModuleNotFoundError(name=module)


def _section(section: Section, levels: Sequence[Level], accuracy: Accuracy, charts: list[Chart]) -> dict[str, Any]:
    """A section as the template takes it; its charts are added to the list, and known by their places there."""

    def place(chart: Chart | None) -> int | None:
        if chart is None:
            return None
        charts.append(chart)
        return len(charts) - 1

    return {
        "name": section.name,
        "summary": section.summary,
        "counts": [(f"{count:,}", state) for state, count in section.counts.items()],
        "time": duration(section.seconds),
        "tables": [_table(table, section, place) for table in section.tables],
        "curves": place(curve_chart(section)),
        "costs": place(cost_chart(section, accuracy)),
        "accuracy": place(accuracy_chart(section, levels)),
        "stills": [
            (still.title, b64encode(still.image).decode(), b64encode(still.film).decode()) for still in section.stills
        ],
        "left_out": section.left_out,
        "lost": reasons_listing([result.run for result in section.lost[:_MOST_LOST]]) if section.lost else None,
        "more_lost": max(len(section.lost) - _MOST_LOST, 0),
        "origin": [line.partition(": ") for line in section.foot.lines()] if section.tables else [],
    }


def _table(table: Table, section: Section, place: Callable[[Chart | None], int | None]) -> dict[str, Any]:
    """A table of scores as the template takes it, in both layouts and over its rows."""
    found = aggregate(table)
    specs = [run.spec for run in section.results if run.run.state is not RunState.SKIPPED]
    return {
        "parts": [(table_listing(part), repeat_commands(part, specs), pivot_listing(part)) for part in table.parts()],
        "over_rows": aggregate_listing(found) if found.improvements else None,
        "rows": found.rows,
        "all_rows": len(table.rows),
        "profiles": place(profile_chart(found)),
    }


@cache
def _environment() -> "Environment":
    """Jinja, which escapes all that it writes; signs that do more than stand there are made visible before."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    return Environment(
        loader=PackageLoader("zoobench.report.page", ""),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=lambda value: visible(value) if type(value) is str else value,
    )
