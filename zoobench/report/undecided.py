"""Differences that a fidelity cannot decide: marks at means too near to their row's best, footnotes on each, and on
bodies whose order is not known."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cache
from itertools import combinations, compress
from typing import Protocol

from zoobench.registry import Kind, short
from zoobench.report.tables import Row, Table
from zoobench.spec import Ref
from zoobench.tasks.scores import score_ratio


class KnownOrders(Protocol):
    """Which orders of two scores are known to hold at a fidelity."""

    @property
    def ratio(self) -> float | None:
        """The ratio of the scores above which they do; None if none is known."""

    @property
    def bodies(self) -> Sequence[str]:
        """The designs that were measured."""


OrdersOf = Callable[[Ref, Ref, Ref, bool], KnownOrders | None]
"""Those in an environment and task at a fidelity, of one body, or with True of two; None if none were compared."""


def mark_undecided(tables: Iterable[Table], orders_of: OrdersOf) -> list[Table]:
    """The tables with marks where the ratio to the row's best mean is below that which the fidelity decides.

    A row has one body, by whose gaits it is judged.
    """
    known = cache(orders_of)  # there are more rows than places
    return [
        replace(table, rows=tuple(_marked(row, known(row.env, row.task, table.fidelity, False)) for row in table.rows))
        for table in tables
    ]


def footnotes(tables: Sequence[Table], orders_of: OrdersOf) -> tuple[str, ...]:
    """A line for each environment, task and fidelity with a mark, and for each with bodies that have no known order."""
    places = {
        (row.env, row.task, table.fidelity)
        for table in tables
        for row in table.rows
        if any(cell is not None and cell.is_undecided for cell in row.cells)
    }
    marks = sorted(
        f"‡ {env.name} x {task.name}: {short(Kind.FIDELITY, fidelity)} cannot tell from the best "
        f"what is {_near(orders)}, as finer grids may reverse the order{_measured_on(orders)}"
        for env, task, fidelity in places
        if (orders := orders_of(env, task, fidelity, False)) is not None
    )
    return (*marks, *sorted({note for table in tables for note in _of_bodies(table, orders_of)}))


def _of_bodies(table: Table, orders_of: OrdersOf) -> Iterator[str]:
    """Notes on pairs of bodies whose order by their best means, those of one controller, is not known."""
    best: dict[tuple[Ref, Ref], dict[Ref, list[tuple[str, float]]]] = {}
    for row in table.rows:
        for controller in dict.fromkeys(entry.controller for entry in table.entries):
            own = [entry.controller == controller for entry in table.entries]
            if means := _means(replace(row, cells=tuple(compress(row.cells, own)))):
                place = best.setdefault((row.env, row.task), {})
                place.setdefault(controller, []).append((row.design.name, max(means)))
    unknown: dict[str, list[str]] = {}
    for (env, task), controllers in best.items():
        pairs = [pair for scores in controllers.values() for pair in combinations(sorted(scores), 2)]
        orders = orders_of(env, task, table.fidelity, True)
        if not pairs:
            continue
        if orders is None or orders.ratio is None:
            unknown.setdefault(env.name, []).append(task.name)
            continue
        near = [f"{one} and {two}" for (one, a), (two, b) in pairs if score_ratio(max(a, b), min(a, b)) < orders.ratio]
        if near:
            yield (
                f"{env.name} x {task.name}: {short(Kind.FIDELITY, table.fidelity)} tells the order of two bodies "
                f"above a ratio of {orders.ratio:.3g}{_measured_on(orders)}, not that of "
                f"{', '.join(dict.fromkeys(near))}"
            )
    if unknown:
        every = Counter(env.name for env, _ in best)
        where = [env if len(tasks) == every[env] else f"{env} x {', '.join(tasks)}" for env, tasks in unknown.items()]
        yield f"no order of two bodies is known at {short(Kind.FIDELITY, table.fidelity)}: {'; '.join(where)}"


def _near(orders: KnownOrders) -> str:
    return "worse" if orders.ratio is None else f"within {orders.ratio:.3g} times of it"


def _measured_on(orders: KnownOrders) -> str:
    return f" (measured on {', '.join(orders.bodies)})"


def _means(row: Row) -> list[float]:
    return [cell.interval.mean for cell in row.cells if cell is not None and cell.interval is not None]


def _marked(row: Row, orders: KnownOrders | None) -> Row:
    best = max(_means(row), default=0.0)
    if orders is None:
        return row
    ratio = orders.ratio

    def is_near(mean: float) -> bool:
        return mean < best and (ratio is None or score_ratio(best, mean) < ratio)

    cells = (
        replace(cell, is_undecided=True)
        if cell is not None and cell.interval is not None and is_near(cell.interval.mean)
        else cell
        for cell in row.cells
    )
    return replace(row, cells=tuple(cells))
