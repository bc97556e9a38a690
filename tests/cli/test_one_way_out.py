"""What every listing owes: rows that differ, numbers as numbers, names of others that do nothing, any terminal."""

import csv
import io
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from markdown_it import MarkdownIt

from tests.cli.conftest import ROOT, Command
from tests.report.content import add_curve, add_ended, make_spec
from zoobench.db.rows import TRANSFER, Ending, FinalRow, RunState, StudyRow
from zoobench.db.store import Store
from zoobench.report.foreign_text import _is_number
from zoobench.spec import Ref

ODD = "\x1b[31mred\x9b2J\u202e<script>alert(1)</script>[here](http://x)|\\&%$#_{}~^"

LISTINGS = (
    ("results",),
    ("table",),
    ("table", "--pivot"),
    ("table", "--normalised", "--by", "substeps"),
    ("curves",),
    ("status",),
    ("evaluate",),
    ("run", "--dry-run", "--env", "ground,ground[friction=0.1]", "--task", "turning", "--seeds", "2"),
    ("list",),
    ("list", "presets"),
    ("verify", "stability", "--list"),
    ("verify", "effects", "--table", "coverage", "--env", "ground"),
    ("verify", "accuracy", "show", "--published", "--env", "ground", "--table", "levels"),
    ("leaderboard", "show", "gaits"),
)
EACH_LISTING = pytest.mark.parametrize(
    "words",
    [
        pytest.param(words, id=" ".join(words), marks=pytest.mark.slow if words[0] == "leaderboard" else ())
        for words in LISTINGS
    ],
)
_WORDS = {
    "about", "command", "components", "detail", "external", "note", "provenance", "provisional", "reason", "spec",
    "summary", "superseded", "undecided", "walls", "without_it", "cells",
}  # fmt: skip
"""Fields of free text."""
_NUMBER_IN_TEXT = re.compile(r"±|\d ?%|^-?\d+(\.\d+)?$|(^|\s)\d+(\.\d+)? (m/s|m|s|min|h|substeps|episodes|runs)\b")


@pytest.fixture
def odd(odd_database: Path, tmp_path: Path) -> Path:
    """The odd database, in the present folder."""
    return Path(shutil.copy(odd_database, tmp_path / "zoobench.db"))


@pytest.fixture(scope="module")
def odd_database(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A database of somebody with names that would do more than stand there: methods, finals, units and reasons."""
    path = tmp_path_factory.mktemp("odd") / "zoobench.db"
    method = Ref(ODD, 1, (("lr", 0.1), ("text", ODD)))
    with Store(path) as store:
        for seed in range(3):
            add_curve(store, make_spec(env="ice-v1", seed=seed), [0.1, 0.2 + 0.01 * seed], unit="m/s")
            add_curve(store, make_spec(method="random-v1", env="ice-v1", seed=seed), [0.1, 0.1], unit="m/s")
            path_run = replace(make_spec(seed=seed), task=Ref("waypoint-following", 1), method=method)
            finals = (FinalRow("score", -0.01 - 0.001 * seed, ODD), FinalRow(ODD, 1.0, ODD), FinalRow("state", 1.0))
            add_ended(store, path_run, Ending(RunState.DONE, finals=finals))
        add_ended(store, make_spec(seed=3), Ending(RunState.FAILED, ODD))
        document = {
            "run": 1, "key": "", "design": "fish-v1", "method": "cmaes-v1", "seed": 0,
            "home": ["ground-v1", "turning-v1", "draft-v1"], "task": "turning-v1", "fidelity": "draft-v1",
            "frames": 100, "score": 0.5, "unit": ODD, "reason": "",
        }  # fmt: skip
        envs = ("ground-v1[youngs_modulus=5000.0]", "ground-v1[youngs_modulus=20000.0]")
        rows = [StudyRow(env, "OK", {**document, "env": env}) for env in envs]
        list(store.save_study(TRANSFER, rows, provenance={}))
    return path


def texts_of(value: Any, name: str = "") -> Iterator[tuple[str, str]]:
    """Every text in plain data with the name of its field, but those of free text."""
    if isinstance(value, dict):
        for key, item in value.items():
            if key not in _WORDS or isinstance(item, list):
                yield from texts_of(item, key)
    elif isinstance(value, list):
        for item in value:
            yield from texts_of(item, name)
    elif isinstance(value, str) and name not in _WORDS:
        yield name, value


def lists_of(value: Any) -> Iterator[list[Any]]:
    """The lists of records in plain data."""
    if isinstance(value, list) and value and isinstance(value[0], dict):
        yield value
    for item in value.values() if isinstance(value, dict) else ():
        yield from lists_of(item)


@EACH_LISTING
def test_programs_get_rows_that_differ_and_numbers_as_numbers(
    zoobench: Command, odd: Path, words: tuple[str, ...]
) -> None:
    """In JSON and CSV: no two rows alike, no column twice, and no number inside a text."""
    reply = zoobench(*words, "--format", "json")
    assert reply.code == 0, reply.err
    document = json.loads(reply.out)
    for rows in lists_of(document):
        assert len({json.dumps(row, sort_keys=True) for row in rows}) == len(rows)
    provenance = document.pop("provenance", None) if isinstance(document, dict) else None
    assert provenance is None or "command" in provenance
    for name, text in texts_of(document):
        assert not _NUMBER_IN_TEXT.search(text), (name, text)
    reply = zoobench(*words, "--format", "csv")
    assert reply.code == 0, reply.err
    header, *rows = csv.reader(io.StringIO(reply.out))
    assert len(set(header)) == len(header)
    assert len(set(map(tuple, rows))) == len(rows)
    for row in rows:
        assert len(row) == len(header)
        for name, text in zip(header, row, strict=True):
            is_free = name in _WORDS or _is_number(text)
            assert is_free or not _NUMBER_IN_TEXT.search(text), (name, text)


@EACH_LISTING
def test_names_of_others_do_nothing(zoobench: Command, odd: Path, words: tuple[str, ...]) -> None:
    """On a terminal, in Markdown and in LaTeX, in cells and headings and titles; people's rows differ, too."""
    shown, latex = zoobench(*words).out, zoobench(*words, "--format", "latex").out
    for text in (shown, latex):
        assert all(sign.isprintable() or sign == "\n" for sign in text)
    code = "\n".join(line for line in latex.splitlines() if not line.startswith("%"))
    assert "<" not in code
    assert not re.search(r"(?<!\\)#", code)
    bare = re.sub(r"\\[\\{}]", "", code)
    assert bare.count("{") == bare.count("}")
    markdown = zoobench(*words, "--format", "md").out
    assert all(sign.isprintable() or sign == "\n" for sign in markdown)
    html = MarkdownIt("commonmark", {"html": True}).enable("table").render(markdown)
    assert "<script" not in html
    assert "href" not in html
    lines = markdown.splitlines()
    heads = {number for number, line in enumerate(lines) if "".join(lines[number + 1 : number + 2]).startswith("| ---")}
    rows = [line for number, line in enumerate(lines) if line.startswith("| ") and number not in heads]
    rows = [line for line in rows if not line.startswith("| ---")]
    assert len(set(rows)) == len(rows)
    assert rows or words in (("status",), ("leaderboard", "show", "gaits"))


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="needs pdflatex with booktabs and siunitx")
def test_latex_takes_every_listing(zoobench: Command, odd: Path, tmp_path: Path) -> None:
    """With strange names in cells, headings and captions, each listing is typeset without an error."""
    listings = [zoobench(*words, "--format", "latex").out for words in LISTINGS]
    look = ("--unit", "mm/s", "--caption", ODD, "--label", "tab:odd", "--rename", f"diffphysics={ODD}")
    listings.append(zoobench("table", "--env", "ice", *look, "--format", "latex").out)
    head = r"\documentclass{article}\usepackage{booktabs,siunitx}\begin{document}"
    (tmp_path / "tables.tex").write_text("\n\n".join([head, *listings, r"\end{document}"]))
    program = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "tables.tex"]
    done = subprocess.run(program, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-2000:]
    assert "Missing character" not in (tmp_path / "tables.log").read_text()


