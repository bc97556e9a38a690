"""The pages of a leaderboard, Markdown and CSV: a pure function of its export, and of the orders that are known."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from zoobench.db.rows import RunState
from zoobench.report.confirmation import (
    DENSE,
    confirmation_listing,
    kept_orders,
    mark_overturned,
    with_lasting,
)
from zoobench.report.equal_costs import mark_early_winners
from zoobench.report.footer import Footer, footer
from zoobench.report.foreign_text import in_markdown, visible
from zoobench.report.leaderboard import MISSING, BoardRow, Leaderboard
from zoobench.report.leaderboard_export import to_text
from zoobench.report.listing import Listing, to_csv, to_markdown
from zoobench.report.provisional import MARK
from zoobench.report.provisional import footnotes as provisional_notes
from zoobench.report.table_forms import long_listing, table_listing
from zoobench.report.tables import Table, repeat_commands, score_tables
from zoobench.report.undecided import OrdersOf, footnotes, mark_undecided
from zoobench.report.views import duration, reasons_listing
from zoobench.spec import AXES, Budget, repeat_command

FOLDER = "leaderboards"
_DIGITS = 9
"""Significant digits of a computed number in the CSV: the last ones depend on the version of a library."""
_COMPUTED = ("mean", "low", "high", "normalised")


def pages(board: Leaderboard, orders_of: OrdersOf) -> dict[str, str]:
    """The content of the files by their ending."""
    return {".json": to_text(board), ".csv": csv_page(board, orders_of), ".md": markdown_page(board, orders_of)}


def tables_of(board: Leaderboard) -> list[Table]:
    """All tables of the suite, with missing runs, results of solutions over more frames, and marks at winners that do
    not win on a finer grid."""
    tables = score_tables(board.results(), board.missing())
    tables = mark_overturned(mark_early_winners(tables, lambda runs, _: board.curves(runs)), board.rows)
    known = {number: row.lasting for number, row in enumerate(board.rows, start=1) if row.lasting is not None}
    return with_lasting(tables, known)


def judged(tables: Iterable[Table], orders_of: OrdersOf) -> list[Table]:
    """The tables with the rows for which some run exists, and marks at differences that the fidelity cannot decide."""
    kept = [replace(table, rows=tuple(row for row in table.rows if not row.is_empty)) for table in tables]
    return mark_undecided([table for table in kept if table.rows], orders_of)


def csv_page(board: Leaderboard, orders_of: OrdersOf) -> str:
    """A line for every cell of the rows that have a run, with the reasons why runs have no score, and the command that
    repeats the cell."""
    cells: dict[tuple[str, ...], list[BoardRow]] = {}
    for run in board.rows:
        cells.setdefault(run.spec.cell(), []).append(run)
    listing = long_listing(judged(tables_of(board), orders_of))
    rows = []
    for record in (dict(zip(listing.columns, row, strict=True)) for row in listing.rows):
        runs = cells[_cell_of(record)]
        reasons = "; ".join(f"seed {run.spec.seed} {run.state}: {run.reason}" for run in _without_score(runs))
        repeat = repeat_command(*(run.spec for run in runs))
        rows.append((*map(_shortened, listing.columns, record.values()), reasons, repeat))
    return to_csv(Listing((*listing.columns, "reasons", "repeat"), tuple(rows))) + "\n"


def markdown_page(board: Leaderboard, orders_of: OrdersOf) -> str:
    """The page for reading: tables and what their fidelity cannot decide, runs without a score, commands, origin."""
    every = tables_of(board)
    tables = judged(every, orders_of)
    lines = [
        f"# {board.name}",
        "",
        in_markdown(f"{board.summary[:1].upper()}{board.summary[1:]}."),
        "",
        *_state_lines(board, every, tables),
    ]
    for part in (part for table in tables for part in table.parts()):
        lines += ["", f"## {in_markdown(part.title)}", "", to_markdown(table_listing(part))]
        if notes := footnotes([part], orders_of):
            lines += ["", *(f"- {in_markdown(note)}" for note in notes)]
        lines += _confirmation_lines(part, board)
    if lost := _without_score(board.rows):
        lines += ["", "## Without a score", "", to_markdown(reasons_listing(lost))]
    if tables:
        lines += ["", "## To repeat a row", "", *_repeat_lines(board, tables), "", "## Origin", ""]
        lines += [f"- {in_markdown(line)}" for line in footer_of(board, tables).lines()]
    return "\n".join(lines) + "\n"


def footer_of(board: Leaderboard, tables: Sequence[Table]) -> Footer:
    """The provenance of the numbers in these tables of a leaderboard."""
    attempts = board.attempts(run for table in tables for run in table.runs)
    return footer(tables, attempts, ["zoobench", "leaderboard", "publish", board.source, FOLDER])


def first_difference(committed: str, rebuilt: str) -> tuple[int, str | None, str | None] | None:
    """Number from 1 and both versions of the first line in which two texts differ; None if they are equal.

    A version is None where its text has ended before.
    """
    if committed == rebuilt:
        return None
    old, new = committed.split("\n"), rebuilt.split("\n")
    shared = min(len(old), len(new))
    first = next((number for number in range(shared) if old[number] != new[number]), shared)
    was, would_be = (lines[first] if first < len(lines) else None for lines in (old, new))
    return first + 1, was, would_be


def _state_lines(board: Leaderboard, every: Sequence[Table], shown: Sequence[Table]) -> list[str]:
    counts = Counter(MISSING if run.state is None else str(run.state) for run in board.rows)
    states = [state for state in (*map(str, RunState), MISSING) if counts[state]]
    seconds = sum(run.seconds for run in board.rows)
    rows, shown_rows = (sum(len(table.rows) for table in tables) for tables in (every, shown))
    others = "; the others have no run yet" if shown_rows < rows else ""
    lines = [
        f"- Runs: {', '.join(f'{counts[state]:,} {state}' for state in states)}, of {len(board.rows):,}; "
        f"{duration(seconds)} of computing.",
        f"- Rows (environment, task, design): {shown_rows:,} of {rows:,}{others}.",
    ]
    if counts[MISSING]:
        lines.append("- `missing`: the suite asks for it and it was not run. Nobody wins a row that lacks something.")
    if any(counts[state] for state in (MISSING, RunState.QUEUED, RunState.RUNNING)):
        lines.append(f"- `zoobench run --suite {board.source}` executes the remaining runs.")
    if provisional_notes(row.env for table in shown for row in table.rows):
        lines.append(f"- {MARK} marks provisional environments; the reasons stand [at the end](#origin).")
    return lines


def _confirmation_lines(table: Table, board: Leaderboard) -> list[str]:
    """The best solutions of a table's rows on a finer grid, as far as they were evaluated there."""
    found = confirmation_listing(table, board.rows)
    if not found.rows:
        return []
    finer = [board.rows[run - 1].finer for run in table.runs]
    where = ", ".join(sorted({score.fidelity.name for score in finer if score is not None}))
    orders = [row[-1] for row in found.rows if row[-1]]
    kept, count = kept_orders(table, board.rows)
    text = f"The best solution of each method, as it scores here → at {where}."
    if orders:
        text += (
            f" The order of the methods stands in {orders.count('stands')} of {len(orders)} rows, and that of any two "
            f"of these solutions in one environment and task in {kept} of {count} pairs."
        )
    if any(str(cell).endswith(DENSE) for row in found.rows for cell in row):
        text += f"{DENSE}: the robot tore there, and was simulated with more particles in a cell."
    return ["", f"### On a finer grid: {where}", "", text, "", to_markdown(found)]


