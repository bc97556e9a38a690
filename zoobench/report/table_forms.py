"""Tables of scores in the forms in which they are printed."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from zoobench.db.rows import OPEN_STATES, RunState
from zoobench.registry import Kind
from zoobench.report.entries import Entry, entry_labels
from zoobench.report.labels import labels
from zoobench.report.lasting import COLUMN
from zoobench.report.listing import Listing, Measured, listing_by
from zoobench.report.provisional import footnotes, marked
from zoobench.report.table_cell import TableCell, spent_alike
from zoobench.report.tables import Row, Spending, Table
from zoobench.spec import Budget

_AXES = ("env", "task", "design")


def table_listing(table: Table, normalised: bool = False) -> Listing:
    """The table of one quantity as a person reads it: methods side by side, winners marked, units in headings."""
    names = {axis: labels(getattr(row, axis) for row in table.rows) for axis in _AXES[1:]}
    names["env"] = marked(labels((row.env for row in table.rows), Kind.ENV))
    entries = entry_labels(table.entries)
    # The amount spent is a column only where it is not in the title.
    spent = [table.budget] if isinstance(table.budget, Spending) and table.budget.amount is None else []
    is_uneven = any(_is_uneven(table, row) for row in table.rows)
    lasts = any(_lasts(row.cells) for row in table.rows)
    rows = [
        (
            *(names[axis][getattr(row, axis)] for axis in _AXES),
            *(row.amount for _ in spent),
            *(_estimate(cell, table, row, normalised) for cell in row.cells),
            *([_lasting_text(row.cells, row.quantity.sign)] if lasts else []),
            *([] if not is_uneven else [_spent_text(row) if _is_uneven(table, row) else None]),
        )
        for row in table.rows
    ]
    first = len(_AXES) + len(spent)
    winners = {
        (number, first + place)
        for number, row in enumerate(table.rows)
        for place, cell in enumerate(row.cells)
        if cell is not None and cell.is_winner
    }
    amounts = {f"at [{spending.unit}]": spending.text for spending in spent}
    columns = (
        *_AXES,
        *amounts,
        *(_heading(entries[entry], table) for entry in table.entries),
        *([COLUMN] if lasts else []),
        *([f"spent [{table.currency}]"] if is_uneven else []),
    )
    return Listing(columns, tuple(rows), frozenset(winners), amounts, table.title)


def pivot_listing(table: Table, normalised: bool = False) -> Listing:
    """The table with environments side by side: a row for each task, design and method."""
    envs = marked(labels((row.env for row in table.rows), Kind.ENV))
    names = {axis: labels(getattr(row, axis) for row in table.rows) for axis in ("task", "design")}
    entries = entry_labels(table.entries)
    by_place = {(row.task, row.design, row.env): row for row in table.rows}
    places = list(dict.fromkeys((row.task, row.design) for row in table.rows))
    # the amount spent is shown where the methods of a row differ in it, as in `table_listing`
    uneven = {place for place, row in by_place.items() if _is_uneven(table, row)}
    lasts = any(_lasts(row.cells) for row in table.rows)
    rows: list[tuple[str | Measured | None, ...]] = []
    winners = set()
    for task, design in places:
        sign = 1.0 if table.quantity is None else table.quantity.sign
        own = [by_place.get((task, design, env)) for env in envs]
        for place, entry in enumerate(table.entries):
            found = [None if row is None else row.cells[place] for row in own]
            if not any(found):
                continue
            won = (column for column, cell in enumerate(found) if cell is not None and cell.is_winner)
            winners |= {(len(rows), len(names) + 1 + column) for column in won}
            told = [
                "-" if (task, design, env) not in uneven else _amount(cell)
                for env, cell in zip(envs, found, strict=True)
            ]
            rows.append(
                (
                    names["task"][task], names["design"][design], entries[entry],
                    *(None if row is None else _estimate(cell, table, row, normalised)
                      for row, cell in zip(own, found, strict=True)),
                    *([_lasting_text(found, sign)] if lasts else []),
                    *([None if set(told) == {"-"} else " / ".join(told)] if uneven else []),
                )
            )  # fmt: skip
    columns = (
        *names,
        "method",
        *(_heading(name, table) for name in envs.values()),
        *([COLUMN] if lasts else []),
        *([f"spent [{table.currency}]"] if uneven else []),
    )
    return Listing(columns, tuple(rows), frozenset(winners), title=table.title)


def _heading(name: str, table: Table) -> str:
    """A heading of scores, with their unit."""
    return f"{name} [{table.quantity.unit}]" if table.quantity is not None and table.quantity.unit else name


def _estimate(cell: TableCell | None, table: Table, row: Row, normalised: bool) -> Measured | None:
    return None if cell is None else cell.estimate(table.seeds, sign=row.quantity.sign, normalised=normalised)


def _is_uneven(table: Table, row: Row) -> bool:
    """Whether methods have spent unlike amounts, which are shown."""
    return isinstance(table.budget, Budget) and table.budget.kind != "seconds" and not spent_alike(row.cells)


def _lasts(cells: Sequence[TableCell | None]) -> bool:
    """Whether a solution was evaluated over more frames."""
    return any(cell is not None and cell.lasting is not None for cell in cells)


def _lasting_text(cells: Sequence[TableCell | None], sign: float) -> str | None:
    """The results of the best solutions of these cells over more frames, in their order."""
    return " / ".join(_after(cell, sign) for cell in cells) if _lasts(cells) else None


def _after(cell: TableCell | None, sign: float) -> str:
    if cell is None or cell.lasting is None or cell.best is None:
        return "?"
    return cell.lasting.text(cell.best[1], sign)


def _spent_text(row: Row) -> str:
    """The amount that each method of a row has spent, in their order."""
    return " / ".join(map(_amount, row.cells))


def _amount(cell: TableCell | None) -> str:
    return "?" if cell is None or cell.spent is None else f"{cell.spent:,.0f}"


class _Shown(NamedTuple):
    """A cell with its table, row and column."""

    table: Table
    row: Row
    entry: Entry
    cell: TableCell

    @property
    def budget(self) -> Budget | Spending:
        """Of its runs, or in a table drawn from learning curves what they had spent."""
        return self.cell.outside or self.table.budget

    @property
    def amount(self) -> float | None:
        """Of the budget, or that of the row."""
        return self.budget.amount if self.row.amount is None or self.cell.is_external else self.row.amount


# references with every parameter stated; numbers in `unit`, of which more is better; None for what is not known
_COLUMNS: dict[str, Callable[[_Shown], Any]] = {
    "fidelity": lambda at: str(at.table.fidelity),
    "frames": lambda at: at.table.frames,
    "budget_kind": lambda at: at.budget.kind,
    "budget_amount": lambda at: at.amount,
    "env": lambda at: str(at.row.env),
    "task": lambda at: str(at.row.task),
    "design": lambda at: str(at.row.design),
    "controller": lambda at: str(at.entry.controller),
    "method": lambda at: str(at.entry.method),
    "mean": lambda at: at.cell.interval and at.cell.interval.mean,
    "low": lambda at: at.cell.interval and at.cell.interval.low,
    "high": lambda at: at.cell.interval and at.cell.interval.high,
    "unit": lambda at: at.cell.unit,
    "n": lambda at: at.cell.count,
    "asked": lambda at: at.cell.asked,
    "failed": lambda at: at.cell.states.get(RunState.FAILED, 0),
    "diverged": lambda at: at.cell.states.get(RunState.DIVERGED, 0),
    "timeout": lambda at: at.cell.states.get(RunState.TIMEOUT, 0),
    "unfinished": lambda at: sum(at.cell.states.get(state, 0) for state in OPEN_STATES),
    "missing": lambda at: at.cell.missing,
    "winner": lambda at: at.cell.is_winner,
    "normalised": lambda at: at.cell.normalised,
    "provisional": lambda at: bool(footnotes([at.row.env])),
    "undecided": lambda at: at.cell.is_undecided,
    "used": lambda at: at.cell.spent,
    "used_kind": lambda at: None if at.cell.spent is None else at.table.currency,
    "nonfinite": lambda at: at.cell.nonfinite,
    "wall_gap": lambda at: at.cell.wall_gap,
    "lasting_frames": lambda at: at.cell.lasting and at.cell.lasting.frames,
    "lasting_score": lambda at: at.cell.lasting and at.cell.lasting.score,
    "lasting_end": lambda at: at.cell.lasting and at.cell.lasting.end,
}


def long_listing(tables: Sequence[Table]) -> Listing:
    """All tables in long form, one row per cell, for programs.

    Tables drawn from learning curves show the amount spent in place of the budget. An agent from outside, which stands
    in every table of its row, comes once, with its own budget and a cost that is not known.
    """
    listing = listing_by(
        _COLUMNS,
        (
            _Shown(table, row, entry, cell)
            for table in tables
            for row in table.rows
            for entry, cell in zip(table.entries, row.cells, strict=True)
            if cell is not None
        ),
    )
    names = {"budget_kind": "spent_kind", "budget_amount": "spent_amount"}
    is_spent = any(isinstance(table.budget, Spending) for table in tables)
    columns = tuple(names.get(name, name) if is_spent else name for name in listing.columns)
    return Listing(columns, tuple(dict.fromkeys(listing.rows)))
