"""`zoobench verify stability`: the table, the stored rows and the exit code."""

import json
from pathlib import Path

import pytest

from tests.cli.conftest import Command
from zoobench.db.query import Reader
from zoobench_verify.cases import Case
from zoobench_verify.stability import stability_suite
from zoobench_verify.stability.episode_recorder import EpisodeRecorder


def test_stability_prints_and_stores_its_rows(zoobench: Command, tmp_path: Path) -> None:
    """One row per case, in the output and in the database."""
    reply = zoobench("verify", "stability", "--case", "one-particle,bad-actuation", "--format", "json")
    rows = json.loads(reply.out)
    assert reply.code == 0, reply.err
    assert [(row["case"], row["verdict"]) for row in rows] == [("bad-actuation", "pass"), ("one-particle", "pass")]
    with Reader(tmp_path / "zoobench.db", create=False) as reader:
        study = reader.study("stability")
    assert study is not None
    assert study.finished_at is not None
    assert [row.case for row in study.rows] == ["bad-actuation", "one-particle"]
    assert study.rows[1].document["measured"] == rows[1]["measured"]


def test_a_failing_case_ends_in_exit_code_1(zoobench: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    """The row names the missed bound."""
    hopeless = Case("hopeless", "", lambda record: record.at_most("x", 2.0, 1.0), recorder=EpisodeRecorder)
    monkeypatch.setattr(stability_suite, "CASES", [hopeless])
    reply = zoobench("verify", "stability", "--format", "csv")
    assert reply.code == 1
    assert "hopeless,fail,FAILS x 2 <= 1" in reply.out


def test_stability_lists_its_cases(zoobench: Command) -> None:
    """Without running any, and without a database."""
    reply = zoobench("verify", "stability", "--list", "--format", "json")
    assert len(json.loads(reply.out)) >= 25
