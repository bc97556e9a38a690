"""Differences that a fidelity cannot decide: marks at means too near to their row's best, footnotes on each, and on
bodies whose order is not known."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from itertools import combinations
from typing import Protocol

from zoobench.report.tables import Row, Table
from zoobench.spec import Ref
from zoobench.tasks.scores import score_ratio


class KnownLevel(Protocol):
    """What is known of scores in an environment and task at a fidelity, and by which bodies."""

    @property
    def bodies(self) -> Mapping[str, object]:
        """The designs that were measured."""

    @property
    def decides(self) -> float | None:
        """The ratio of two scores of one body above which their order is known; None if none is."""

    @property
    def decides_across(self) -> float | None:
        """Likewise of two bodies."""


Levels = Callable[[Ref, Ref, Ref], KnownLevel | None]
"""The level of an environment, a task and a fidelity; None if it was not measured."""


def mark_undecided(tables: Iterable[Table], levels: Levels) -> list[Table]:
    """The tables with marks where the ratio to the row's best mean is below that which the fidelity decides.

    A row has one body, by whose gaits it is judged.
    """
    known = cache(levels)  # there are more rows than places
    return [
        replace(table, rows=tuple(_marked(row, known(row.env, row.task, table.fidelity)) for row in table.rows))
        for table in tables
    ]


def footnotes(tables: Sequence[Table], levels: Levels) -> tuple[str, ...]:
    """A line for each environment, task and fidelity with a mark, and for each with bodies that have no known order."""
    places = {
        (row.env, row.task, table.fidelity)
        for table in tables
        for row in table.rows
        if any(cell is not None and cell.is_undecided for cell in row.cells)
    }
    marks = sorted(
        f"‡ {env.name} x {task.name}: {fidelity.name} cannot tell from the best what is within {level.decides:.3g} "
        f"times of it, as finer grids may reverse the order{_measured_on(level)}"
        for env, task, fidelity in places
        if (level := levels(env, task, fidelity)) is not None and level.decides is not None
    )
    return (*marks, *sorted({note for table in tables for note in _of_bodies(table, levels)}))


def _of_bodies(table: Table, levels: Levels) -> Iterator[str]:
    """What is not known of the order of bodies by their best means, those of one controller."""
    best: dict[tuple[Ref, Ref], dict[Ref, list[tuple[str, float]]]] = {}
    for row in table.rows:
        if means := _means(row):
            place = best.setdefault((row.env, row.task), {})
            place.setdefault(row.controller, []).append((row.design.name, max(means)))
    unknown: dict[str, list[str]] = {}
    for (env, task), controllers in best.items():
        pairs = [pair for scores in controllers.values() for pair in combinations(sorted(scores), 2)]
        level = levels(env, task, table.fidelity)
        if not pairs:
            continue
        if level is None or level.decides_across is None:
            unknown.setdefault(env.name, []).append(task.name)
            continue
        ratio = level.decides_across
        near = [f"{one} and {two}" for (one, a), (two, b) in pairs if score_ratio(max(a, b), min(a, b)) < ratio]
        if near:
            yield (
                f"{env.name} x {task.name}: {table.fidelity.name} tells the order of two bodies above a ratio of "
                f"{ratio:.3g}{_measured_on(level)}, not that of {', '.join(dict.fromkeys(near))}"
            )
    if unknown:
        every = Counter(env.name for env, _ in best)
        where = [env if len(tasks) == every[env] else f"{env} x {', '.join(tasks)}" for env, tasks in unknown.items()]
        yield f"whether {table.fidelity.name} tells the order of two bodies is not known: {'; '.join(where)}"


def _measured_on(level: KnownLevel) -> str:
    return f" (measured on {', '.join(sorted(level.bodies))})"


def _means(row: Row) -> list[float]:
    return [cell.interval.mean for cell in row.cells if cell is not None and cell.interval is not None]


def _marked(row: Row, level: KnownLevel | None) -> Row:
    best = max(_means(row), default=0.0)
    if level is None or level.decides is None:
        return row
    ratio = level.decides

    def is_near(mean: float) -> bool:
        return mean < best and score_ratio(best, mean) < ratio

    cells = (
        replace(cell, is_undecided=True)
        if cell is not None and cell.interval is not None and is_near(cell.interval.mean)
        else cell
        for cell in row.cells
    )
    return replace(row, cells=tuple(cells))
