"""The cells of a table of scores, and which of a row wins."""

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from zoobench.db.rows import OPEN_STATES, RunState
from zoobench.report.cells import Cell, Outcome
from zoobench.report.entries import Entry, entry_of
from zoobench.report.lasting import Lasting
from zoobench.report.listing import Measured
from zoobench.report.normalise import floor_of, run_shares, shares
from zoobench.report.statistics import Interval, clear_winner, t_interval
from zoobench.spec import Budget, is_at_wall, standing

_FEW = 0.01  # share of gradients that may not be finite without a note
EQUAL_COST = 0.05  # share of the largest amount spent by which others may be below it for a fair comparison


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
        lasting: the result of the best solution over more frames; None if it was not evaluated.
        outside: the budget of an agent that was trained elsewhere, which counts its evaluation alone: it neither wins
            nor loses; None for methods, which have that of the table.
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
    outside: Budget | None = None

    @property
    def is_external(self) -> bool:
        """Whether it is of an agent that was trained elsewhere."""
        return self.outside is not None

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

    def estimate(self, seeds: int | None = None, *, sign: float = 1.0, normalised: bool = False) -> Measured:
        """The text of the cell: `0.031 ± 0.004`, `0.031 (n=1 of 3, diverged 2/3)`, or `missing` without any run.

        Args:
            seeds: that every cell is known to have, so that it is told only where there are others.
            sign: by which the score is multiplied, see `Quantity`.
            normalised: also tell where the mean lies between the row's references and its best.
        """
        if self.is_empty:
            return Measured(None, notes=("missing",))
        notes = [f"n={self.count}" + (f" of {self.asked}" if self.count < self.asked else "")]
        if self.count == self.asked == seeds:
            notes = []
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
        if normalised and self.normalised is not None:
            notes.insert(0, f"normalised {self.normalised:.2f}")
        if self.interval is None:
            return Measured(None, notes=("no score", *notes))
        marks = " ".join(filter(None, ("‡" * self.is_undecided, "§" * self.is_overturned, "‖" * self.is_at_wall)))
        mean, low, high = self.interval.mean, self.interval.low, self.interval.high
        return Measured(mean, low, high, tuple(notes), marks).scaled(sign)


def compare(group: Sequence[Cell], entries: tuple[Entry, ...], *, is_even: bool) -> tuple[TableCell | None, ...]:
    """The cells of a row, the winner marked; `is_even` says that all have spent the same, whatever they simulated."""
    by_entry: dict[Entry, list[Outcome]] = {}
    for cell in group:
        by_entry.setdefault(entry_of(cell.spec), []).extend(cell.outcomes)
    outside = {entry_of(cell.spec): cell.spec.budget for cell in group if entry_of(cell.spec).is_external}
    own = [outcome for entry, found in by_entry.items() if entry not in outside for outcome in found]
    asked = len({outcome.seed for outcome in own})
    cells = [_cell(by_entry.get(entry, ()), asked, outside.get(entry)) for entry in entries]
    lead = leader(cells)
    if lead is not None and (is_even or spent_alike(cells)):
        cells = won_by(lead, cells)
    means = [None if cell is None or cell.interval is None else cell.interval.mean for cell in cells]
    floor = floor_of(outcome.floor for found in by_entry.values() for outcome in found)
    normalised = shares(means, floor)
    best_mean = max((mean for mean in means if mean is not None), default=None)
    return tuple(
        cell and replace(cell, normalised=share, shares=run_shares(cell.scores, floor, best_mean))
        for cell, share in zip(cells, normalised, strict=True)
    )


def rivals(cells: Iterable[TableCell | None]) -> list[TableCell]:
    """The cells of a row that can win it: not those of agents from outside, whose cost is not known."""
    return [cell for cell in cells if cell is not None and not cell.is_external]


def leader(cells: Sequence[TableCell | None]) -> TableCell | None:
    """The cell whose interval lies above those of all rivals, all its seeds done and away from walls; None if a run of
    the row is to come."""
    own = rivals(cells)
    if any(cell.is_unfinished for cell in own):
        return None
    best = clear_winner([cell.interval for cell in own])
    found = None if best is None else own[best]
    is_whole = found is not None and found.count == found.asked
    return found if found is not None and is_whole and not found.is_at_wall else None


def won_by(winner: TableCell, cells: Iterable[TableCell | None]) -> list[TableCell | None]:
    """The cells of a row with the mark of its winner, which is one of them."""
    return [replace(winner, is_winner=True) if cell is winner else cell for cell in cells]


def spent_alike(cells: Iterable[TableCell | None]) -> bool:
    """Whether the costs of the rivals of a row differ by less than `EQUAL_COST`; each with a score needs one."""
    spent = [cell.spent for cell in rivals(cells) if cell.interval is not None]
    known = [amount for amount in spent if amount is not None]
    return len(spent) < 2 or (len(known) == len(spent) and max(known) - min(known) < EQUAL_COST * max(known))


def _cell(outcomes: Sequence[Outcome], asked: int, outside: Budget | None) -> TableCell | None:
    if not outcomes:
        return None
    if outside is not None:
        asked = len({outcome.seed for outcome in outcomes})
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
    spent = math.fsum(known) / len(known) if known and len(known) == len(scored) and outside is None else None
    nonfinite = math.fsum(outcome.nonfinite for _, outcome in scored) / max(1, len(scored))
    return TableCell(
        t_interval(scores), ", ".join(units), asked, states,
        missing=missing, lacks=lacks, runs=runs, spent=spent, scores=scores, nonfinite=nonfinite,
        gaps=gaps, outside=outside,
    )  # fmt: skip
