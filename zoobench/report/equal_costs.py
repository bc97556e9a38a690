"""Winners of rows whose methods have not spent the same: who led by no more than the others have spent.

Methods end with their last whole generation or iteration, so that of one budget some are left with a tenth. Whoever was
ahead before it had spent more than the others wins at equal costs.
"""

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from zoobench.report.cells import read_cells
from zoobench.report.curve import Curve, read_curves
from zoobench.report.statistics import clear_winner, t_interval
from zoobench.report.table_cell import TableCell, leader, rivals, won_by
from zoobench.report.tables import Row, Table, tables_of_cells
from zoobench.spec import BudgetKind, RunSelection

if TYPE_CHECKING:
    from zoobench.db.query import Reader

Curves = Callable[[Collection[int], BudgetKind], Mapping[int, Curve]]
"""The curves of runs, by id, by the amount spent in this currency, as far as they are known."""


def stored_tables(reader: "Reader", selection: RunSelection) -> list[Table]:
    """The tables of the selected runs of a database, with all winners marked.

    Raises:
        UsageError: a selector fits no run of the database, as `RunSelection.among`.
        StorageError: the database cannot be read.
    """
    return with_early_winners(reader, tables_of_cells(read_cells(reader, selection)))


def with_early_winners(reader: "Reader", tables: Iterable[Table]) -> list[Table]:
    """Tables of runs of a database, with the winners of rows of unlike costs marked, too.

    Raises:
        StorageError: the database cannot be read.
    """
    return mark_early_winners(tables, partial(read_curves, reader))


def mark_early_winners(tables: Iterable[Table], curves: Curves) -> list[Table]:
    """The tables; in rows of unlike costs the leader wins whose interval is above all others at the least cost."""
    return [_marked(table, curves) for table in tables]


def _marked(table: Table, curves: Curves) -> Table:
    leaders = [leader(row.cells) for row in table.rows]
    runs = [run for lead in leaders if lead is not None and not lead.is_winner for run in lead.runs]
    known = curves(runs, table.currency) if runs else {}
    rows = (
        row if lead is None or not _led_early(lead, row, known) else replace(row, cells=tuple(won_by(lead, row.cells)))
        for row, lead in zip(table.rows, leaders, strict=True)
    )
    return replace(table, rows=tuple(rows))


def _led_early(lead: TableCell, row: Row, known: Mapping[int, Curve]) -> bool:
    """Whether the interval of a row's leader lay above the others when no more had been spent than by any of them."""
    own = rivals(row.cells)
    costs = [cell.spent for cell in own if cell.interval is not None]
    spent = [cost for cost in costs if cost is not None]
    if len(spent) < len(costs) or not all(run in known for run in lead.runs):
        return False
    early = [known[run].at(min(spent)) for run in lead.runs]
    scores = [score for score in early if score is not None]
    winner = clear_winner([t_interval(scores) if cell is lead else cell.interval for cell in own])
    return len(scores) == len(early) and winner is not None and own[winner] is lead
