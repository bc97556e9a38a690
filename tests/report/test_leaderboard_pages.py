"""The pages of a leaderboard: made from the export alone, with all that is missing or failed."""

import csv
import io
import shlex
from dataclasses import replace
from pathlib import Path

import pytest

from tests.report.boards import CMAES, asked, board, unknown
from tests.report.test_undecided import Known
from zoobench.db.rows import RunState
from zoobench.report.leaderboard_export import from_text, to_text
from zoobench.report.leaderboard_pages import csv_page, first_difference, markdown_page, pages
from zoobench.spec import Ref


def test_pages_are_a_function_of_the_export(tmp_path: Path) -> None:
    """What is made from the JSON is what was made from the database."""
    found = board(tmp_path)
    assert pages(from_text(to_text(found), "mine.json"), unknown) == pages(found, unknown)


def test_the_page_shows_what_is_missing_and_why_others_have_no_score(tmp_path: Path) -> None:
    """Counts, missing cells, the row that is wholly missing left out, reasons, origin; the smoke run is nowhere."""
    text = markdown_page(board(tmp_path), unknown)
    assert text.startswith("# mine\n\nA test of pages.\n")
    assert "- Runs: 1 queued, 1 running, 8 done, 1 failed, 1 diverged, 1 skipped, 15 missing, of 28;" in text
    assert "- Rows (environment, task, design): 2 of 3; the others have no run yet." in text
    assert "`zoobench run --suite mine.yaml` executes the remaining runs." in text
    assert "## Score [m/s]: fidelity draft, budget 1000 substeps, 10 frames, 3 seeds" in text
    assert "| desert | turning | caterpillar | missing | 1.0010 ± 0.0025 | 0.1010 ± 0.0025 |" in text
    assert "| ice | turning | caterpillar | sine-basis | diffphysics | 2 | diverged | det F is -1. |" in text
    assert "| ice | turning | caterpillar | sine-basis | random | 0 | failed | ValueError: boom |" in text
    assert "| desert | turning | caterpillar | sine-basis | neat | 0 | skipped | needs a space |" in text
    assert "snow" not in text
    assert "smoke" not in text
    assert "- commit: 0123456789ab with uncommitted changes" in text
    assert text.endswith("- made by: zoobench leaderboard publish mine.yaml leaderboards\n")


def test_the_page_says_which_animals_its_level_cannot_rank(tmp_path: Path) -> None:
    """Below their table, where no order of two is known or these are nearer; methods that are too near have a mark."""
    found = board(tmp_path)
    pandas = [replace(run, spec=replace(run.spec, design=Ref("panda", 1))) for run in found.rows]
    both = replace(found, rows=(*found.rows, *pandas))
    text = markdown_page(both, unknown)
    table, note = text.split("\n\n- no order of two bodies is known at draft: desert; ice\n")
    assert table.splitlines()[-1].startswith("| ice |")
    assert note.startswith("\n## Without a score")

    def orders(*place: object) -> Known:
        return Known(20.0)

    text = markdown_page(both, orders)
    assert "draft tells the order of two bodies above a ratio of 20 (measured on baby-seal, panda), not that of" in text
    assert "| 0.1010 ± 0.0025 ‡ |" in text
    told = {
        line["undecided"] for line in csv.DictReader(io.StringIO(csv_page(both, orders))) if line["mean"] == "0.101"
    }
    assert told == {"True"}


def test_a_leaderboard_without_a_run_is_a_short_page(tmp_path: Path) -> None:
    """Nothing is done: no table, no commands, no origin."""
    found = board(tmp_path)
    text = markdown_page(type(found)("mine", "mine", "a test", tuple(type(e)(e.spec) for e in found.rows)), unknown)
    assert "- Runs: 28 missing, of 28; 0 s of computing." in text
    assert "##" not in text


def test_a_complete_leaderboard_says_so(tmp_path: Path) -> None:
    """Nothing is said to be left where every run is done."""
    found = board(tmp_path)
    text = markdown_page(replace(found, rows=tuple(run for run in found.rows if run.state is RunState.DONE)), unknown)
    assert "- Runs: 8 done, of 8;" in text
    assert "- Rows (environment, task, design): 2 of 2.\n" in text
    assert "what is left" not in text


def test_the_csv_has_a_line_for_every_cell_of_the_rows_that_have_a_run(tmp_path: Path) -> None:
    """Six cells, two of them missing; the row of snow, which has none, is left out, and what cannot be is no cell."""
    rows = list(csv.DictReader(io.StringIO(csv_page(board(tmp_path), unknown))))
    assert len(rows) == 6
    by_name = {(row["env"].partition("-")[0], row["method"]): row for row in rows}
    assert {by_name[env, CMAES]["missing"] for env, _ in by_name} == {"3"}
    diverged = by_name["ice", "diffphysics-v2[lr=0.1]"]
    assert (diverged["n"], diverged["asked"], diverged["reasons"]) == ("2", "3", "seed 2 diverged: det F is -1.")
    assert by_name["desert", CMAES]["mean"] == ""


def test_computed_numbers_have_nine_digits(tmp_path: Path) -> None:
    """The last ones of an interval come from a library, and the file is compared byte for byte."""
    rows = csv.DictReader(io.StringIO(csv_page(board(tmp_path), unknown)))
    texts = [row[name] for row in rows for name in ("mean", "low", "high") if row[name]]
    assert len(texts) == 7, "three means, two with an interval"
    assert all(len(text.lstrip("-0.").replace(".", "")) <= 9 for text in texts)


def test_every_row_has_the_command_that_repeats_it(tmp_path: Path) -> None:
    """A cell's names all settings and seeds in the CSV, a row's the methods that were run in the Markdown."""
    first = next(csv.DictReader(io.StringIO(csv_page(board(tmp_path), unknown))))
    words = shlex.split(first["repeat"])
    spec = next(spec for spec, _ in asked() if str(spec.method) == CMAES)
    options = dict(zip(words[2::2], words[3::2], strict=True))
    assert words[:2] == ["zoobench", "run"]
    assert options["--method"] == CMAES
    assert options["--seeds"] == "0,1,2"
    assert options["--budget"] == str(spec.budget)
    assert {f"--{axis}" for axis in ("env", "task", "design", "controller", "fidelity", "frames")} < set(options)
    commands = [
        line for line in markdown_page(board(tmp_path), unknown).splitlines() if line.startswith("zoobench run --env")
    ]
    assert len(commands) == 2
    assert all("'diffphysics-v2[lr=0.1],random-v1'" in command for command in commands)


@pytest.mark.parametrize(
    ("committed", "rebuilt", "expected"),
    [
        ("a\nb\n", "a\nb\n", None),
        ("a\nb\nc\n", "a\nB\nC\n", (2, "b", "B")),
        ("a\n", "a\nb\n", (2, "", "b")),
        ("a\nb\n", "a", (2, "b", None)),
        ("a", "a\n", (2, None, "")),
        ("a\r\n", "a\n", (1, "a\r", "a")),
    ],
)
def test_the_first_differing_line_is_found(
    committed: str, rebuilt: str, expected: tuple[int, str | None, str | None] | None
) -> None:
    """By number from 1, with both versions; ends of lines and of files count."""
    assert first_difference(committed, rebuilt) == expected
