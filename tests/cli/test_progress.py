"""What one sees while runs go on."""

import io
import re
from dataclasses import replace
from itertools import pairwise

import pytest
from rich.console import Console

from tests.report.content import make_spec
from zoobench.cli import progress
from zoobench.cli.progress import Bars, Lines, TimeLeft
from zoobench.db.rows import RunRow, RunState


def row(run_id: int, state: RunState, fraction: float = 0.0, score: float | None = None) -> RunRow:
    """A run in that state that has taken 10 seconds."""
    return RunRow(
        id=run_id,
        key="k",
        spec=make_spec(seed=run_id),
        state=state,
        attempt=1,
        first_attempt=1,
        reason="det F is -1." if state is RunState.DIVERGED else None,
        fraction=fraction,
        score=score,
        seconds=10.0,
    )


def test_lines_tell_each_change_once(capsys: pytest.CaptureFixture[str]) -> None:
    """A start, an end with its reason, and no repetition in between."""
    lines = Lines([1, 2])
    running = row(1, RunState.RUNNING, 0.25, 0.5)
    for _ in range(3):
        lines.update([running, row(2, RunState.QUEUED)])
    lines.update([row(1, RunState.DONE, 1.0, 0.75), row(2, RunState.DIVERGED)])
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.splitlines() == [
        "[0/2] running   1 desert x turning x caterpillar x diffphysics seed 1, 25%, score 0.5 m/s, 30 s left",
        "[2/2] done      1 desert x turning x caterpillar x diffphysics seed 1, score 0.75 m/s, 10 s",
        "[2/2] diverged  2 desert x turning x caterpillar x diffphysics seed 2, 10 s: det F is -1.",
    ]


def test_lines_say_that_a_run_is_starting(capsys: pytest.CaptureFixture[str]) -> None:
    """Until its first iteration there is no progress to tell; one that waits is not told at all."""
    lines = Lines([1, 2])
    lines.update([row(1, RunState.RUNNING), row(2, RunState.QUEUED)])
    (line,) = capsys.readouterr().err.splitlines()
    assert line == "[0/2] running   1 desert x turning x caterpillar x diffphysics seed 1, starting"


