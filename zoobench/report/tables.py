"""The tables of scores: one per fidelity, episode length and budget, since those are never mixed.

A row is an environment, task, design and controller; a column is a method; a cell is the mean over seeds with its
95 % Student-t interval, and what became of the seeds that gave no score.
"""

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeVar

from zoobench.db.rows import OPEN_STATES, RunState
from zoobench.report.cells import Cell, Outcome, cells_of, comparable
from zoobench.report.lasting import Lasting
from zoobench.report.normalise import floor_of, run_shares, shares
from zoobench.report.run_results import RunResult
from zoobench.report.statistics import Interval, clear_winner, t_interval
from zoobench.spec import Budget, BudgetKind, Ref, RunSpec, currency, is_at_wall, repeat_command, standing

_FEW = 0.01  # share of gradients that may not be finite without a note
_ALIKE = 0.05  # share of the largest amount spent by which others may be below it for a fair comparison


@dataclass(frozen=True)
class TableCell:
    """The seeds of one method in one row.

    Attributes:
        interval: over the runs that are DONE; None without any.
        unit: of the score.
        asked: the seeds that were asked for in this row, of whatever method.
        states: how many runs of the cell are in each state.
        lacks: how many that are DONE have no score, by why.
        is_undecided: whether the fidelity is too coarse to tell the mean from the row's best.
        is_winner: every seed is done, nothing of the row is still to come, the interval lies above those of all other
            methods, and did so when no more had been spent than by each of them; its robots kept away from the sides
            of the arena, as far as that is known.
        is_overturned: whether it wins and another method's best solution beats its own on a finer grid.
        missing: runs that are wanted here and do not exist.
        normalised: the mean between the row's references (0) and its best mean (1); None without either.
        runs: the ids of those behind the mean.
        spent: by those, on average, in the unit of `Table.currency`; None if it is not known.
        scores: of those.
        nonfinite: share of the gradients of those that were not finite, mean over runs.
        shares: those scores between the row's references (0) and its best mean (1), below 0 where they are worse;
            empty without either.
        gaps: how near the robots of those came to a side of the arena [cells]; None where it is not known.
        lasting: what the best solution does over more frames; None if it was not evaluated.
    """

    interval: Interval | None
    unit: str
    asked: int
    states: Mapping[RunState, int]
    is_winner: bool = False
    normalised: float | None = None
    missing: int = 0
    lacks: Mapping[str, int] = field(default_factory=dict)
    is_undecided: bool = False
    is_overturned: bool = False
    runs: tuple[int, ...] = ()
    spent: float | None = None
    scores: tuple[float, ...] = ()
    shares: tuple[float, ...] = ()
    nonfinite: float = 0.0
    gaps: tuple[float | None, ...] = ()
    lasting: Lasting | None = None

    @property
    def wall_gap(self) -> float | None:
        """The smallest of the known gaps [cells]; None if none is."""
        return min((gap for gap in self.gaps if gap is not None), default=None)

    @property
    def is_at_wall(self) -> bool:
        """Whether a robot came so near to a side of the arena that this has a part in its score: no winner then."""
        return is_at_wall(self.wall_gap)

    @property
    def best(self) -> tuple[int, float] | None:
        """The id and score of the best run, as `zoobench.spec.standing`; None without a score."""
        found = zip(self.runs, self.scores, self.gaps or (None,) * len(self.runs), strict=True)
        ranked = [(standing(score, gap), -run) for run, score, gap in found]
        if not ranked:
            return None
        (_, score), run = max(ranked)
        return -run, score

    @property
    def is_empty(self) -> bool:
        """Whether no run exists."""
        return not self.states

    @property
    def is_unfinished(self) -> bool:
        """Whether a run is still to come: until then nobody wins the row."""
        return self.missing > 0 or any(state in OPEN_STATES for state in self.states)

    @property
    def count(self) -> int:
        """Number of seeds behind the mean."""
        return 0 if self.interval is None else self.interval.count

    def text(self, normalised: bool = False) -> str:
        """For example `0.031 ± 0.004 m/s (n=3)` or `0.031 m/s (n=1 of 3, diverged 2/3)`; `missing` without any run.

        With `normalised`, `0.031 ± 0.004 m/s = 0.85 (n=3)`.
        """
        if self.is_empty:
            return "missing"
        notes = [f"n={self.count}" + (f" of {self.asked}" if self.count < self.asked else "")]
        if self.interval is not None and self.interval.half_width is None and self.count > 1:
            notes.append("all equal")
        notes += [
            f"{state} {number}/{self.asked}"
            for state, number in sorted(self.states.items())
            if state is not RunState.DONE
        ]
        notes += [f"{reason} {number}/{self.asked}" for reason, number in sorted(self.lacks.items())]
        if self.missing:
            notes.append(f"missing {self.missing}/{self.asked}")
        if self.nonfinite >= _FEW:
            notes.append(f"{self.nonfinite:.0%} of gradients not finite")
        share = f" = {self.normalised:.2f}" if normalised and self.normalised is not None else ""
        return f"{self._value()}{share} ({', '.join(notes)})"

    def _value(self) -> str:
        if self.interval is None:
            return "no score"
        spread = "" if self.interval.half_width is None else f" ± {self.interval.half_width:.2g}"
        mark = " ‡" * self.is_undecided + " §" * self.is_overturned + " ‖" * self.is_at_wall
        return f"{self.interval.mean:.4g}{spread} {self.unit}".rstrip() + mark


