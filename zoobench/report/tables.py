"""The tables of scores: one per fidelity, episode length and budget, since those are never mixed.

A row is an environment, task, design and controller; a column is a method; a cell is the mean over seeds with its
95 % Student-t interval, and what became of the seeds that gave no score.
"""

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from zoobench.db.rows import OPEN_STATES, RunState
from zoobench.report.labels import labels
from zoobench.report.listing import Listing
from zoobench.report.normalise import floor_of, shares
from zoobench.report.query import Result
from zoobench.report.statistics import Interval, clear_winner, t_interval
from zoobench.spec import Budget, Ref, RunSpec


@dataclass(frozen=True)
class Cell:
    """The seeds of one method in one row.

    Attributes:
        interval: over the runs that are DONE; None without any.
        unit: of the score.
        asked: the seeds that were asked for in this row, of whatever method.
        states: how many runs of the cell are in each state.
        is_winner: every seed is done and the interval lies above those of all other methods.
        missing: runs that are wanted here and do not exist.
        normalised: the mean between the row's references (0) and its best mean (1); None without either.
    """

    interval: Interval | None
    unit: str
    asked: int
    states: Mapping[RunState, int]
    is_winner: bool = False
    normalised: float | None = None
    missing: int = 0

    @property
    def is_empty(self) -> bool:
        """Whether no run exists."""
        return not self.states

    @property
    def count(self) -> int:
        """How many seeds stand behind the mean."""
        return 0 if self.interval is None else self.interval.count

    def text(self, normalised: bool = False) -> str:
        """For example `0.031 ± 0.004 m/s (n=3)` or `0.031 m/s (n=1 of 3, diverged 2/3)`; `missing` without any run.

        With `normalised`, `0.031 ± 0.004 m/s = 0.85 (n=3)`.
        """
        if self.is_empty:
            return "missing"
        notes = [f"n={self.count}" + (f" of {self.asked}" if self.count < self.asked else "")]
        notes += [
            f"{state} {number}/{self.asked}"
            for state, number in sorted(self.states.items())
            if state is not RunState.DONE
        ]
        if without := self.states.get(RunState.DONE, 0) - self.count:
            notes.append(f"done without a finite score {without}/{self.asked}")
        if self.missing:
            notes.append(f"missing {self.missing}/{self.asked}")
        share = f" = {self.normalised:.2f}" if normalised and self.normalised is not None else ""
        return f"{self._value()}{share} ({', '.join(notes)})"

    def _value(self) -> str:
        if self.interval is None:
            return "no score"
        spread = "" if self.interval.half_width is None else f" ± {self.interval.half_width:.2g}"
        return f"{self.interval.mean:.4g}{spread} {self.unit}".rstrip()


@dataclass(frozen=True)
class Row:
    """What the methods are compared on; `cells` has one entry per method of the table, None if it was not asked."""

    env: Ref
    task: Ref
    design: Ref
    controller: Ref
    cells: tuple[Cell | None, ...]

    @property
    def is_empty(self) -> bool:
        """Whether no run exists in any cell."""
        return all(cell is None or cell.is_empty for cell in self.cells)


@dataclass(frozen=True)
class Table:
    """All rows of one fidelity, episode length [control frames] and budget."""

    fidelity: Ref
    frames: int
    budget: Budget
    methods: tuple[Ref, ...]
    rows: tuple[Row, ...]

    @property
    def title(self) -> str:
        """The settings that all numbers of the table share."""
        return f"fidelity {self.fidelity.name}, budget {self.budget}, {self.frames} frames"


_Wanted = tuple[RunSpec, Result | None]
"""A run that was asked for, and its result; None if it does not exist."""


def score_tables(results: Iterable[Result], missing: Iterable[RunSpec] = ()) -> list[Table]:
    """The tables of these results, sorted by name, so that equal data give equal text.

    Smoke runs and probes are left out. Runs that were skipped, because a method cannot be used there, count as not
    asked for. `missing` are wanted and do not exist: they are shown as such, and nobody wins a row that lacks one.
    """
    settings: dict[tuple[Ref, int, Budget], list[_Wanted]] = {}
    counted = [
        result for result in results if not (result.is_smoke or result.is_probe or result.run.state is RunState.SKIPPED)
    ]
    wanted: list[_Wanted] = [(result.run.spec, result) for result in counted]
    wanted += [(spec, None) for spec in missing]
    for spec, result in wanted:
        settings.setdefault((spec.fidelity, spec.frames, spec.budget), []).append((spec, result))
    return [
        _table(*setting, members)
        for setting, members in sorted(settings.items(), key=lambda item: tuple(map(str, item[0])))
    ]


