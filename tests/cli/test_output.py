"""Tables on terminals and elsewhere."""

import io
import sys

import pytest

from zoobench.cli.output import Format, emit
from zoobench.report.listing import Listing


class Terminal(io.StringIO):
    """Standard output as a person has it."""

    def isatty(self) -> bool:
        """Yes."""
        return True


def test_a_narrow_terminal_cuts_no_word_and_no_number(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where columns of whole words do not fit, the terminal folds whole lines."""
    shown = Terminal()
    monkeypatch.setattr(sys, "stdout", shown)
    monkeypatch.setenv("COLUMNS", "60")
    monkeypatch.setenv("TERM", "xterm")
    cells = ("shallow-water", "waypoint-following", "caterpillar", "quality-diversity", 0.001234, "no such file here")
    emit(Listing(("env", "task", "design", "method", "score", "reason"), (cells,)), Format.TABLE)
    assert all(word in shown.getvalue() for cell in cells for word in str(cell).split())
    assert "…" not in shown.getvalue()
