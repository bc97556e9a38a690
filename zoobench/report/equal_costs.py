"""Winners of rows whose methods have not spent the same: who led by no more than the others have spent.

Methods end with their last whole generation or iteration, so that of one budget some are left with a tenth. Whoever was
ahead before it had spent more than the others wins at equal costs.
"""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace

from zoobench.report.curve import Curve
from zoobench.report.statistics import clear_winner, t_interval
from zoobench.report.tables import Row, Table, TableCell, leader
from zoobench.spec import BudgetKind

Curves = Callable[[Collection[int], BudgetKind], Mapping[int, Curve]]
"""The curves of runs, by id, by the amount spent in this currency, as far as they are known."""


def mark_early_winners(tables: Iterable[Table], curves: Curves) -> list[Table]:
    """The tables; in rows of unlike costs the leader wins whose interval is above all others at the least cost."""
    return [_marked(table, curves) for table in tables]


def _marked(table: Table, curves: Curves) -> Table:
    leaders = [_leader(row.cells) for row in table.rows]
    runs = [run for lead in leaders if lead is not None for run in lead.runs]
    known = curves(runs, table.currency) if runs else {}
    rows = (row if lead is None else _settled(row, lead, known) for row, lead in zip(table.rows, leaders, strict=True))
    return replace(table, rows=tuple(rows))


def _leader(cells: Sequence[TableCell | None]) -> TableCell | None:
    """The leader of a row that it has not won yet."""
    place = leader(cells)
    found = None if place is None else cells[place]
    return None if found is None or found.is_winner else found


def _settled(row: Row, lead: TableCell, known: Mapping[int, Curve]) -> Row:
    costs = [cell.spent for cell in row.cells if cell is not None and cell.interval is not None]
    least = min((cost for cost in costs if cost is not None), default=None)
    if least is None or None in costs:
        return row
    early = [known[run].at(least) if run in known else None for run in lead.runs]
    scores = [score for score in early if score is not None]
    intervals = [
        t_interval(scores) if cell is lead else cell.interval if cell is not None else None for cell in row.cells
    ]
    place = clear_winner(intervals)
    if len(scores) < len(early) or place is None or row.cells[place] is not lead:
        return row
    return replace(row, cells=tuple(replace(lead, is_winner=True) if cell is lead else cell for cell in row.cells))