@pytest.mark.slow
def test_a_stream_that_lacks_signs_gets_others(odd: Path) -> None:
    """Code page 1252 lacks rules of tables and letters of most scripts: tables are printed, and JSON means the same."""
    environ = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONIOENCODING": "cp1252"}

    def run(*words: str) -> subprocess.CompletedProcess[bytes]:
        program = [sys.executable, "-m", "zoobench", *words, "--db", str(odd)]
        return subprocess.run(program, capture_output=True, env=environ, check=False)

    done = run("table")
    assert done.returncode == 0, done.stderr
    assert b"----" in done.stdout
    done = run("results", "--format", "json")
    names = {name for record in json.loads(done.stdout.decode("cp1252")) for name in record["finals"]}
    assert ODD in names


def test_a_paper_gets_the_table_that_it_asks_for(zoobench: Command, odd: Path) -> None:
    """Columns in an order, names, unit, caption and label; what is not there is refused with what is."""
    look = ("--columns", "design,random,diffphysics", "--rename", "diffphysics=Gradient (ours)", "--unit", "mm/s")
    reply = zoobench("table", "--env", "ice", *look, "--caption", "Speeds", "--label", "tab:speeds", "-f", "latex")
    assert reply.code == 0, reply.err
    code = [line for line in reply.out.splitlines() if not line.startswith("%")]
    assert code[:4] == [r"\begin{table}", r"\centering", r"\caption{Speeds}", r"\label{tab:speeds}"]
    assert code[4].startswith(r"\begin{tabular}{l S[table-format = 3")
    assert code[6] == r"design & {random [mm/s]} & {Gradient (ours) [mm/s]} \\"
    assert code[8] == r"caterpillar & 100{\scriptsize~(all equal)} & 210 \pm 25 \\"
    assert "--columns design,random,diffphysics --unit mm/s" in reply.out
    for words, message in (
        (("--columns", "env,lion"), "Unknown column 'lion'"),
        (("--rename", "lion=x"), "'lion'"),
        (("--rename", "lion"), "Write --rename lion='Lion (ours)'"),
        (("--unit", "furlongs"), "The units are"),
        (("--label", "a b"), "no label"),
        (("--unit", "mm/s", "-f", "csv"), "changes tables for people"),
    ):
        refused = zoobench("table", *words)
        assert refused.code == 2, words
        assert message in refused.err
