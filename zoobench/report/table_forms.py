"""Tables of scores in the forms in which they are printed."""

from collections.abc import Sequence
from dataclasses import dataclass

from zoobench.db.rows import OPEN_STATES, RunState
from zoobench.registry import Kind
from zoobench.report.entries import Entry, entry_labels
from zoobench.report.labels import labels
from zoobench.report.lasting import COLUMN
from zoobench.report.listing import Listing, Measured, listing_of
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
            *(_shown(cell, table, row, normalised) for cell in row.cells),
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
                    *(None if row is None else _shown(cell, table, row, normalised)
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


def _shown(cell: TableCell | None, table: Table, row: Row, normalised: bool) -> Measured | None:
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


@dataclass(frozen=True)
class CellRow:
    """A cell of a table for programs; references with every parameter stated.

    Attributes:
        budget_kind, budget_amount: of the runs; in tables drawn from learning curves the amount spent.
        mean, low, high: of the scores and their 95 % interval, in `unit`; more is better.
        n, asked: seeds behind the mean, and those asked for.
        normalised: the mean between the references (0) and the best (1) of the row.
        used, used_kind: the amount spent, on average; None where it is not known.
        nonfinite: share of gradients that were not finite.
        wall_gap: smallest distance from a side of the arena [cells].
    """

    fidelity: str
    frames: int
    budget_kind: str
    budget_amount: float | None
    env: str
    task: str
    design: str
    controller: str
    method: str
    mean: float | None
    low: float | None
    high: float | None
    unit: str
    n: int
    asked: int
    failed: int
    diverged: int
    timeout: int
    unfinished: int
    missing: int
    winner: bool
    normalised: float | None
    provisional: bool
    undecided: bool
    used: float | None
    used_kind: str | None
    nonfinite: float
    wall_gap: float | None
    lasting_frames: int | None
    lasting_score: float | None
    lasting_end: str | None


def long_listing(tables: Sequence[Table]) -> Listing:
    """All tables in long form, one row per cell, for programs.

    Tables drawn from learning curves show the amount spent in place of the budget. An agent from outside, which stands
    in every table of its row, comes once, with its own budget and a cost that is not known.
    """
    rows = (
        _long_row(table, row, entry, cell)
        for table in tables
        for row in table.rows
        for entry, cell in zip(table.entries, row.cells, strict=True)
        if cell is not None
    )
    listing = listing_of(CellRow, dict.fromkeys(rows))
    if any(isinstance(table.budget, Spending) for table in tables):
        names = {"budget_kind": "spent_kind", "budget_amount": "spent_amount"}
        return Listing(tuple(names.get(name, name) for name in listing.columns), listing.rows)
    return listing


def _long_row(table: Table, row: Row, entry: Entry, cell: TableCell) -> CellRow:
    states, mean, last = cell.states, cell.interval, cell.lasting
    budget = cell.outside or table.budget
    return CellRow(
        fidelity=str(table.fidelity),
        frames=table.frames,
        budget_kind=budget.kind,
        budget_amount=budget.amount if row.amount is None or cell.is_external else row.amount,
        env=str(row.env),
        task=str(row.task),
        design=str(row.design),
        controller=str(entry.controller),
        method=str(entry.method),
        mean=None if mean is None else mean.mean,
        low=None if mean is None else mean.low,
        high=None if mean is None else mean.high,
        unit=cell.unit,
        n=cell.count,
        asked=cell.asked,
        failed=states.get(RunState.FAILED, 0),
        diverged=states.get(RunState.DIVERGED, 0),
        timeout=states.get(RunState.TIMEOUT, 0),
        unfinished=sum(states.get(state, 0) for state in OPEN_STATES),
        missing=cell.missing,
        winner=cell.is_winner,
        normalised=cell.normalised,
        provisional=bool(footnotes([row.env])),
        undecided=cell.is_undecided,
        used=cell.spent,
        used_kind=table.currency if cell.spent is not None else None,
        nonfinite=cell.nonfinite,
        wall_gap=cell.wall_gap,
        lasting_frames=None if last is None else last.frames,
        lasting_score=None if last is None else last.score,
        lasting_end=None if last is None else last.end,
    )