def _without_score(runs: Iterable[BoardRow]) -> list[BoardRow]:
    """The runs that ended, or were skipped, without a result."""
    fine = (None, RunState.DONE, RunState.QUEUED, RunState.RUNNING)
    return [run for run in runs if run.state not in fine]


def _repeat_lines(board: Leaderboard, tables: Sequence[Table]) -> list[str]:
    """A command for each row; without a database in the way it makes the same numbers."""
    exists = [run.spec for run in board.rows if run.state not in (None, RunState.SKIPPED)]
    lines = ["With `--db` and the name of a new file; one method or seed of it alone is repeated as well.", "", "```sh"]
    for table in tables:
        for row, command in zip(table.rows, repeat_commands(table, exists), strict=True):
            names = (row.env.name, row.task.name, row.design.name)
            lines += [f"# {' x '.join(names)}", visible(command)]
    return [*lines, "```"]


def _cell_of(record: Mapping[str, Any]) -> tuple[str, ...]:
    """`RunSpec.cell` of a line of the CSV."""
    refs = (record[name] for name in AXES)
    return (*refs, str(record["frames"]), str(Budget(record["budget_kind"], record["budget_amount"])))


def _shortened(column: str, value: Any) -> Any:
    return float(f"{value:.{_DIGITS}g}") if column in _COMPUTED and value is not None else value
