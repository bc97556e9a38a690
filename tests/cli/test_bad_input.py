"""Bad input: one clear message, exit code 2, no traceback, and nothing lost."""

import hashlib
import os
import sqlite3
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.cli.conftest import Command
from tests.report.content import fill

RUN = ("run", "--env", "desert", "--task", "turning")
READERS = (("results",), ("table",), ("status",), ("show", "1"), ("show", "1", "--log"))


def digest(path: Path) -> str:
    """The content of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["run", "--env", "dessert", "--task", "turning"], "Did you mean 'desert'?"),
        (["run", "--env", "xyz*", "--task", "turning"], "Unknown environment 'xyz*'"),
        (["run", "--env", "desert", "--task", "turnin"], "Did you mean 'turning'?"),
        (["run", "--env", "desert[", "--task", "turning"], "Cannot read 'desert['"),
        (["run", "--env", "Desert!", "--task", "turning"], "Cannot read 'Desert!'"),
        ([*RUN, "--method", "diffphysics[lr]"], "Write key=value"),
        ([*RUN, "--method", "diffphysics[lr=fast]"], "lr"),
        ([*RUN, "--method", "diffphysics[rl=1]"], "Did you mean"),
        (["run", "--env", "desert[obstacle=slot]", "--task", "turning"], "those that have it: ground, ice."),
        ([*RUN, "--method", "diffphysics-v99"], "version 99"),
        ([*RUN, "--seeds", "-1"], "negative"),
        ([*RUN, "--seeds", "0,-2"], "negative"),
        ([*RUN, "--seeds", "many"], "Cannot read 'many' as seeds"),
        ([*RUN, "--seeds", "0"], "Write how many, as in 1 for seed 0 alone"),
        ([*RUN, "--seeds", ""], "no seed at all"),
        ([*RUN, "--budget", ""], "Cannot read '' as a budget"),
        ([*RUN, "--seeds", "1000000000"], "means 1,000,000,000 seeds, and 10,000 are the most"),
        ([*RUN, "--seeds", "1e9"], "Cannot read '1e9' as seeds"),
        ([*RUN, "--budget", "lots"], "Cannot read 'lots' as a budget"),
        ([*RUN, "--budget", "0"], "positive"),
        ([*RUN, "--budget", "10 parsecs"], "parsecs"),
        ([*RUN, "--budget", "-5"], "positive"),
        ([*RUN, "--budget", "1e999"], "finite"),
        ([*RUN, "--seeds", f"{2**64},"], "seed=18446744073709551616 is too large"),
        ([*RUN, "--frames", str(2**40)], "frames=1099511627776 is too large"),
        ([*RUN, "--method", "diffphysics[restarts=0]"], "at least 1 restart"),
        ([*RUN, "--fidelity", "draft[courant=2]"], "Courant"),
        ([*RUN, "--frames", "0"], "Give at least 1"),
        ([*RUN, "--frames", "many"], "--frames"),
        ([*RUN, "--fidelity", "draftt"], "Did you mean 'draft'?"),
        ([*RUN, "--preset", "quik"], "Did you mean 'quick'?"),
        ([*RUN, "--smoke", "--preset", "paper"], "Leave one out"),
        ([*RUN, "--timeout", "soon"], "Cannot read 'soon' as a time limit"),
        ([*RUN, "--memory", "two"], "Cannot read 'two' as a size of memory"),
        ([*RUN, "-j", "0"], "--jobs"),
        ([*RUN, "--retry", "everything"], "--retry"),
        ([*RUN, "--format", "json"], "--format json is for --dry-run"),
        (["show", "1", "--attempt", "2"], "Give --log, too"),
        (["run", "--dry-run", "--env", "dessert", "--task", "turning"], "Did you mean 'desert'?"),
        (["design", "picture", "--fidelity", "smoke,draft"], "one fidelity is taken here"),
        (["design", "picture", "--env", "dessert"], "Did you mean 'desert'?"),
        (["render", "1", "-o", "run.avi"], ".mp4"),
        (["verify", "effects", "--env", "desert", "--fidelity", "*"], "one fidelity is taken here"),
        (["verify", "gradcheck", "--controller", "sine-basis,sine-basis[fast=60.0]"], "one controller is taken here"),
        (["verify", "gradcheck", "--seed", "-1"], "--seed"),
        (["verify", "bench", "--env", "dessert"], "Did you mean 'desert'?"),
        (["verify", "accuracy", "run", "--env", "ground", "--energy", "drft", "--dry-run"], "Did you mean 'draft'?"),
        (["report", "-o", "report.pdf"], "'report.pdf' does not end in .html"),
        (["status", "--db", ""], "--db '' names no database"),
        ([*RUN, "--db", ""], "--db '' names no database"),
        (["show", "best:ground/turning/caterpillar"], "is a solution on a leaderboard and no run of a database"),
        (["db", "merge", "", ""], "with an empty name"),
        (["db", "merge", "zoobench.db", ""], "with an empty name"),
        (["run", "--suite", "none.yaml"], "Cannot read the suite 'none.yaml': No such file or directory. Give"),
    ],
)
def test_bad_words_are_refused_before_anything_happens(
    zoobench: Command, tmp_path: Path, words: list[str], message: str
) -> None:
    """The message names the word, and no database is made."""
    reply = zoobench(*words)
    assert reply.code == 2
    assert message in reply.err
    assert "Traceback" not in reply.err
    assert reply.out == ""
    assert list(tmp_path.iterdir()) == []


def test_a_file_in_the_way_of_a_folder_is_named_without_numbers_of_errors(
    zoobench: Command, tmp_path: Path, database: Path
) -> None:
    """Nor is a file for a moment named, which nobody has heard of."""
    suite = tmp_path / "mine.yaml"
    suite.write_text(
        "summary: a\ngrids: [{envs: ground, tasks: turning, designs: caterpillar, controllers: sine-basis, "
        "methods: random, seeds: 1, budget: 100, fidelity: draft, frames: 10}]\n"
    )
    (tmp_path / "taken").touch()
    reply = zoobench("leaderboard", "publish", suite, "taken")
    assert reply.code == 2
    assert "Errno" not in reply.err
    assert ".part" not in reply.err


@pytest.mark.parametrize("words", [*READERS, RUN, ("run", "--dry-run", *RUN[1:])])
def test_a_file_that_is_no_database_is_refused_and_left_alone(
    zoobench: Command, tmp_path: Path, words: tuple[str, ...]
) -> None:
    """A text file keeps every byte."""
    path = tmp_path / "notes.txt"
    path.write_text("This is not a database, and precious. " * 100)
    before = digest(path)
    reply = zoobench(*words, "--db", path)
    assert reply.code == 2
    assert "not an SQLite database" in reply.err
    assert "Traceback" not in reply.err
    assert digest(path) == before


def test_the_database_of_another_program_is_refused_and_left_alone(zoobench: Command, tmp_path: Path) -> None:
    """Its tables stay as they are, and no table of ours is added."""
    path = tmp_path / "other.db"
    with sqlite3.connect(path) as connection:
        connection.execute("CREATE TABLE recipes (name TEXT)")
        connection.execute("INSERT INTO recipes VALUES ('soup')")
    connection.close()
    reply = zoobench(*RUN, "--db", path)
    assert reply.code == 2
    assert "another program" in reply.err
    connection = sqlite3.connect(path)
    assert connection.execute("SELECT name FROM sqlite_master").fetchall() == [("recipes",)]
    assert connection.execute("SELECT name FROM recipes").fetchall() == [("soup",)]
    connection.close()


@pytest.mark.parametrize("words", READERS)
def test_a_missing_database_is_not_made_by_reading(zoobench: Command, tmp_path: Path, words: tuple[str, ...]) -> None:
    """The message says how to start one."""
    reply = zoobench(*words)
    assert reply.code == 2
    assert "There is no database zoobench.db" in reply.err
    assert list(tmp_path.iterdir()) == []


def test_an_empty_file_is_not_made_a_database_by_reading(zoobench: Command, tmp_path: Path) -> None:
    """Nor by `merge`, whose source stays as it is."""
    (tmp_path / "zoobench.db").touch()
    for words in (("status",), ("db", "merge", "other.db", "zoobench.db")):
        reply = zoobench(*words)
        assert reply.code == 2
        assert "zoobench.db is empty, so no database" in reply.err
    assert not (tmp_path / "zoobench.db").stat().st_size


@pytest.mark.parametrize("words", [("results",), RUN])
def test_a_folder_is_no_database(zoobench: Command, tmp_path: Path, words: tuple[str, ...]) -> None:
    """Nor is a place in a folder that does not exist."""
    assert zoobench(*words, "--db", tmp_path).code == 2
    reply = zoobench(*words, "--db", tmp_path / "no" / "where.db")
    assert reply.code == 2
    assert "There is no folder" in reply.err


@contextmanager
def without_privileges() -> Iterator[None]:
    """The superuser may read everything, so be nobody for a while."""
    if os.geteuid() != 0:
        yield
        return
    os.seteuid(65534)
    try:
        yield
    finally:
        os.seteuid(0)


@pytest.mark.parametrize("words", [("results",), RUN])
def test_an_unreadable_database_is_refused(zoobench: Command, words: tuple[str, ...]) -> None:
    """No permission to read: said so, and the content stays."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder).chmod(0o755)
        path = fill(Path(folder) / "runs.db")
        before = digest(path)
        # Answers once, so that every module is loaded before the privileges go.
        assert zoobench("results", "--db", path).code == 0
        assert zoobench("run", "--dry-run", *RUN[1:], "--db", path).code == 0
        path.chmod(0)
        with without_privileges():
            reply = zoobench(*words, "--db", path)
        assert reply.code == 2
        assert "No permission to open" in reply.err
        assert "Traceback" not in reply.err
        assert digest(path) == before


@pytest.mark.parametrize(
    "words", [("show", "99"), ("show", "99", "--log"), ("show", "abc", "--log"), ("results", "--env", "dessert")]
)
def test_a_run_or_name_that_the_database_has_not(zoobench: Command, database: Path, words: tuple[str, ...]) -> None:
    """A usage error, not an empty answer."""
    reply = zoobench(*words)
    assert (reply.code, reply.out) == (2, "")
    assert reply.err.startswith("Error: ")
