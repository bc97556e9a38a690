"""The results of each method's best solution on a leaderboard on a finer grid, and over more frames."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

from zoobench.registry import Kind
from zoobench.report.entries import entry_labels
from zoobench.report.labels import labels
from zoobench.report.lasting import Lasting
from zoobench.report.leaderboard import BoardRow, particles_per_cell
from zoobench.report.listing import Listing
from zoobench.report.provisional import marked
from zoobench.report.table_cell import TableCell
from zoobench.report.tables import Row, Table
from zoobench.spec import Ref
from zoobench.tasks.quantities import Quantity

DENSE = " °"
"""The mark at a score with more particles in a cell."""


class Confirmed(NamedTuple):
    """The score of a method's best solution, at home and on a finer grid; there minus infinity where it diverged.

    `is_dense` says that there were more particles in a cell, too.
    """

    home: float
    finer: float
    is_dense: bool


def mark_overturned(tables: Iterable[Table], rows: Sequence[BoardRow]) -> list[Table]:
    """The tables, whose runs are places in `rows` from 1, with marks at winners that do not win on a finer grid."""
    return [replace(table, rows=tuple(_marked(row, rows) for row in table.rows)) for table in tables]


def with_lasting(tables: Iterable[Table], known: Mapping[int, Lasting]) -> list[Table]:
    """The tables with the result of each cell's best solution over more frames, by the id of its run."""
    return [
        replace(
            table,
            rows=tuple(replace(row, cells=tuple(_lasting(cell, known) for cell in row.cells)) for row in table.rows),
        )
        for table in tables
    ]


def _lasting(cell: TableCell | None, known: Mapping[int, Lasting]) -> TableCell | None:
    best = None if cell is None else cell.best
    return cell if cell is None or best is None else replace(cell, lasting=known.get(best[0]))


def confirmation_listing(table: Table, rows: Sequence[BoardRow]) -> Listing:
    """A line for each row of which a method's best solution was evaluated on a finer grid; one alone has no order."""
    chosen = [(row, found) for row in table.rows if (found := _confirmed(row, rows))]
    names = {"env": marked(labels((row.env for row, _ in chosen), Kind.ENV))}
    names |= {axis: labels(getattr(row, axis) for row, _ in chosen) for axis in ("task", "design")}
    names_of = entry_labels(table.entries)
    quantity = table.quantity or Quantity(False, "")
    unit = f" [{quantity.unit}]" if quantity.unit else ""
    body = tuple(
        (
            *(names[axis][getattr(row, axis)] for axis in names),
            *(_text(found.get(place), quantity.sign) for place in range(len(table.entries))),
            _stands(found) if len(found) > 1 else "",
        )
        for row, found in chosen
    )
    return Listing((*names, *(f"{names_of[entry]}{unit}" for entry in table.entries), "order"), body)


def kept_orders(table: Table, rows: Sequence[BoardRow]) -> tuple[int, int]:
    """The number of pairs of solutions in one environment and task that keep their order, and the number of pairs.

    One that diverges comes last; two that do are no pair.
    """
    places: dict[tuple[Ref, Ref], list[Confirmed]] = {}
    for row in table.rows:
        places.setdefault((row.env, row.task), []).extend(_confirmed(row, rows).values())
    pairs = [pair for found in places.values() for pair in combinations(found, 2)]
    kept = [(a.home > b.home) == (a.finer > b.finer) for a, b in pairs if max(a.finer, b.finer) > -math.inf]
    return sum(kept), len(kept)


def _confirmed(row: Row, rows: Sequence[BoardRow]) -> dict[int, Confirmed]:
    """The best run of each method by its column, if that was evaluated on a finer grid."""
    found = {}
    for place, cell in enumerate(row.cells):
        chosen = None if cell is None else cell.best
        best = None if chosen is None else rows[chosen[0] - 1]
        if best is not None and best.finer is not None:
            score = best.finer.score
            is_dense = particles_per_cell(best.finer.fidelity) > particles_per_cell(best.spec.fidelity)
            found[place] = Confirmed(best.score, -math.inf if score is None else score, is_dense)
    return found


def _marked(row: Row, rows: Sequence[BoardRow]) -> Row:
    found = _confirmed(row, rows)
    first = next(iter(_order(found, "finer")), None)
    cells = tuple(
        replace(cell, is_overturned=True)
        if cell is not None and cell.is_winner and len(found) > 1 and place in found and place != first
        else cell
        for place, cell in enumerate(row.cells)
    )
    return replace(row, cells=cells)


def _order(found: Mapping[int, Confirmed], where: str) -> list[int]:
    """The methods from the best to the worst."""
    return sorted(found, key=lambda place: getattr(found[place], where), reverse=True)


def _stands(found: Mapping[int, Confirmed]) -> str:
    return "stands" if _order(found, "home") == _order(found, "finer") else "another"


def _text(found: Confirmed | None, sign: float) -> str:
    if found is None:
        return ""
    if found.finer == -math.inf:
        return f"{sign * found.home:.4g} → diverged"
    share = f" ({found.finer / found.home:z.0%})" if found.home > 0.0 else ""
    return f"{sign * found.home:.4g} → {sign * found.finer:.4g}{share}{DENSE * found.is_dense}"
