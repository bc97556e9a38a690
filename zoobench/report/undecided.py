"""Differences that a fidelity cannot decide: a mark at means too near to their row's best, and a footnote on each."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import cache

from zoobench.report.tables import Row, Table
from zoobench.spec import Ref
from zoobench.tasks.scores import score_ratio

Decides = Callable[[Ref, Ref, Ref], float | None]
"""The ratio of two scores in an environment and task, above which a fidelity gives their order; None if unknown."""


def mark_undecided(tables: Iterable[Table], decides: Decides) -> list[Table]:
    """The tables with marks where the ratio to the row's best mean is below that which the fidelity decides."""
    known = cache(decides)  # there are more rows than places
    return [
        replace(table, rows=tuple(_marked(row, known(row.env, row.task, table.fidelity)) for row in table.rows))
        for table in tables
    ]


def footnotes(tables: Sequence[Table], decides: Decides) -> tuple[str, ...]:
    """A line for each environment, task and fidelity with a mark."""
    places = {
        (row.env, row.task, table.fidelity)
        for table in tables
        for row in table.rows
        if any(cell is not None and cell.is_undecided for cell in row.cells)
    }
    return tuple(
        sorted(
            f"‡ {env.name} x {task.name}: {fidelity.name} cannot tell from the best what is within {ratio:.3g} times "
            "of it, as finer grids may reverse the order"
            for env, task, fidelity in places
            if (ratio := decides(env, task, fidelity)) is not None
        )
    )


def _marked(row: Row, ratio: float | None) -> Row:
    means = [None if cell is None or cell.interval is None else cell.interval.mean for cell in row.cells]
    best = max((mean for mean in means if mean is not None), default=0.0)
    if ratio is None:
        return row
    cells = tuple(
        replace(cell, is_undecided=True)
        if cell is not None and mean is not None and mean < best and score_ratio(best, mean) < ratio
        else cell
        for cell, mean in zip(row.cells, means, strict=True)
    )
    return replace(row, cells=cells)