@dataclass(frozen=True)
class Spending:
    """The amount spent at which the scores of a table were read from learning curves.

    Attributes:
        kind: the currency.
        amount: as it was asked for; None for the largest that all runs of a row have reached, in each row.
        budgets: the runs' own.
    """

    kind: BudgetKind
    amount: float | None
    budgets: tuple[Budget, ...]

    @property
    def unit(self) -> str:
        """Of amounts."""
        return "s" if self.kind == "seconds" else self.kind

    def text(self, amount: float) -> str:
        """An amount as a person reads it: counts whole, times short."""
        return f"{amount:.6g}" if self.kind == "seconds" else f"{amount:.10g}"

    def __str__(self) -> str:
        amount = f"equal {self.kind}" if self.amount is None else f"{self.text(self.amount)} {self.unit}"
        own = " and ".join(map(str, self.budgets))
        return f"best so far at {amount}, of runs with a budget of {own}"


@dataclass(frozen=True)
class Row:
    """A row of a table; `cells` has one for each method of the table, None if it was not asked for.

    `amount` is the amount that each run had spent, in a table drawn from learning curves.
    """

    env: Ref
    task: Ref
    design: Ref
    controller: Ref
    cells: tuple[TableCell | None, ...]
    amount: float | None = None

    @property
    def is_empty(self) -> bool:
        """Whether no run exists in any cell."""
        return all(cell is None or cell.is_empty for cell in self.cells)


@dataclass(frozen=True)
class Table:
    """All rows of one fidelity, episode length [control frames] and budget, or amount spent of whatever budgets."""

    fidelity: Ref
    frames: int
    budget: Budget | Spending
    methods: tuple[Ref, ...]
    rows: tuple[Row, ...]

    @property
    def currency(self) -> BudgetKind:
        """The unit of what its runs have spent: substeps unless the budget counts something else."""
        return currency(self.budget.kind)

    @property
    def runs(self) -> list[int]:
        """The ids of the runs that made its numbers."""
        return [run for row in self.rows for cell in row.cells if cell is not None for run in cell.runs]

    @property
    def title(self) -> str:
        """The settings that all numbers of the table share."""
        spent = f"budget {self.budget}" if isinstance(self.budget, Budget) else str(self.budget)
        return f"fidelity {self.fidelity.name}, {spent}, {self.frames} frames"


def score_tables(results: Iterable[RunResult], missing: Iterable[RunSpec] = ()) -> list[Table]:
    """The tables of these results, as `tables_of_cells`; `missing` are wanted and do not exist."""
    return tables_of_cells(cells_of(results, missing))


def tables_of_cells(cells: Iterable[Cell]) -> list[Table]:
    """The tables of these cells, sorted by name, so that equal data give equal text.

    Smoke runs and probes are left out. Runs that were skipped, because a method cannot be used there, count as not
    asked for. Those that are wanted and do not exist are shown as such, and nobody wins a row that lacks one.
    """
    settings: dict[tuple[Ref, int, Budget], list[Cell]] = {}
    for cell in comparable(cells):
        spec = cell.spec
        settings.setdefault((spec.fidelity, spec.frames, spec.budget), []).append(cell)
    return [
        _table(*setting, members)
        for setting, members in sorted(settings.items(), key=lambda item: tuple(map(str, item[0])))
    ]


def _table(fidelity: Ref, frames: int, budget: Budget, cells: list[Cell]) -> Table:
    methods = methods_of(cell.spec for cell in cells)
    is_even = budget.kind == "seconds"
    rows = [Row(*key, compare(group, methods, is_even=is_even)) for key, group in in_rows(cells)]
    return Table(fidelity, frames, budget, methods, tuple(rows))


def methods_of(specs: Iterable[RunSpec]) -> tuple[Ref, ...]:
    """The columns of a table."""
    return tuple(sorted({spec.method for spec in specs}, key=str))


