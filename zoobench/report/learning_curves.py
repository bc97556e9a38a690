"""Learning curves: the best score of a run over the amount spent, and tables at an equal amount spent.

Only runs that are DONE have a curve here, as only they have results.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from zoobench.db.many_rows import OriginRow
from zoobench.db.rows import FinalRow, RunState
from zoobench.errors import UsageError
from zoobench.report.cells import cells_of
from zoobench.report.curve import Curve, points, read_curves
from zoobench.report.entries import Entry, entries_of, entry_of, is_external
from zoobench.report.footer import machine_text
from zoobench.report.labels import labels
from zoobench.report.listing import Listing
from zoobench.report.normalise import REFERENCES
from zoobench.report.provisional import marked
from zoobench.report.run_results import SCORE, RunResult
from zoobench.report.statistics import t_interval
from zoobench.report.table_cell import EQUAL_COST, TableCell, compare
from zoobench.report.tables import Row, Spending, Table, grouped, methods_of, place_of
from zoobench.report.units import in_units
from zoobench.spec import AXES, WALL_GAP, BudgetKind

if TYPE_CHECKING:
    from zoobench.db.query import Reader

COLUMNS = ("substeps", "forward_substeps", "episodes", "seconds", SCORE)
"""The columns that every method reports at every iteration; the score from the first one on."""

_SHARES = (0.125, 0.25, 0.5, 1.0)  # of the amount spent, in a listing for reading


@dataclass(frozen=True)
class LearningCurve(Curve):
    """The curve of a run with its result; `kind` is the currency of the amounts spent."""

    result: RunResult
    kind: BudgetKind

    def at(self, amount: float) -> float | None:
        """The best score when no more than this was spent; None before the first.

        At its own budget a run has its final score, as in tables, though its last iteration has spent a little more.
        """
        budget = self.result.run.spec.budget
        is_over = budget.kind == self.kind and budget.amount < self.spent[-1] < (1.0 + EQUAL_COST) * budget.amount
        return self.scores[-1] if is_over and amount >= budget.amount else super().at(amount)

    @property
    def reach(self) -> float:
        """The amount up to which the curve is known.

        That of a run that has spent its budget in this currency goes to its end, though the last bit may not have held
        another iteration. One that its method's own settings have ended goes as far as it went.
        """
        budget, finals = self.result.run.spec.budget, self.result.finals
        is_whole = "budget_spent" not in finals or finals["budget_spent"].value > 0  # earlier versions did not say
        return max(self.spent[-1], budget.amount if budget.kind == self.kind and is_whole else 0.0)


def curves(reader: "Reader", results: Iterable[RunResult], kind: BudgetKind) -> dict[int, LearningCurve]:
    """The curves of these results by run id; of runs by an earlier zoobench, which kept less, there may be none.

    Raises:
        StorageError: the database cannot be read.
    """
    done = {result.run.id: result for result in results if result.run.state is RunState.DONE}
    found = read_curves(reader, done, kind)
    return {run: LearningCurve(curve.spent, curve.scores, done[run], kind) for run, curve in found.items()}


def refuse_machines(origins: Iterable[OriginRow]) -> None:
    """Say that times of several machines cannot be compared, unless all runs come from one.

    Raises:
        UsageError: they come from several.
    """
    machines = sorted({machine_text(origin.provenance) for origin in origins})
    if len(machines) > 1:
        raise UsageError(
            f"These runs were done on {len(machines)} machines, whose seconds cannot be compared: "
            f"{'; '.join(machines)}. Compare by substeps or episodes, or choose runs of one machine."
        )


def furthest(results: Iterable[RunResult], known: Mapping[int, LearningCurve]) -> list[RunResult]:
    """One run for each cell, method and seed: among those that differ by the budget, the one with the longest curve.

    The budget decides how far a run goes and not where, so a shorter one says nothing that the longer does not.
    """
    best: dict[tuple[object, ...], tuple[tuple[float, str], RunResult]] = {}
    for result in results:
        spec, run = result.run.spec, result.run
        key = (*(getattr(spec, axis) for axis in AXES), spec.frames, spec.seed)
        rank = (known[run.id].reach if run.id in known else float(run.state is RunState.DONE) - 1.0, run.key)
        if key not in best or rank > best[key][0]:
            best[key] = (rank, result)
    return [result for _, result in best.values()]


def spending_tables(
    results: Iterable[RunResult], known: Mapping[int, LearningCurve], kind: BudgetKind, amount: float | None = None
) -> list[Table]:
    """Tables of the scores that runs had when all had spent the same, whatever their own budgets.

    Args:
        known: the curves of the results, against `kind`.
        amount: the amount spent; in each row the largest amount that all its finished runs have reached if None.
    """
    tables = []
    compared = furthest(comparable_results(results), known)
    for (fidelity, frames), members in grouped(compared, lambda spec: (spec.fidelity, spec.frames)):
        entries = entries_of(result.spec for result in members)
        own = {result.run.spec.budget for result in members if not is_external(result.spec.method)}
        budgets = sorted(own, key=lambda budget: (budget.kind, budget.amount))
        rows = tuple(Row(*place, *_row(group, entries, known, amount)) for place, group in grouped(members, place_of))
        tables.append(Table(fidelity, frames, Spending(kind, amount, tuple(budgets)), entries, rows))
    return tables


def points_listing(reader: "Reader", results: Iterable[RunResult]) -> Listing:
    """Every point of every curve, one row per iteration, for programs; references with every parameter stated."""
    done = {result.run.id: result for result in comparable_results(results) if result.run.state is RunState.DONE}
    rows = [
        (
            run_id, *(str(getattr(done[run_id].run.spec, axis)) for axis in AXES), done[run_id].run.spec.frames,
            done[run_id].run.spec.seed, iteration, *(point.get(name) for name in COLUMNS), _unit(done[run_id]),
        )
        for run_id, found in points(reader, done, COLUMNS).items()
        for iteration, point in sorted(found.items())
    ]  # fmt: skip
    return Listing(("run", *AXES, "frames", "seed", "iteration", *COLUMNS, "unit"), tuple(rows))


def curves_overview(
    results: Sequence[RunResult], known: Mapping[int, LearningCurve], kind: BudgetKind, units: Sequence[str] = ()
) -> Listing:
    """Mean best scores or errors at shares of the amount spent by all methods of a cell; a row per cell and method.

    In the first of the units that fits, or in the task's own.
    """
    spending = Spending(kind, None, ())
    groups = cells(results, known)
    axes = ("env", "task", "design", "controller", "fidelity", "frames")
    values = {axis: [getattr(group[0].run.spec, axis) for group in groups] for axis in axes}
    # the last three are columns only if they tell rows apart
    shown = [axis for axis in axes if axis in axes[:3] or len(set(values[axis])) > 1]
    names = {axis: labels(values[axis]) if axis != "frames" else {} for axis in shown}
    names["env"] = marked(names["env"])
    methods = labels(result.run.spec.method for group in groups for result in group)
    rows = []
    for group in groups:
        end = min(known[result.run.id].reach for result in group)
        for method in methods_of(result.spec for result in group):
            own = [known[result.run.id] for result in group if result.run.spec.method == method]
            spec = own[0].result.run.spec
            quantity, factor = in_units(own[0].result.quantity, units)
            scale = factor * quantity.sign
            means = [_mean([curve.at(share * end) for curve in own], scale) for share in _SHARES]
            rows.append(
                (*(names[axis].get(value, value) for axis in shown for value in [getattr(spec, axis)]), methods[method],
                 len(own), spending.text(end), *means, quantity.unit_text)
            )  # fmt: skip
    shares = (f"at {share:g}" for share in _SHARES[:-1])
    return Listing((*shown, "method", "n", f"spent [{spending.unit}]", *shares, "at all of it", "unit"), tuple(rows))


def cells(results: Iterable[RunResult], known: Mapping[int, LearningCurve]) -> list[list[RunResult]]:
    """The results that have a curve, as `in_cells`."""
    able = [result for result in furthest(comparable_results(results), known) if result.run.id in known]
    return in_cells(able)


def in_cells(results: Iterable[RunResult]) -> list[list[RunResult]]:
    """The results, those together that differ by method, seed and budget alone; sorted by name."""
    found = grouped(results, lambda spec: (spec.fidelity, spec.frames, *place_of(spec), spec.controller))
    return [group for _, group in found]


def _row(
    group: list[RunResult], entries: tuple[Entry, ...], known: Mapping[int, LearningCurve], amount: float | None
) -> tuple[tuple[TableCell | None, ...], float | None]:
    """The cells of a row, and the amount at which they are compared; agents from outside have their score."""
    inside = [result for result in group if not entry_of(result.spec).is_external]
    if amount is None:
        amount = min((known[result.run.id].reach for result in inside if result.run.id in known), default=None)
    read = [result if result not in inside else _read(result, known.get(result.run.id), amount) for result in group]
    return compare(cells_of(read), entries, is_even=True), amount


def comparable_results(results: Iterable[RunResult]) -> list[RunResult]:
    """Those that may stand in a table, as `cells.comparable`."""
    return [
        result for result in results if not (result.is_smoke or result.is_probe or result.run.state is RunState.SKIPPED)
    ]


def _read(result: RunResult, curve: LearningCurve | None, amount: float | None) -> RunResult:
    """The result as it was when this much was spent; without a score where that cannot be said."""
    if result.run.state is not RunState.DONE:
        return result
    score, lacks = None, "kept no curve"
    if curve is not None and amount is not None:
        score, lacks = (curve.at(amount), "no score yet") if curve.reach >= amount else (None, "spent less")
    kept = (*REFERENCES, WALL_GAP)  # an earlier solution may have met the arena's side as the last did
    finals = {name: final for name, final in result.finals.items() if name in kept}
    if score is not None:
        finals[SCORE] = FinalRow(SCORE, score, _unit(result))
    return replace(result, finals=finals, lacks=lacks)


def _mean(scores: Sequence[float | None], scale: float) -> float | None:
    """The mean times a scale; None unless every seed has a score."""
    interval = t_interval([score for score in scores if score is not None])
    return scale * interval.mean if interval is not None and interval.count == len(scores) else None


def _unit(result: RunResult) -> str:
    return "" if result.score is None else result.score.unit
