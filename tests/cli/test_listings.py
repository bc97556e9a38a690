"""`results`, `table`, `show --log` and `status`."""

import csv
import io
import json
import sqlite3
from pathlib import Path

import pytest

from tests.cli.conftest import Command
from tests.report.content import add_done, make_spec
from zoobench.db.store import Store


def test_results_have_a_row_per_run_in_every_format(zoobench: Command, database: Path) -> None:
    """Thirteen runs as json, csv, Markdown and table; the talk about smoke goes to standard error."""
    assert len(json.loads(zoobench("results", "--format", "json").out)) == 13
    assert len(list(csv.DictReader(io.StringIO(zoobench("results", "--format", "csv").out)))) == 13
    assert len(zoobench("results", "--format", "md").out.splitlines()) == 15
    reply = zoobench("results")
    assert len(reply.out.splitlines()) == 15
    assert "smoke" in reply.err


def test_results_of_provisional_environments_come_with_a_word(zoobench: Command, tmp_path: Path) -> None:
    """On standard error, beside the dagger in the table."""
    with Store(tmp_path / "zoobench.db") as store:
        add_done(store, make_spec(env="ocean-v5"), 0.5)
    for words in (["results"], ["table"], ["curves"]):
        reply = zoobench(*words)
        assert "† ocean is provisional" in reply.out + reply.err, words


def test_results_keep_every_digit_and_unit(zoobench: Command, database: Path) -> None:
    """JSON finals are name, value and unit."""
    records = json.loads(zoobench("results", "--format", "json", "--method", "random", "--env", "desert").out)
    assert [record["finals"]["score"] for record in records] == [
        {"value": 0.1 + 0.001 * seed, "unit": "m/s"} for seed in range(3)
    ]


def test_off_a_terminal_nothing_is_cut(zoobench: Command, database: Path) -> None:
    """A table that is piped keeps its long cells and ends no line in blanks."""
    lines = zoobench("table").out.splitlines()
    assert any("no score (n=0 of 3, failed 1/3, queued 1/3, running 1/3)" in line for line in lines)
    assert all(line == line.rstrip() for line in lines)


def test_table_shows_settings_origin_and_no_smoke(zoobench: Command, database: Path) -> None:
    """The title has fidelity and budget, the foot commit and command, and the smoke run is nowhere."""
    out = zoobench("table", "--env", "desert").out
    assert "fidelity draft, budget 1000 substeps, 10 frames" in out
    assert "0123456789ab with uncommitted changes" in out
    assert "made by: zoobench table --env desert --format table" in out
    assert "smoke" not in out


def test_table_as_markdown_has_the_winner_in_bold(zoobench: Command, database: Path) -> None:
    """Diffphysics on the desert."""
    assert "| **1.0010 ± 0.0025** |" in zoobench("table", "--format", "md").out


def test_the_winner_has_a_star_where_bold_cannot_be_seen(zoobench: Command, database: Path) -> None:
    """Off a terminal the one winner is marked in the text."""
    starred = [line for line in zoobench("table").out.splitlines() if "0.0025 *" in line]
    assert len(starred) == 1
    assert starred[0].startswith("desert")


def test_table_as_json_and_csv_is_long(zoobench: Command, database: Path) -> None:
    """One record per cell with the ends of the interval, and the provenance beside them."""
    document = json.loads(zoobench("table", "--format", "json").out)
    cell = next(cell for cell in document["cells"] if cell["winner"])
    assert cell["method"] == "diffphysics-v2[lr=0.1]"
    assert cell["mean"] == pytest.approx(1.001)
    assert cell["low"] < cell["mean"] < cell["high"]
    assert document["provenance"]["machines"] == ["Example 9000 (4 cores, 8 threads), 8 GiB"]
    rows = list(csv.DictReader(io.StringIO(zoobench("table", "--format", "csv").out)))
    assert [float(row["mean"]) for row in rows if row["winner"] == "True"] == [cell["mean"]]


def test_an_empty_database_says_what_to_type(zoobench: Command, tmp_path: Path) -> None:
    """Nothing to compare is no error."""
    Store(tmp_path / "zoobench.db").close()
    reply = zoobench("table")
    assert (reply.code, reply.out) == (0, "")
    assert "zoobench run" in reply.err
    assert json.loads(zoobench("table", "--format", "json").out)["cells"] == []


def test_status_counts_and_shows_runs_in_progress(zoobench: Command, database: Path) -> None:
    """As text and as JSON: attempt, progress and score of the one that runs."""
    assert zoobench("status").out.startswith("1 queued, 1 running, 9 done, 1 failed, 1 diverged")
    document = json.loads(zoobench("status", "--format", "json").out)
    assert document["counts"]["done"] == 9
    (run,) = document["running"]
    assert (run["run"], run["attempt"], run["progress"], run["score"]) == (11, 1, 0.25, 0.05)