def repeat_commands(table: Table, specs: Iterable[RunSpec]) -> list[str]:
    """The command that repeats each row of a table; empty where none of the specs belongs to it."""
    own: dict[tuple[Ref, ...], list[RunSpec]] = {}
    for spec in specs:
        is_here = (spec.fidelity, spec.frames, spec.budget) == (table.fidelity, table.frames, table.budget)
        if is_here and spec.method in table.methods:
            own.setdefault((spec.env, spec.task, spec.design, spec.controller), []).append(spec)
    found = (own.get((row.env, row.task, row.design, row.controller), []) for row in table.rows)
    return [repeat_command(*members) if members else "" for members in found]


S = TypeVar("S", Cell, RunResult)


def in_rows(members: Iterable[S]) -> list[tuple[tuple[Ref, Ref, Ref, Ref], list[S]]]:
    """The members of each row of a table, by environment, task, design and controller; sorted by name."""
    grouped: dict[tuple[Ref, Ref, Ref, Ref], list[S]] = {}
    for member in members:
        spec = member.spec
        grouped.setdefault((spec.env, spec.task, spec.design, spec.controller), []).append(member)
    return sorted(grouped.items(), key=lambda item: tuple(map(str, item[0])))


def compare(group: Sequence[Cell], methods: tuple[Ref, ...], *, is_even: bool) -> tuple[TableCell | None, ...]:
    """The cells of a row, the winner marked; `is_even` says that all have spent the same, whatever they simulated."""
    outcomes = [outcome for cell in group for outcome in cell.outcomes]
    asked = len({outcome.seed for outcome in outcomes})
    by_method = {
        method: [outcome for cell in group if cell.spec.method == method for outcome in cell.outcomes]
        for method in methods
    }
    cells = [_cell(members, asked) if members else None for members in by_method.values()]
    lead = leader(cells)
    if lead is not None and (is_even or spent_alike(cells)):
        cells = won_by(lead, cells)
    means = [None if cell is None or cell.interval is None else cell.interval.mean for cell in cells]
    floor = floor_of(outcome.floor for outcome in outcomes)
    lots = shares(means, floor)
    best_mean = max((mean for mean in means if mean is not None), default=None)
    return tuple(
        cell and replace(cell, normalised=share, shares=run_shares(cell.scores, floor, best_mean))
        for cell, share in zip(cells, lots, strict=True)
    )


def leader(cells: Sequence[TableCell | None]) -> TableCell | None:
    """The cell whose interval lies above all others, all its seeds done and away from walls; None if a run of the row
    is to come."""
    if any(cell is not None and cell.is_unfinished for cell in cells):
        return None
    best = clear_winner([None if cell is None else cell.interval for cell in cells])
    found = None if best is None else cells[best]
    is_whole = found is not None and found.count == found.asked
    return found if found is not None and is_whole and not found.is_at_wall else None


def won_by(winner: TableCell, cells: Iterable[TableCell | None]) -> list[TableCell | None]:
    """The cells of a row with the mark of its winner, which is one of them."""
    return [replace(winner, is_winner=True) if cell is winner else cell for cell in cells]


def spent_alike(cells: Iterable[TableCell | None]) -> bool:
    """Whether what the methods of a row have spent differs by less than `_ALIKE`; one with a score must say it."""
    spent = [cell.spent for cell in cells if cell is not None and cell.interval is not None]
    known = [amount for amount in spent if amount is not None]
    return len(spent) < 2 or (len(known) == len(spent) and max(known) - min(known) < _ALIKE * max(known))


def _cell(outcomes: Sequence[Outcome], asked: int) -> TableCell:
    done = [outcome for outcome in outcomes if outcome.state is RunState.DONE]
    scored = [(outcome.score, outcome) for outcome in done if outcome.score is not None]
    units = sorted({outcome.unit for _, outcome in scored})
    states = Counter(outcome.state for outcome in outcomes if outcome.state is not None)
    lacks = Counter(outcome.lacks for outcome in done if outcome.score is None)
    scores = tuple(score for score, _ in scored)
    runs = tuple(outcome.run for _, outcome in scored)
    gaps = tuple(outcome.wall_gap for _, outcome in scored)
    missing = len(outcomes) - sum(states.values())
    known = [outcome.spent for _, outcome in scored if outcome.spent is not None]
    spent = math.fsum(known) / len(known) if known and len(known) == len(scored) else None
    nonfinite = math.fsum(outcome.nonfinite for _, outcome in scored) / max(1, len(scored))
    return TableCell(
        t_interval(scores), ", ".join(units), asked, states,
        missing=missing, lacks=lacks, runs=runs, spent=spent, scores=scores, nonfinite=nonfinite,
        gaps=gaps,
    )  # fmt: skip
