"""How far a long command is."""

import io

import pytest
from rich.console import Console

from zoobench.cli import steps
from zoobench.cli.steps import Steps


def test_each_step_is_counted_with_the_time_taken_and_left(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two steps of three in 20 s leave 10 s; at the last one nothing is left, and without a total it is not known."""
    now = [0.0]
    monkeypatch.setattr(steps.time, "monotonic", lambda: now[0])
    for total in (3, None):
        now[0] = 0.0
        with Steps(total) as told:
            for name, at in (("a", 5.0), ("b", 20.0), ("c", 90.0)):
                told.begin(name)
                now[0] = at
                told.end(f"{name}: ok")
    assert capsys.readouterr().err.splitlines() == [
        "[1/3, 5 s, 10 s left] a: ok",
        "[2/3, 20 s, 10 s left] b: ok",
        "[3/3, 1 min 30 s] c: ok",
        "[1, 5 s] a: ok",
        "[2, 20 s] b: ok",
        "[3, 1 min 30 s] c: ok",
    ]


def test_a_terminal_shows_the_step_in_hand(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its name, the count and the bar, at 80 columns as well."""
    screen = io.StringIO()
    terminal = Console(file=screen, force_terminal=True, width=80, markup=False, highlight=False)
    monkeypatch.setattr(steps, "console", lambda *, stderr: terminal)
    monkeypatch.setattr(steps.time, "monotonic", lambda: 0.0)
    with Steps(27) as told:
        told.begin("a-case")
        told.end("a-case: ok")
        told.begin("b-case")
    text = screen.getvalue()
    assert "[1/27, 0 s] a-case: ok" in text
    assert "[1/27] b-case" in text
    assert text.count("━") >= 24
