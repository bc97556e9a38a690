"""`doctor`."""

import json
import re
import sqlite3
import tomllib
from pathlib import Path
from typing import Any

import pytest

from tests.cli.conftest import Command
from zoobench.harness import doctor as examining


def verdicts(zoobench: Command, *words: object) -> tuple[int, dict[str, dict[str, Any]]]:
    """Exit code and checks by name."""
    reply = zoobench("doctor", "--format", "json", *words)
    return reply.code, {record["check"]: record for record in json.loads(reply.out)}


@pytest.mark.slow
def test_doctor_finds_a_sound_installation_sound(
    zoobench: Command, database: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every check is made and none is a problem; Taichi really starts, and the cache folder is the one named."""
    monkeypatch.setenv("ZOOBENCH_CACHE", str(tmp_path / "cache"))
    code, checks = verdicts(zoobench)
    assert code == 0
    assert list(checks) == [
        "python", "packages", "taichi", "compile cache", "plug-ins", "database", "disk space"
    ]  # fmt: skip
    assert "problem" not in {check["verdict"] for check in checks.values()}
    assert str(tmp_path / "cache") in checks["compile cache"]["detail"]
    assert "13 runs" in checks["database"]["detail"]


def test_doctor_knows_every_package_that_zoobench_needs() -> None:
    """Those that the project declares, without its extras."""
    project = Path(__file__).parents[2] / "pyproject.toml"
    declared = tomllib.loads(project.read_text(encoding="utf-8"))["project"]["dependencies"]
    assert sorted(examining._PACKAGES) == sorted(re.split("[<>=]", line)[0] for line in declared)


@pytest.fixture
def without_taichi(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out the check that takes seconds."""
    monkeypatch.setattr(examining, "_check_taichi", lambda: iter(()))


@pytest.mark.usefixtures("without_taichi")
def test_doctor_finds_a_damaged_database(zoobench: Command, tmp_path: Path) -> None:
    """A file that is no database is a problem: exit code 1, and the other checks are made all the same."""
    (tmp_path / "zoobench.db").write_text("not a database " * 1000)
    code, checks = verdicts(zoobench)
    assert code == 1
    assert checks["database"]["verdict"] == "problem"
    assert "disk space" in checks


@pytest.mark.usefixtures("without_taichi")
def test_doctor_makes_no_database(zoobench: Command, tmp_path: Path) -> None:
    """Where there is none yet, that is no problem."""
    code, checks = verdicts(zoobench)
    assert (code, checks["database"]["verdict"]) == (0, "ok")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("without_taichi")
def test_doctor_misses_the_folder_of_a_database(zoobench: Command, tmp_path: Path) -> None:
    """`zoobench run` makes the file, but no folder for it."""
    code, checks = verdicts(zoobench, "--db", tmp_path / "nowhere" / "runs.db")
    assert (code, checks["database"]["verdict"]) == (1, "problem")
    assert "no folder" in checks["database"]["detail"]


def test_doctor_reports_a_simulator_that_does_not_start(zoobench: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    """A crash of the probe is a verdict, not a crash of the doctor."""
    monkeypatch.setattr(examining, "_TAICHI_PROBE", "raise SystemExit('no such instruction')")
    code, checks = verdicts(zoobench)
    assert code == 1
    assert "no such instruction" in checks["taichi"]["detail"]


def test_doctor_warns_of_a_cache_that_cannot_be_written(tmp_path: Path) -> None:
    """It costs time, but works without."""
    (tmp_path / "file").write_text("in the way")
    check = examining._check_cache(tmp_path / "file" / "kernels")
    assert check.verdict is examining.Verdict.WARNING
    assert "ZOOBENCH_CACHE" in check.detail


@pytest.mark.usefixtures("without_taichi")
def test_doctor_finds_a_changed_number(zoobench: Command, database: Path) -> None:
    """One that SQLite itself takes for sound."""
    with sqlite3.connect(database) as connection:
        connection.execute("UPDATE finals SET value = value * 2 WHERE run_id < 6 AND name = 'score'")
    connection.close()
    code, checks = verdicts(zoobench)
    assert code == 1
    assert "the results of run 1 have changed; " in checks["database"]["detail"]
    assert "; and 2 more" in checks["database"]["detail"]


@pytest.mark.usefixtures("without_taichi")
def test_doctor_repairs_what_can_be(zoobench: Command, database: Path) -> None:
    """It says what it has done, and finds the database intact."""
    with sqlite3.connect(database) as connection:
        connection.execute("UPDATE finals SET value = value * 2 WHERE run_id = 1 AND name = 'score'")
    connection.close()
    reply = zoobench("doctor", "--repair", "--format", "json")
    assert reply.code == 0
    assert "run 1 is queued again: its results had changed" in reply.err
    assert "nothing to repair" in zoobench("doctor", "--repair", "--format", "json").err
