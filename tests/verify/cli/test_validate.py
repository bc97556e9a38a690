"""`validate`."""

import json
from pathlib import Path

import pytest

from tests.cli.conftest import Command
from zoobench_verify.cases import Case, CaseRecorder, Shortfall
from zoobench_verify.validate import validation_suite


def test_cases_within_their_bounds_are_listed_and_drawn(zoobench: Command, tmp_path: Path) -> None:
    """One row per check with bound, source, resolution and precision; a plot per case; exit code 0."""
    plots = tmp_path / "plots"
    reply = zoobench("verify", "validate", "--case", "gravity-*", "--plots", plots, "--format", "json")
    rows = json.loads(reply.out)
    assert reply.code == 0, reply.err
    assert [row["case"] for row in rows] == ["gravity-column"] * 2
    assert all(row["ok"] is True and row["source"] and row["resolution"] for row in rows)
    assert all(row["precision"] == "float64" and row["seconds"] > 0 for row in rows)
    assert "gravity-column: ok" in reply.err
    assert sorted(path.name for path in plots.iterdir()) == ["gravity-column.png"]


def test_a_missed_bound_is_exit_code_1(zoobench: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    """The table shows the missed number, and a message names the case."""

    def measure(record: CaseRecorder) -> None:
        record.at_most("good", 0.5, 1.0)
        record.at_most("bad", 2.0, 1.0, "m")

    case = Case("made-up", "A case.", measure, source="nothing", resolution="none")
    monkeypatch.setattr(validation_suite, "CASES", (case,))
    reply = zoobench("verify", "validate", "--format", "csv")
    assert reply.code == 1
    assert "made-up: FAILED" in reply.err
    lines = reply.out.splitlines()
    assert lines[1].startswith("made-up,good,0.5,<= 1,-,True,none,float64,")
    assert lines[2].startswith("made-up,bad,2.0,<= 1,m,False,none,float64,")


def test_a_known_shortfall_is_listed_with_its_reason(zoobench: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    """The table shows the missed number, a message its reason, and the exit code is 0."""

    def measure(record: CaseRecorder) -> None:
        record.at_most("drift", 2.0, 1.0, "m", shortfall=Shortfall("water is thick", 3.0))

    case = Case("made-up", "A case.", measure, source="nothing", resolution="none")
    monkeypatch.setattr(validation_suite, "CASES", (case,))
    reply = zoobench("verify", "validate", "--format", "csv")
    assert reply.code == 0
    assert "made-up: known shortfall" in reply.err
    assert "drift 2 <= 1 (known shortfall: water is thick)" in " ".join(reply.err.split())
    assert reply.out.splitlines()[1].startswith("made-up,drift,2.0,<= 1,m,False,none,float64,")
