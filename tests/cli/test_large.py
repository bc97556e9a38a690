"""Commands on databases with many runs print what the runs one by one say."""

import csv
import io
from pathlib import Path

import pytest

from tests import large
from tests.cli.conftest import Command
from zoobench.cli.output import plain_lines
from zoobench.db.store import Store
from zoobench.harness import doctor
from zoobench.report.listing import to_csv
from zoobench.report.run_results import choose_results
from zoobench.report.table_forms import table_listing
from zoobench.report.tables import score_tables
from zoobench.report.views import results_listing
from zoobench.spec import RunSelection


@pytest.fixture
def filled(tmp_path: Path) -> Path:
    """A large database, as large as a test can wait for."""
    large.make(str(tmp_path / "zoobench.db"), 300, 2)
    return tmp_path / "zoobench.db"


def test_every_run_is_printed_as_csv_line_by_line(zoobench: Command, filled: Path) -> None:
    """The text is that of the whole listing, though none is made."""
    with Store(filled) as store:
        listing = results_listing(choose_results(store, RunSelection(method="random")))
    out = zoobench("results", "--format", "csv", "--method", "random").out
    assert out == to_csv(listing) + "\n"
    assert len(list(csv.reader(io.StringIO(out)))) == 61


def test_a_table_is_that_of_the_results(zoobench: Command, filled: Path) -> None:
    """Every line of it, score and error apart, but for the marks of winners and of what the fidelity cannot decide."""

    def words(line: str) -> list[str]:
        return line.replace(" *", "").replace(" ‡", "").split()

    with Store(filled) as store:
        (table,) = score_tables(choose_results(store, RunSelection()))
    lines = [words(line) for line in zoobench("table").out.splitlines()]
    for part in table.parts():
        begin = lines.index(words(part.title))
        plain = [words(line) for line in plain_lines(table_listing(part))]
        assert [line for line in lines[begin + 2 :][: len(plain)] if "─" not in line[0]] == [
            line for line in plain if "─" not in line[0]
        ]


def test_doctor_reads_a_large_database_only_when_asked(
    zoobench: Command, filled: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It says what it left out, and how to have it done."""
    monkeypatch.setattr(doctor, "_check_taichi", lambda: iter(()))
    assert "is intact" in zoobench("doctor").out
    monkeypatch.setattr(doctor, "_SOON_READ", 1000)
    assert "--full also reads all of its" in zoobench("doctor").out
    assert "is intact and holds 300 runs" in zoobench("doctor", "--full").out