def table_listing(table: Table, normalised: bool = False) -> Listing:
    """The table as a person reads it: methods side by side, winners marked, with normalised scores if asked for."""
    names = {axis: labels(getattr(row, axis) for row in table.rows) for axis in ("env", "task", "design", "controller")}
    # The controller is a column only where it tells rows apart.
    axes = [axis for axis in names if axis != "controller" or len(names[axis]) > 1]
    methods = labels(table.methods)
    rows = [
        (
            *(names[axis][getattr(row, axis)] for axis in axes),
            *("" if cell is None else cell.text(normalised) for cell in row.cells),
        )
        for row in table.rows
    ]
    winners = {
        (number, len(axes) + place)
        for number, row in enumerate(table.rows)
        for place, cell in enumerate(row.cells)
        if cell is not None and cell.is_winner
    }
    columns = (*axes, *(methods[method] for method in table.methods))
    return Listing(columns, tuple(rows), frozenset(winners))


def long_listing(tables: Sequence[Table]) -> Listing:
    """All tables in long form, one row per cell, for programs; references with every parameter stated."""
    columns = (
        "fidelity", "frames", "budget_kind", "budget_amount", "env", "task", "design", "controller", "method",
        "mean", "low", "high", "unit", "n", "asked", "failed", "diverged", "timeout", "unfinished",
        "missing", "winner", "normalised",
    )  # fmt: skip
    rows = [
        _long_row(table, row, method, cell)
        for table in tables
        for row in table.rows
        for method, cell in zip(table.methods, row.cells, strict=True)
        if cell is not None
    ]
    return Listing(columns, tuple(rows))


def _long_row(table: Table, row: Row, method: Ref, cell: Cell) -> tuple[Any, ...]:
    interval = cell.interval
    states = cell.states
    return (
        str(table.fidelity), table.frames, table.budget.kind, table.budget.amount,
        str(row.env), str(row.task), str(row.design), str(row.controller), str(method),
        interval and interval.mean, interval and interval.low, interval and interval.high, cell.unit,
        cell.count, cell.asked,
        states.get(RunState.FAILED, 0), states.get(RunState.DIVERGED, 0), states.get(RunState.TIMEOUT, 0),
        sum(states.get(state, 0) for state in OPEN_STATES), cell.missing, cell.is_winner, cell.normalised,
    )  # fmt: skip


def _table(fidelity: Ref, frames: int, budget: Budget, members: list[_Wanted]) -> Table:
    methods = tuple(sorted({spec.method for spec, _ in members}, key=str))
    grouped: dict[tuple[Ref, Ref, Ref, Ref], list[_Wanted]] = {}
    for spec, result in members:
        grouped.setdefault(_row_key(spec), []).append((spec, result))
    rows = [
        Row(*key, _cells(group, methods))
        for key, group in sorted(grouped.items(), key=lambda item: tuple(map(str, item[0])))
    ]
    return Table(fidelity, frames, budget, methods, tuple(rows))


def _row_key(spec: RunSpec) -> tuple[Ref, Ref, Ref, Ref]:
    return spec.env, spec.task, spec.design, spec.controller


def _cells(group: list[_Wanted], methods: tuple[Ref, ...]) -> tuple[Cell | None, ...]:
    asked = len({spec.seed for spec, _ in group})
    by_method = [[result for spec, result in group if spec.method == method] for method in methods]
    cells = [_cell(members, asked) if members else None for members in by_method]
    best = clear_winner([None if cell is None else cell.interval for cell in cells])
    is_complete = not any(cell is not None and cell.missing for cell in cells)
    if best is not None and is_complete and (winner := cells[best]) is not None and winner.count == winner.asked:
        cells[best] = replace(winner, is_winner=True)
    means = [None if cell is None or cell.interval is None else cell.interval.mean for cell in cells]
    lots = shares(means, floor_of(result for _, result in group if result is not None))
    return tuple(cell and replace(cell, normalised=share) for cell, share in zip(cells, lots, strict=True))


def _cell(members: list[Result | None], asked: int) -> Cell:
    results = [result for result in members if result is not None]
    scores = [result.score for result in results if result.run.state is RunState.DONE]
    found = [score for score in scores if score is not None and math.isfinite(score.value)]
    units = sorted({score.unit for score in found})
    states = Counter(result.run.state for result in results)
    interval = t_interval([score.value for score in found])
    return Cell(interval, ", ".join(units), asked, states, missing=len(members) - len(results))
