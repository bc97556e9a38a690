"""Tables of scores in the forms in which they are printed."""

from collections.abc import Sequence
from typing import Any

from zoobench.db.rows import OPEN_STATES, RunState
from zoobench.report.labels import labels
from zoobench.report.lasting import COLUMN
from zoobench.report.listing import Listing
from zoobench.report.provisional import footnotes, marked
from zoobench.report.tables import Row, Spending, Table, TableCell, spent_alike
from zoobench.spec import Budget, Ref


def table_listing(table: Table, normalised: bool = False) -> Listing:
    """The table as a person reads it: methods side by side, winners marked, with normalised scores if asked for."""
    names = {axis: labels(getattr(row, axis) for row in table.rows) for axis in ("env", "task", "design", "controller")}
    names["env"] = marked(names["env"])
    # The controller is a column only where it tells rows apart.
    axes = [axis for axis in names if axis != "controller" or len(names[axis]) > 1]
    methods = labels(table.methods)
    # The amount spent is a column only where it is not in the title.
    spent = [table.budget] if isinstance(table.budget, Spending) and table.budget.amount is None else []
    is_uneven = any(_is_uneven(table, row) for row in table.rows)
    lasts = any(_lasts(row.cells) for row in table.rows)
    rows = [
        (
            *(names[axis][getattr(row, axis)] for axis in axes),
            *(None if row.amount is None else spending.text(row.amount) for spending in spent),
            *("" if cell is None else cell.text(normalised) for cell in row.cells),
            *([_lasting_text(row.cells)] if lasts else []),
            *([] if not is_uneven else [_spent_text(row) if _is_uneven(table, row) else None]),
        )
        for row in table.rows
    ]
    winners = {
        (number, len(axes) + len(spent) + place)
        for number, row in enumerate(table.rows)
        for place, cell in enumerate(row.cells)
        if cell is not None and cell.is_winner
    }
    columns = (
        *axes,
        *(f"at [{spending.unit}]" for spending in spent),
        *(methods[method] for method in table.methods),
        *([COLUMN] if lasts else []),
        *([f"spent [{table.currency}]"] if is_uneven else []),
    )
    return Listing(columns, tuple(rows), frozenset(winners))


def pivot_listing(table: Table, normalised: bool = False) -> Listing:
    """The table with environments side by side: a row for each task, design, controller and method."""
    envs = marked(labels(row.env for row in table.rows))
    axes = ("task", "design", "controller")
    names = {axis: labels(getattr(row, axis) for row in table.rows) for axis in axes}
    shown = [axis for axis in axes if axis != "controller" or len(names[axis]) > 1]
    methods = labels(table.methods)
    places = list(dict.fromkeys((row.task, row.design, row.controller) for row in table.rows))
    cells = {
        (row.task, row.design, row.controller, method, row.env): cell
        for row in table.rows
        for method, cell in zip(table.methods, row.cells, strict=True)
    }
    # what was spent is told where the methods of a row differ in it, as in `table_listing`
    uneven = {(row.env, row.task, row.design, row.controller) for row in table.rows if _is_uneven(table, row)}
    lasts = any(_lasts(row.cells) for row in table.rows)
    rows: list[tuple[str | None, ...]] = []
    winners = set()
    for place in places:
        words = [names[axis][ref] for axis, ref in zip(axes, place, strict=True) if axis in shown]
        for method in table.methods:
            found = [cells.get((*place, method, env)) for env in envs]
            if any(found):
                won = (column for column, cell in enumerate(found) if cell is not None and cell.is_winner)
                winners |= {(len(rows), len(shown) + 1 + column) for column in won}
                told = [
                    _amount(cell) if (env, *place) in uneven else "-" for env, cell in zip(envs, found, strict=True)
                ]
                spent = [None if set(told) == {"-"} else " / ".join(told)] if uneven else []
                texts = ("" if cell is None else cell.text(normalised) for cell in found)
                lasting = [_lasting_text(found)] if lasts else []
                rows.append((*words, methods[method], *texts, *lasting, *spent))
    columns = (
        *shown,
        "method",
        *envs.values(),
        *([COLUMN] if lasts else []),
        *([f"spent [{table.currency}]"] if uneven else []),
    )
    return Listing(columns, tuple(rows), frozenset(winners))


def _is_uneven(table: Table, row: Row) -> bool:
    """Whether methods have spent unlike amounts, which are shown."""
    return isinstance(table.budget, Budget) and table.budget.kind != "seconds" and not spent_alike(row.cells)


def _lasts(cells: Sequence[TableCell | None]) -> bool:
    """Whether a solution was evaluated over more frames."""
    return any(cell is not None and cell.lasting is not None for cell in cells)


def _lasting_text(cells: Sequence[TableCell | None]) -> str | None:
    """What the best solutions of these cells do over more frames, in their order."""
    return " / ".join(map(_after, cells)) if _lasts(cells) else None


def _after(cell: TableCell | None) -> str:
    if cell is None or cell.lasting is None or cell.best is None:
        return "?"
    return cell.lasting.text(cell.best[1])


def _spent_text(row: Row) -> str:
    """What each method of a row has spent, in their order."""
    return " / ".join(map(_amount, row.cells))


def _amount(cell: TableCell | None) -> str:
    return "?" if cell is None or cell.spent is None else f"{cell.spent:,.0f}"


def long_listing(tables: Sequence[Table]) -> Listing:
    """All tables in long form, one row per cell, for programs; references with every parameter stated.

    Tables drawn from learning curves say what was spent in place of the budget.
    """
    what = "spent" if any(isinstance(table.budget, Spending) for table in tables) else "budget"
    columns = (
        "fidelity", "frames", f"{what}_kind", f"{what}_amount", "env", "task", "design", "controller", "method",
        "mean", "low", "high", "unit", "n", "asked", "failed", "diverged", "timeout", "unfinished",
        "missing", "winner", "normalised", "provisional", "undecided", "used", "used_kind", "nonfinite",
        "wall_gap", "lasting_frames", "lasting_score", "lasting_end",
    )  # fmt: skip
    rows = [
        _long_row(table, row, method, cell)
        for table in tables
        for row in table.rows
        for method, cell in zip(table.methods, row.cells, strict=True)
        if cell is not None
    ]
    return Listing(columns, tuple(rows))


def _long_row(table: Table, row: Row, method: Ref, cell: TableCell) -> tuple[Any, ...]:
    interval = cell.interval
    states = cell.states
    return (
        str(table.fidelity), table.frames, table.budget.kind, row.amount or table.budget.amount,
        str(row.env), str(row.task), str(row.design), str(row.controller), str(method),
        interval and interval.mean, interval and interval.low, interval and interval.high, cell.unit,
        cell.count, cell.asked,
        states.get(RunState.FAILED, 0), states.get(RunState.DIVERGED, 0), states.get(RunState.TIMEOUT, 0),
        sum(states.get(state, 0) for state in OPEN_STATES), cell.missing, cell.is_winner, cell.normalised,
        bool(footnotes([row.env])), cell.is_undecided, cell.spent, table.currency if cell.spent is not None else None,
        cell.nonfinite, cell.wall_gap,
        *((None, None, None) if (last := cell.lasting) is None else (last.frames, last.score, last.end)),
    )  # fmt: skip
