"""Tables on terminals and elsewhere."""

import io
import sys

import pytest
from rich.console import Console

from zoobench.cli.output import Format, emit, plain_lines, rich_table
from zoobench.report.listing import Listing


class Terminal(io.StringIO):
    """Standard output as a person has it."""

    def isatty(self) -> bool:
        """Yes."""
        return True


def test_a_narrow_terminal_cuts_no_word_and_no_number(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where columns of whole words do not fit, a row goes on below, with its header likewise."""
    shown = Terminal()
    monkeypatch.setattr(sys, "stdout", shown)
    monkeypatch.setenv("COLUMNS", "60")
    monkeypatch.setenv("TERM", "xterm")
    cells = ("shallow-water", "waypoint-following", "caterpillar", "quality-diversity", 0.001234, "no such file here")
    emit(Listing(("env", "task", "design", "method", "score", "reason"), (cells,)), Format.TABLE)
    assert shown.getvalue().splitlines() == [
        "env             task                 design",
        "    method                 score   reason",
        "─" * 60,
        "shallow-water   waypoint-following   caterpillar",
        "    quality-diversity   0.001234   no such file here",
    ]


@pytest.mark.parametrize(
    "rows",
    [
        (),
        (("a", 1, None),),
        (("shallow-water †", 1.23456, "two\nlines"), ("日本", -2e9, "x "), ("", None, "")),
    ],
)
def test_lines_off_a_terminal_are_those_of_a_table(rows: tuple[tuple[object, ...], ...]) -> None:
    """What is written line by line for listings of any length is what is drawn on a wide terminal."""
    listing = Listing(("name", "number [m]", "reason"), rows)
    screen = Console(file=io.StringIO(), width=1000)
    with screen.capture() as captured:
        screen.print(rich_table(listing))
    assert list(plain_lines(listing)) == [line.rstrip() for line in captured.get().splitlines()]
