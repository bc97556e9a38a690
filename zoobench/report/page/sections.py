"""The contents of a report: a section for a database, or for each leaderboard."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import accumulate

from zoobench.db.rows import RunState
from zoobench.report.cells import Cell
from zoobench.report.entries import is_external
from zoobench.report.footer import Footer
from zoobench.report.leaderboard import Leaderboard
from zoobench.report.leaderboard_pages import footer_of, judged, tables_of
from zoobench.report.learning_curves import LearningCurve
from zoobench.report.run_results import RunResult
from zoobench.report.tables import Table, place_of
from zoobench.report.undecided import OrdersOf, footnotes
from zoobench.spec import Ref, RunSpec

MOST_ROWS, MOST_RUNS = 200, 2_500
"""Limits of one section, so that a browser opens the page without delay."""
_LOST = (RunState.FAILED, RunState.DIVERGED, RunState.TIMEOUT, RunState.SKIPPED)

Accuracy = Callable[[Ref, Ref, Ref], float | None]
"""The known error of scores in an environment and task at a fidelity, as a share of them; None if unknown."""


@dataclass(frozen=True)
class Level:
    """A fidelity in an environment and task: the error of its scores as a share, and the CPU time that a simulated
    second takes [s]."""

    env: str
    task: str
    fidelity: str
    error: float
    seconds: float


@dataclass(frozen=True)
class Still:
    """A picture of a run's best episode as a JPEG, and a film of it as an MP4, which may be empty."""

    title: str
    image: bytes
    film: bytes = b""


@dataclass(frozen=True)
class Section:
    """A part of the page.

    Attributes:
        name: its heading.
        summary: a sentence below that.
        tables: of scores, with at most `MOST_ROWS` rows together.
        results: the runs.
        missing: number of runs that are wanted and do not exist.
        foot: where the numbers of the tables come from.
        known: learning curves by run id.
        stills: of the best robots.
        left_out: number of rows for which there is no room.
    """

    name: str
    summary: str
    tables: Sequence[Table]
    results: Sequence[RunResult]
    missing: int
    foot: Footer
    known: Mapping[int, LearningCurve] = field(default_factory=dict)
    stills: Sequence[Still] = ()
    left_out: int = 0

    @property
    def counts(self) -> dict[str, int]:
        """Number of runs by state."""
        counted = Counter(result.run.state for result in self.results)
        states = {str(state): counted[state] for state in RunState if counted[state]}
        return states | ({"missing": self.missing} if self.missing else {})

    @property
    def seconds(self) -> float:
        """Wall time of all runs [s]."""
        return sum(result.run.seconds for result in self.results)

    @property
    def lost(self) -> list[RunResult]:
        """The runs that ended, or were skipped, without a score."""
        return [result for result in self.results if result.run.state in _LOST]


def section_of(board: Leaderboard, orders_of: OrdersOf) -> Section:
    """A leaderboard as a section; rows without any run are left out."""
    tables, left_out = fitted(judged(tables_of(board), orders_of))
    summary = f"{board.summary[:1].upper()}{board.summary[1:]}."
    results = results_in(tables, board.results()) if left_out else board.results()
    missing, foot = len(board.missing()), replace(footer_of(board, tables), undecided=footnotes(tables, orders_of))
    return Section(board.name, summary, tables, results, missing, foot, left_out=left_out)


def fitted(tables: Sequence[Table]) -> tuple[list[Table], int]:
    """The first rows of the tables, `MOST_ROWS` of them and those of `MOST_RUNS` runs, and how many are left out."""
    kept: list[Table] = []
    rows, runs = MOST_ROWS, MOST_RUNS
    for table in tables:
        costs = accumulate(sum(sum(cell.states.values()) for cell in row.cells if cell) for row in table.rows)
        taken = min(rows, sum(cost <= runs for cost in costs))
        if taken == 0:
            break
        kept.append(replace(table, rows=table.rows[:taken]))
        rows -= taken
        runs -= sum(sum(cell.states.values()) for row in kept[-1].rows for cell in row.cells if cell)
    return kept, sum(len(table.rows) for table in tables) - sum(len(table.rows) for table in kept)


def results_in(tables: Iterable[Table], results: Iterable[RunResult]) -> list[RunResult]:
    """The results that belong to rows of these tables."""
    rows = _rows_of(tables)
    return [result for result in results if _row_of(result.spec) in rows]


def runs_in(tables: Iterable[Table], cells: Iterable[Cell]) -> list[int]:
    """The ids of the runs that belong to rows of these tables, whatever became of them."""
    rows = _rows_of(tables)
    return [outcome.run for cell in cells if _row_of(cell.spec) in rows for outcome in cell.outcomes]


def _rows_of(tables: Iterable[Table]) -> set[tuple[object, ...]]:
    """The rows of tables, and those of agents from outside whatever their budget."""
    return {
        (table.fidelity, table.frames, budget, row.env, row.task, row.design)
        for table in tables
        for row in table.rows
        for budget in (table.budget, None)
    }


def _row_of(spec: RunSpec) -> tuple[object, ...]:
    return spec.fidelity, spec.frames, None if is_external(spec.method) else spec.budget, *place_of(spec)


def best_runs(section: Section) -> list[RunResult]:
    """The best run of each environment and task in each table, in their order."""
    by_id = {result.run.id: result for result in section.results}
    best: dict[tuple[int, Ref, Ref], tuple[float, int]] = {}
    for number, table in enumerate(section.tables):
        for row in table.rows:
            found = [pair for cell in row.cells if cell for pair in zip(cell.scores, cell.runs, strict=True)]
            place = number, row.env, row.task
            if pairs := [*found, *([best[place]] if place in best else [])]:
                best[place] = max(pairs, key=lambda pair: (pair[0], -pair[1]))
    return [by_id[run] for _, run in best.values()]
