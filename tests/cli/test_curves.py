"""`curves`, and `table` at an equal amount spent."""

import csv
import io
import json
from dataclasses import replace
from pathlib import Path

import pytest

from tests.cli.conftest import Command
from tests.report import content
from tests.report.content import add_curve, made_once, make_spec
from zoobench.db.store import Store
from zoobench.spec import RunSpec


@made_once
def _learnt(store: Store) -> None:
    for seed in range(2):
        add_curve(store, make_spec(seed=seed), [0.2, 0.4 + 0.001 * seed, 0.8])
        add_curve(store, make_spec(method="random-v1", seed=seed, budget="100 episodes"), [0.1, 0.1], cost=50.0)


@pytest.fixture
def learnt(tmp_path: Path) -> Path:
    """Two methods of different budgets, under the name that commands look for."""
    return _learnt(tmp_path / "zoobench.db")


def test_without_a_file_curves_are_a_table(zoobench: Command, learnt: Path) -> None:
    """A row for each method; against seconds if asked."""
    out = zoobench("curves").out
    assert "spent [substeps]" in out
    assert len(out.splitlines()) == 4
    assert "spent [s]" in zoobench("curves", "--by", "seconds", "--format", "md").out


def test_curves_for_programs_hold_every_point(zoobench: Command, learnt: Path) -> None:
    """As csv and json, ten iterations in all."""
    assert len(json.loads(zoobench("curves", "--format", "json").out)) == 10
    assert len(list(csv.DictReader(io.StringIO(zoobench("curves", "--format", "csv").out)))) == 10


def test_curves_are_drawn_into_a_file(zoobench: Command, learnt: Path, tmp_path: Path) -> None:
    """And said to be."""
    reply = zoobench("curves", "-o", tmp_path / "curves.png")
    assert (reply.code, reply.out) == (0, "")
    assert "1 cell" in reply.err
    assert (tmp_path / "curves.png").stat().st_size > 5000


def test_new_names_are_for_a_figure(zoobench: Command, learnt: Path, tmp_path: Path) -> None:
    """With a file they are drawn; without one, or where they are not written so, the command is refused."""
    renamed = ["--rename", "diffphysics=Gradient"]
    assert zoobench("curves", *renamed, "-o", tmp_path / "curves.png").code == 0
    assert "-o curves.pdf" in zoobench("curves", *renamed).err
    reply = zoobench("curves", "--rename", "diffphysics", "-o", tmp_path / "curves.png")
    assert reply.code == 2
    assert "lion='Lion (ours)'" in reply.err


def test_curves_in_another_unit(zoobench: Command, learnt: Path, tmp_path: Path) -> None:
    """Of a table and of a figure; one that does not fit is refused, and so is any for programs."""
    own, other = (markdown_rows(zoobench("curves", "--format", "md", *words).out) for words in ((), ("--unit", "mm/s")))
    assert {row["unit"] for row in own} == {"m/s"}
    assert {row["unit"] for row in other} == {"mm/s"}
    for before, after in zip(own, other, strict=True):
        assert float(after["at all of it"]) == pytest.approx(1000.0 * float(before["at all of it"]))
    drawn = ["-o", str(tmp_path / "curves.png")]
    for words in ([], drawn):
        assert "Nothing here can be shown in 'kg'" in zoobench("curves", "--unit", "kg", *words).err
    assert zoobench("curves", "--unit", "mm/s", *drawn).code == 0
    reply = zoobench("curves", "--unit", "mm/s", "--format", "csv")
    assert reply.code == 2
    assert "--unit changes tables for people, and csv has the data unchanged" in reply.err


def test_without_curves_it_says_what_to_type(zoobench: Command, tmp_path: Path) -> None:
    """Nothing to show is no error; nothing to draw is."""
    Store(tmp_path / "zoobench.db").close()
    reply = zoobench("curves")
    assert reply.code == 0
    assert "zoobench run" in reply.err
    assert zoobench("curves", "-o", tmp_path / "curves.png").code == 2


def test_smoke_runs_alone_are_nothing_to_show(zoobench: Command, tmp_path: Path) -> None:
    """They are left out, and an empty table does not stand there without a word."""
    with Store(tmp_path / "zoobench.db") as store:
        add_curve(store, make_spec(fidelity="smoke-v1"), [0.2])
    for form in ("table", "csv"):
        assert "No finished run has a learning curve yet" in zoobench("curves", "--format", form).err


