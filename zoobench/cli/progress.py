"""Progress of runs on standard error: bars on a terminal, plain lines elsewhere."""

import time
from collections.abc import Callable, Collection, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Protocol, Self

from typer import Exit

from zoobench.cli.output import console, say

if TYPE_CHECKING:
    from rich.progress import TaskID

    from zoobench.db.rows import RunRow
    from zoobench.harness.worker import WorkerOrders
    from zoobench.harness.worker_pool import WorkerPool

_PLAIN_SECONDS = 15.0  # between two lines about one run in progress
_STARTING = "starting"  # of a run until its first iteration: it compiles or loads kernels
NO_WEIGHTS: Mapping[int, float] = MappingProxyType({})


class Display(Protocol):
    """A display of the state of a set of runs; used as a context."""

    def update(self, rows: "list[RunRow]") -> None:
        """Show the runs that have changed, the first time all of them."""

    def __enter__(self) -> Self: ...

    def __exit__(self, *_: object) -> None: ...


def display(run_ids: Collection[int], weights: Mapping[int, float] = NO_WEIGHTS) -> Display:
    """Bars on a terminal, lines elsewhere; with `weights`, the relative times that runs are expected to take."""
    return Bars(run_ids, weights) if console(stderr=True).is_terminal else Lines(run_ids, weights)


def carry_out(
    db: str,
    run_ids: Collection[int],
    *,
    jobs: int,
    timeout: float | None = None,
    weights: Mapping[int, float] = NO_WEIGHTS,
    engine: "Callable[[WorkerOrders], WorkerPool] | None" = None,
) -> "list[RunRow]":
    """Do these runs with a display of their progress, and return them ended.

    Args:
        db: the database.
        run_ids: of the runs.
        jobs: how many at a time.
        timeout: of one attempt [s].
        weights: times that runs are expected to take, so that unlike ones give a good estimate of the time left.
        engine: as for `run_all`.

    Raises:
        Exit: code 130 if the user interrupts it; everything up to there is kept.
    """
    from zoobench.harness.worker_pool import run_all

    try:
        with display(run_ids, weights) as shown:
            if not run_ids:
                return []
            return run_all(db, run_ids, jobs=jobs, timeout=timeout, on_update=shown.update, engine=engine)
    except KeyboardInterrupt:
        say("\nInterrupted. Everything up to here is kept: type the same command again to go on.")
        raise Exit(130) from None


class TimeLeft:
    """Time left for a set of runs and for each of them, estimated from the progress since the start of this command.

    Runs count by their weights; one without counts as the mean of the others. Before its first iteration a run compiles
    or loads kernels, which says nothing about the rest. So the clock starts with the first iteration, and the first
    iterations of the runs that start at the same time do not count.
    """

    def __init__(self, run_ids: Collection[int], weights: Mapping[int, float] = NO_WEIGHTS) -> None:
        usual = sum(weights.values()) / len(weights) if weights else 1.0
        self._weights = {run_id: weights.get(run_id, usual) for run_id in run_ids}
        self._whole = sum(self._weights.values())
        self._shares: dict[int, float] = {}
        self._done = 0.0
        self._start: tuple[float, float] | None = None
        self._starting: set[int] = set()
        self._first_together: set[int] | None = None
        self._first: dict[int, tuple[float, float]] = {}
        self.ended: set[int] = set()

    @property
    def done(self) -> float:
        """How much is done, in runs."""
        return sum(self._shares.values())

    def seconds_left(self, rows: "list[RunRow]") -> float | None:
        """Wall time left after these changes [s]; None while there is no pace yet."""
        before, excluded = self._done, 0.0
        first = [row for row in rows if row.id in self._starting and row.fraction > 0.0 and not row.has_ended]
        for row in rows:
            gain = self._note(row)
            if row in first and self._first_together and row.id in self._first_together:
                excluded += gain
        now = time.monotonic()
        if self._start is None:
            self._start = (now, self._done)
        elif first and self._first_together is None and before <= self._start[1]:
            self._start, self._first_together = (now, self._done), set(self._starting)
        elif self._first_together:
            self._start = (self._start[0], self._start[1] + excluded)
            self._first_together &= self._starting
        begun, done = self._start
        return None if self._done <= done else (now - begun) * (self._whole - self._done) / (self._done - done)

    def of(self, row: "RunRow") -> float | None:
        """Time left for a run after its changes were taken in [s]; None before its second iteration."""
        if row.id not in self._first:
            return row.seconds_left
        seconds, fraction = self._first[row.id]
        if row.fraction <= fraction:
            return None
        return max((row.seconds - seconds) * (1.0 - row.fraction) / (row.fraction - fraction), 0.0)

    def _note(self, row: "RunRow") -> float:
        """Take in the state of a run, and return how much was done since the last."""
        from zoobench.db.rows import RunState

        (self.ended.add if row.has_ended else self.ended.discard)(row.id)
        share = 1.0 if row.has_ended else row.fraction
        gain = self._weights[row.id] * (share - self._shares.get(row.id, 0.0))
        self._done += gain
        self._shares[row.id] = share
        if row.id in self._starting and share > 0.0:
            self._first[row.id] = (row.seconds, share)
        is_starting = row.state is RunState.RUNNING and share <= 0.0
        (self._starting.add if is_starting else self._starting.discard)(row.id)
        return gain