def test_lines_report_a_long_run_now_and_then(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without a change there is a line after a while, with the progress so far."""
    monkeypatch.setattr(progress, "_PLAIN_SECONDS", 0.0)
    lines = Lines([1])
    lines.update([row(1, RunState.RUNNING)])
    lines.update([row(1, RunState.RUNNING, 0.5, 0.1)])
    assert capsys.readouterr().err.endswith(" 50%, score 0.1 m/s\n"), "one iteration beside compilation is no pace"
    lines.update([replace(row(1, RunState.RUNNING, 0.75, 0.1), seconds=15.0)])
    assert capsys.readouterr().err.endswith(" 75%, score 0.1 m/s, 5 s left\n")


def test_bars_show_runs_in_progress_and_the_total(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a terminal: a bar with score and time left for each, one for all, and a line for each that has ended."""
    screen = io.StringIO()

    def terminal(*, stderr: bool = False) -> Console:
        assert stderr, "progress is talk"
        return Console(file=screen, force_terminal=True, width=160, markup=False, highlight=False)

    monkeypatch.setattr(progress, "console", terminal)
    with Bars([1, 2]) as bars:
        bars.update([row(1, RunState.RUNNING), row(2, RunState.QUEUED)])
        bars.update([row(1, RunState.RUNNING, 0.5, 0.25), row(2, RunState.RUNNING, 0.1)])
        bars.update([row(1, RunState.DONE, 1.0, 0.75), row(2, RunState.RUNNING, 0.2)])
        bars.update([replace(row(1, RunState.DONE, 1.0, 0.75)), row(2, RunState.FAILED)])
    text = screen.getvalue()
    assert text.count("done      1 desert x turning x caterpillar x diffphysics seed 1, score 0.75 m/s, 10 s") == 1
    assert "failed    2 desert" in text
    assert "2 of 2 done" in text


def test_bars_stay_on_a_narrow_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """At 80 columns the name of a run stands above its bar, and nothing of bar, score and time left is cut."""
    screen = io.StringIO()
    terminal = Console(file=screen, force_terminal=True, width=80, markup=False, highlight=False)
    monkeypatch.setattr(progress, "console", lambda *, stderr: terminal)
    with Bars([1, 2]) as bars:
        bars.update([row(1, RunState.RUNNING, 0.5, 0.0012345), row(2, RunState.RUNNING)])
    lines = [line.strip() for line in re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", screen.getvalue()).splitlines()]
    name = "1 desert x turning x caterpillar x diffphysics seed 1"
    after = [second for first, second in pairwise(lines) if first == name]
    assert after[-1] == f"{'━' * 12}╺{'━' * 11} 50%, score 0.001234 m/s, 10 s left"


def test_the_time_left_follows_from_what_was_done_since_the_start(monkeypatch: pytest.MonkeyPatch) -> None:
    """Half a run in 10 s leaves 25 s for one and a quarter; what was done before does not count."""
    clock = iter([0.0, 10.0])
    monkeypatch.setattr(progress.time, "monotonic", lambda: next(clock))
    pace = TimeLeft([1, 2, 3])
    done = row(3, RunState.DONE)
    assert pace.seconds_left([row(1, RunState.RUNNING, 0.25), row(2, RunState.QUEUED), done]) is None
    assert pace.seconds_left([row(1, RunState.RUNNING, 0.75), row(2, RunState.QUEUED), done]) == 25.0


def test_compilation_is_no_part_of_the_time_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two runs compile for 100 s before the first of their ten iterations, which take 10 s each."""
    clock = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: clock[0])
    pace = TimeLeft([1, 2])

    def left(at: float, first: float, second: float) -> tuple[float | None, float | None]:
        clock[0] = at
        rows = [
            replace(row(run_id, RunState.RUNNING, fraction), seconds=at)
            for run_id, fraction in ((1, first), (2, second))
        ]
        return pace.seconds_left(rows), pace.of(rows[0])

    assert left(0.0, 0.0, 0.0) == (None, None)
    assert left(110.0, 0.1, 0.0) == (None, None)
    assert left(111.0, 0.1, 0.1) == (None, None)
    assert left(120.0, 0.2, 0.1) == (pytest.approx(170.0), pytest.approx(80.0))
    assert left(121.0, 0.2, 0.2) == (pytest.approx(88.0), pytest.approx(88.0))
    assert left(160.0, 0.6, 0.6) == (pytest.approx(40.0), pytest.approx(40.0))


def test_the_first_iteration_of_a_later_run_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    """It finds the kernels compiled: only what was done beside the compilation is left out."""
    clock = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: clock[0])
    pace = TimeLeft([1, 2])
    states = [(0.0, 0.0, RunState.RUNNING, 0.0), (100.0, 0.5, RunState.RUNNING, 0.0), (110.0, 1.0, RunState.DONE, 0.0),
              (120.0, 1.0, RunState.DONE, 0.5)]  # fmt: skip
    for at, fraction, state, second in states:
        clock[0] = at
        found = pace.seconds_left(
            [row(1, state, fraction), row(2, RunState.RUNNING if second else RunState.QUEUED, second)]
        )
    assert found == pytest.approx(10.0)


def test_runs_count_by_the_time_that_they_are_expected_to_take(monkeypatch: pytest.MonkeyPatch) -> None:
    """A tenth of the work in 10 s leaves 90 s, although it is one run of two; a run without a weight is a mean one."""
    for weights, left in (({1: 1.0, 2: 9.0}, 90.0), ({2: 9.0}, 10.0)):
        clock = iter([0.0, 10.0])
        monkeypatch.setattr(progress.time, "monotonic", lambda clock=clock: next(clock))
        pace = TimeLeft([1, 2], weights)
        pace.seconds_left([row(1, RunState.QUEUED), row(2, RunState.QUEUED)])
        assert pace.seconds_left([row(1, RunState.DONE), row(2, RunState.QUEUED)]) == pytest.approx(left)