@pytest.mark.parametrize(
    ("column", "other"),
    [("controller", make_spec(controller="trajectory-v1")), ("fidelity", make_spec(fidelity="paper-v1")),
     ("frames", replace(make_spec(), frames=20))],
)  # fmt: skip
def test_rows_say_in_what_their_cells_differ(zoobench: Command, learnt: Path, column: str, other: RunSpec) -> None:
    """Two rows of the same method have a column that tells them apart, which is not there otherwise."""
    assert column not in zoobench("curves").out
    with Store(learnt) as store:
        add_curve(store, other, [0.3, 0.5])
    rows = markdown_rows(zoobench("curves", "--format", "md").out)
    assert len({row[column] for row in rows if row["method"] == "diffphysics"}) == 2


def markdown_rows(table: str) -> list[dict[str, str]]:
    """The rows of a Markdown table by column."""
    head, _, *body = ([cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines())
    return [dict(zip(head, row, strict=True)) for row in body]


def test_a_table_by_what_was_spent_names_its_command(zoobench: Command, learnt: Path) -> None:
    """Both methods in one table, at what both have spent."""
    out = zoobench("table", "--by", "substeps").out
    assert "best so far at equal substeps, of runs with a budget of 100 episodes and 1000 substeps" in out
    assert "0.2 (all equal)" in out
    assert "made by: zoobench table --by substeps --format table" in out


def test_a_table_at_an_amount_says_who_spent_less(zoobench: Command, learnt: Path) -> None:
    """Random ended at 16 episodes of its own 100, which it was given; in seconds it ended at 1."""
    assert "0.1 (all equal)" in zoobench("table", "--by", "episodes", "--at", "20").out
    out = zoobench("table", "--by", "seconds", "--at", "1.2").out
    assert "no score (n=0 of 2, spent less 2/2)" in out
    assert "made by: zoobench table --by seconds --at 1.2 --format table" in out
    document = json.loads(zoobench("table", "--by", "seconds", "--at", "1.2", "--format", "json").out)
    assert {cell["spent_amount"] for cell in document["cells"]} == {1.2}


@pytest.mark.parametrize("words", [("--at", "5"), ("--by", "substeps", "--at", "0"), ("--by", "iterations")])
def test_amounts_that_mean_nothing_are_refused(zoobench: Command, learnt: Path, words: tuple[str, ...]) -> None:
    """An amount of nothing in particular, no amount, and a currency that methods do not share."""
    assert zoobench("table", *words).code == 2


def test_seconds_of_several_machines_are_not_compared(
    zoobench: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither in a table nor in curves; what else was spent is, and every point is still there for programs."""
    with Store(tmp_path / "zoobench.db") as store:
        add_curve(store, make_spec(), [0.1, 0.2])
        assert zoobench("table", "--by", "seconds").code == 0
        assert zoobench("curves", "--by", "seconds").code == 0
        monkeypatch.setitem(content.PROVENANCE, "cpu", {"model": "Example 1", "cores": 1, "threads": 1})
        add_curve(store, make_spec(method="random-v1"), [0.1, 0.2])
    for words in (["table"], ["curves"], ["curves", "-o", "x.png"]):
        reply = zoobench(*words, "--by", "seconds")
        assert reply.code == 2
        assert "2 machines" in reply.err
        assert "Example 1 (1 cores, 1 threads)" in reply.err
    for words in (["table", "--by", "substeps"], ["curves"], ["curves", "--by", "seconds", "--format", "csv"]):
        assert zoobench(*words).code == 0
    assert zoobench("table", "--by", "seconds", "--method", "random").code == 0


def test_controllers_narrow_the_choice(zoobench: Command, tmp_path: Path) -> None:
    """In curves, tables and results; the footer repeats it."""
    with Store(tmp_path / "zoobench.db") as store:
        add_curve(store, make_spec(), [0.1, 0.2])
        add_curve(store, make_spec(controller="trajectory-v1"), [0.1, 0.2])
    for command, lines in (("results", 3), ("curves", 3)):
        assert len(zoobench(command, "--controller", "traj*").out.splitlines()) == lines
    assert "made by: zoobench table --controller 'traj*'" in zoobench("table", "--controller", "traj*").out
    assert "Did you mean 'trajectory'" in zoobench("table", "--controller", "trajectori").err