class Lines:
    """A line when a run starts or ends, and now and then one in between."""

    def __init__(self, run_ids: Collection[int], weights: Mapping[int, float] = NO_WEIGHTS) -> None:
        self._total = len(run_ids)
        self._time_left = TimeLeft(run_ids, weights)
        self._told: dict[int, tuple[str, float]] = {}

    def update(self, rows: "list[RunRow]") -> None:
        """Print the changes since the last call."""
        from zoobench.db.rows import RunState
        from zoobench.report.views import duration

        left = self._time_left.seconds_left(rows)
        standing = f"{len(self._time_left.ended)}/{self._total}" + (f", {duration(left)} left" if left else "")
        now = time.monotonic()
        for row in rows:
            state, at = self._told.get(row.id, ("", now))
            is_news = state != row.state and row.state is not RunState.QUEUED
            if not is_news and not (row.state is RunState.RUNNING and now - at >= _PLAIN_SECONDS):
                continue
            self._told[row.id] = (row.state, now)
            say(f"[{standing}] {describe(row, self._time_left.of(row))}")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        return


class Bars:
    """One bar per run in progress with its score so far, and one for all runs."""

    def __init__(self, run_ids: Collection[int], weights: Mapping[int, float] = NO_WEIGHTS) -> None:
        from zoobench.cli.bars import BarBoard

        self._progress = BarBoard(console(stderr=True))
        self._all = self._progress.add_task("all runs", total=len(run_ids), standing="")
        self._total = len(run_ids)
        self._bars: dict[int, TaskID] = {}
        self._ended: set[int] = set()
        self._time_left = TimeLeft(run_ids, weights)

    def update(self, rows: "list[RunRow]") -> None:
        """Move the bars; a run that has ended becomes a line above them."""
        from zoobench.db.rows import RunState
        from zoobench.report.views import duration

        left = self._time_left.seconds_left(rows)
        for row in rows:
            if row.has_ended:
                self._close(row)
            elif row.state is RunState.RUNNING:
                self._move(row)
        standing = f"{len(self._ended)} of {self._total} done, {duration(left)} left" if left is not None else ""
        self._progress.update(self._all, completed=self._time_left.done, standing=standing)

    def _move(self, row: "RunRow") -> None:
        if row.id not in self._bars:
            self._bars[row.id] = self._progress.add_task(_name(row), total=None, standing=_STARTING)
        if row.fraction > 0:
            standing = _standing(row, self._time_left.of(row)).lstrip(", ")
            self._progress.update(self._bars[row.id], total=1.0, completed=row.fraction, standing=standing)

    def _close(self, row: "RunRow") -> None:
        if row.id in self._ended:
            return
        self._ended.add(row.id)
        if row.id in self._bars:
            self._progress.remove_task(self._bars.pop(row.id))
        self._progress.console.print(_ending(row))

    def __enter__(self) -> Self:
        self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()


def describe(row: "RunRow", left: float | None = None) -> str:
    """The state of a run in a line, with the time left [s] if it is known."""
    return _ending(row) if row.has_ended else f"{row.state:<9} {_name(row)}{_standing(row, left)}"


def _name(row: "RunRow") -> str:
    from zoobench.report.foreign_text import visible

    return visible(f"{row.id} {row.spec}")


def _standing(row: "RunRow", left: float | None) -> str:
    """Progress, score and time left of a run in progress, as the tail of a line."""
    from zoobench.db.rows import RunState
    from zoobench.report.views import duration, score_text

    if row.fraction <= 0:
        return f", {_STARTING}" if row.state is RunState.RUNNING else ""
    score = "" if row.score is None else f", {score_text(row.spec.task, row.score)}"
    return f", {row.fraction:.0%}{score}" + ("" if left is None else f", {duration(left)} left")


def _ending(row: "RunRow") -> str:
    from zoobench.report.foreign_text import visible
    from zoobench.report.views import duration, score_text

    score = "" if row.score is None else f", {score_text(row.spec.task, row.score)}"
    reason = f": {row.reason}" if row.reason else ""
    return visible(f"{row.state:<9} {_name(row)}{score}, {duration(row.seconds)}{reason}")