def test_status_watch_ends_when_nothing_is_left(zoobench: Command, tmp_path: Path) -> None:
    """With no open run it shows the state once and returns."""
    Store(tmp_path / "zoobench.db").close()
    reply = zoobench("status", "--watch")
    assert reply.code == 0
    assert "no runs" in reply.out


def test_logs_give_the_lines_and_the_traceback(zoobench: Command, database: Path) -> None:
    """Of the failed run, on standard output."""
    out = zoobench("show", 10, "--log").out
    assert "a line of the child" in out
    assert "ValueError: boom" in out


def test_logs_of_an_attempt_that_was_not_made(zoobench: Command, database: Path) -> None:
    """It is a mistake of the command line, and not silence."""
    reply = zoobench("show", 10, "--log", "--attempt", 9)
    assert reply.code == 2
    assert "Run 10 has no attempt 9" in reply.err


def test_results_are_chosen_by_parameters_and_versions(zoobench: Command, database: Path) -> None:
    """Those that no run has are refused with those that there are, instead of finding nothing."""
    every = json.loads(zoobench("results", "--format", "json", "--method", "diffphysics").out)
    chosen = zoobench("results", "--format", "json", "--method", "diff*[lr=0.1],diffphysics-v2[lr=0.1]")
    assert json.loads(chosen.out) == every
    for method in ("diffphysics[lr=0.2]", "diffphysics-v1"):
        reply = zoobench("results", "--method", method)
        assert (reply.code, reply.out) == (2, "")
        assert f"No method in the database is {method!r}. There are diffphysics-v2[lr=0.1]." in reply.err


def test_options_that_leave_nothing_are_refused(zoobench: Command, database: Path) -> None:
    """A glob without a match, and options that no run fits together: not an empty table."""
    assert "Did you mean 'desert'" in zoobench("table", "--env", "dessert*").err
    reply = zoobench("results", "--env", "ice", "--method", "diffphysics", "--fidelity", "smoke")
    assert reply.code == 2
    assert "No run in the database is all that --env, --method, --fidelity ask for" in reply.err


def test_logs_of_a_run_that_said_nothing(zoobench: Command, database: Path) -> None:
    """It says so, and in which state the run is."""
    assert "Run 12 is queued" in zoobench("show", 12, "--log").err


def test_escape_sequences_of_a_run_reach_no_terminal(zoobench: Command, database: Path) -> None:
    """In its reason, its log, its traceback and the text of an error; they are seen instead."""
    with sqlite3.connect(database) as connection:
        connection.execute("UPDATE runs SET reason = char(27) || ']0;title' || char(7) WHERE reason IS NOT NULL")
        connection.execute("UPDATE logs SET text = char(27) || '[2J' || text")
        connection.execute("UPDATE attempts SET traceback = char(27) || '[2J' WHERE traceback IS NOT NULL")
        connection.execute("UPDATE attempts SET reason = char(27) || '[2J'")  # is said on standard error
    connection.close()
    lines = (("results",), ("show", "10", "--log"), ("show", "10"), ("show", "\x1b[2J", "--log"))
    replies = [zoobench(*words) for words in lines]
    for reply in replies:
        assert "\x1b" not in reply.out + reply.err
        assert "\x07" not in reply.out + reply.err
        assert "\\x1b" in reply.out + reply.err


def test_a_table_as_latex_has_a_caption_and_its_origin(zoobench: Command, database: Path) -> None:
    """The winner is bold, and what does not belong on paper is a comment."""
    out = zoobench("table", "--format", "latex").out
    assert r"\caption{Score [m/s]: fidelity draft, budget 1000 substeps, 10 frames, 3 seeds}" in out
    assert r"\bfseries 1.0010 \pm 0.0025" in out
    tail = out[out.index(r"\end{table}") :].splitlines()[2:]
    assert all(line.startswith("% ") for line in tail)


def test_a_pivot_has_environments_side_by_side(zoobench: Command, database: Path) -> None:
    """The same cells, with the winner, in a row for each method; the command that repeats it says so."""
    out = zoobench("table", "--pivot", "--format", "md").out
    assert "| task | design | method | desert [m/s] | ice [m/s] |" in out
    first = next(line for line in out.splitlines() if line.startswith("| turning"))
    assert first == (
        "| turning | caterpillar | diffphysics | **1.0010 ± 0.0025** | 0.5 (n=2 of 3, all equal, diverged 1/3) |"
    )
    assert "made by: zoobench table --pivot --format md" in out


def test_methods_are_compared_over_all_rows(zoobench: Command, database: Path) -> None:
    """`table --aggregate` adds a table over rows, says how it is computed, and its command makes it again."""
    reply = zoobench("table", "--aggregate")
    assert "better than random" in reply.out
    assert "Agarwal et al. 2021" in reply.out
    assert "zoobench table --aggregate" in reply.out
    (over,) = json.loads(zoobench("table", "--aggregate", "-f", "json").out)["over_rows"]
    assert over[0]["statistic"] == "improvement"
    assert over[0]["method"].startswith("diffphysics")
    assert zoobench("table", "--aggregate", "-f", "csv").code == 2
