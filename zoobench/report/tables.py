"""The tables of scores: one per fidelity, episode length and budget, since those are never mixed.

A row is an environment, task and design; a column is a method with its controller; a cell is the mean over seeds with
its 95 % Student-t interval, and the outcomes of seeds without a score. Agents that were trained elsewhere have no
budget: they have a column in every table that has their row, and win and lose nothing.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import TypeVar

from zoobench.registry import Kind, short
from zoobench.report.cells import Cell, cells_of, comparable
from zoobench.report.entries import Entry, entries_of, entry_of
from zoobench.report.labels import in_order
from zoobench.report.run_results import RunResult
from zoobench.report.table_cell import TableCell, compare
from zoobench.spec import Budget, BudgetKind, Ref, RunSpec, currency, repeat_command
from zoobench.tasks.quantities import Quantity, quantity_of


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
        """Unit of the amounts."""
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
    """A row of a table; `cells` has one for each entry of the table, None if it was not asked for.

    `amount` is the amount that each run had spent, in a table drawn from learning curves.
    """

    env: Ref
    task: Ref
    design: Ref
    cells: tuple[TableCell | None, ...]
    amount: float | None = None

    @property
    def quantity(self) -> Quantity:
        """The quantity of its scores."""
        return quantity_of(self.task, next((cell.unit for cell in self.cells if cell is not None and cell.unit), ""))

    @property
    def is_empty(self) -> bool:
        """Whether no run exists in any cell."""
        return all(cell is None or cell.is_empty for cell in self.cells)


@dataclass(frozen=True)
class Table:
    """All rows of one fidelity, episode length [control frames] and budget, or amount spent of whatever budgets.

    `quantity` is that of all its scores; None if there may be several.
    """

    fidelity: Ref
    frames: int
    budget: Budget | Spending
    entries: tuple[Entry, ...]
    rows: tuple[Row, ...]
    quantity: Quantity | None = None

    @property
    def currency(self) -> BudgetKind:
        """The unit of the amounts that its runs have spent: substeps unless the budget counts something else."""
        return currency(self.budget.kind)

    @property
    def runs(self) -> list[int]:
        """The ids of the runs that made its numbers."""
        return [run for row in self.rows for cell in row.cells if cell is not None for run in cell.runs]

    @property
    def title(self) -> str:
        """The quantity, and the settings that all numbers of the table share."""
        spent = f"budget {self.budget}" if isinstance(self.budget, Budget) else str(self.budget)
        if all(entry.is_external for entry in self.entries):
            spent = "trained elsewhere"
        seeds = "" if self.seeds is None else f", {self.seeds} seed{'s' * (self.seeds != 1)}"
        quantity = "" if self.quantity is None else f"{self.quantity.title}: "
        return f"{quantity}fidelity {short(Kind.FIDELITY, self.fidelity)}, {spent}, {self.frames} frames{seeds}"

    @property
    def seeds(self) -> int | None:
        """The number of seeds that were asked for in every row; None if rows differ in it, or none is left."""
        cells = [cell for row in self.rows for cell in row.cells if cell is not None and not cell.is_external]
        counts = {cell.asked for cell in cells}
        return counts.pop() if len(counts) == 1 else None

    def parts(self) -> "list[Table]":
        """The rows of each quantity as a table, with the columns that it has."""
        groups: dict[Quantity, list[Row]] = {}
        for row in self.rows:
            groups.setdefault(row.quantity, []).append(row)
        parts = (replace(self, rows=tuple(groups[quantity]), quantity=quantity) for quantity in sorted(groups))
        return [part._without_empty_columns() for part in parts]

    def _without_empty_columns(self) -> "Table":
        kept = [place for place in range(len(self.entries)) if any(row.cells[place] is not None for row in self.rows)]
        rows = (replace(row, cells=tuple(row.cells[place] for place in kept)) for row in self.rows)
        return replace(self, entries=tuple(self.entries[place] for place in kept), rows=tuple(rows))


def score_tables(results: Iterable[RunResult], missing: Iterable[RunSpec] = ()) -> list[Table]:
    """The tables of these results, as `tables_of_cells`; `missing` are wanted and do not exist."""
    return tables_of_cells(cells_of(results, missing))


def tables_of_cells(cells: Iterable[Cell]) -> list[Table]:
    """The tables of these cells, sorted by name, so that equal data give equal text.

    Smoke runs and probes are left out. Runs that were skipped, because a method cannot be used there, count as not
    asked for. Those that are wanted and do not exist are shown as such, and nobody wins a row that lacks one.
    """
    settings: dict[tuple[Ref, int, Budget], list[Cell]] = {}
    outside: list[Cell] = []
    for cell in comparable(cells):
        spec = cell.spec
        if entry_of(spec).is_external:
            outside.append(cell)
        else:
            settings.setdefault((spec.fidelity, spec.frames, spec.budget), []).append(cell)
    places = {setting: {place_of(cell.spec) for cell in members} for setting, members in settings.items()}
    for cell in outside:
        level = cell.spec.fidelity, cell.spec.frames
        homes = [setting for setting, own in places.items() if setting[:2] == level and place_of(cell.spec) in own]
        for setting in homes or [(*level, cell.spec.budget)]:
            settings.setdefault(setting, []).append(cell)

    def rank(setting: tuple[Ref, int, Budget]) -> tuple[object, ...]:
        fidelity, frames, budget = setting
        return setting not in places, in_order(fidelity), frames, budget.kind, budget.amount

    return [_table(*setting, settings[setting]) for setting in sorted(settings, key=rank)]


def _table(fidelity: Ref, frames: int, budget: Budget, cells: list[Cell]) -> Table:
    entries = entries_of(cell.spec for cell in cells)
    is_even = budget.kind == "seconds"
    rows = [Row(*place, compare(group, entries, is_even=is_even)) for place, group in grouped(cells, place_of)]
    return Table(fidelity, frames, budget, entries, tuple(rows))


def methods_of(specs: Iterable[RunSpec]) -> tuple[Ref, ...]:
    """The methods of these runs in their order."""
    return tuple(sorted({spec.method for spec in specs}, key=in_order))


def repeat_commands(table: Table, specs: Iterable[RunSpec]) -> list[str]:
    """The commands that repeat each row of a table, one for each controller; empty where no spec belongs to it."""
    own: dict[tuple[Ref, ...], dict[tuple[object, ...], list[RunSpec]]] = {}
    for spec in specs:
        is_here = (spec.fidelity, spec.frames) == (table.fidelity, table.frames) and entry_of(spec) in table.entries
        if is_here and (spec.budget == table.budget or entry_of(spec).is_external):
            groups = own.setdefault(place_of(spec), {})
            groups.setdefault((spec.controller, spec.budget), []).append(spec)
    found = (own.get((row.env, row.task, row.design), {}).values() for row in table.rows)
    return [" && ".join(repeat_command(*members) for members in groups) for groups in found]


S = TypeVar("S", Cell, RunResult)
K = TypeVar("K", bound=tuple[Ref | int, ...])


def place_of(spec: RunSpec) -> tuple[Ref, Ref, Ref]:
    """The row of a run: environment, task and design."""
    return spec.env, spec.task, spec.design


def grouped(members: Iterable[S], key: Callable[[RunSpec], K]) -> list[tuple[K, list[S]]]:
    """The members by some of their settings, in order of these."""
    groups: dict[K, list[S]] = {}
    for member in members:
        groups.setdefault(key(member.spec), []).append(member)
    return sorted(groups.items(), key=lambda item: tuple(map(in_order, item[0])))
