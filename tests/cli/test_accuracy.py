"""`zoobench accuracy`: the study is carried out, kept, judged again, drawn and exported."""

import json

import pytest

from tests.cli.conftest import Command


@pytest.mark.slow
def test_the_study_is_carried_out_once_and_judged_as_often_as_wanted(zoobench: Command) -> None:
    """From the database and from an exported file: the same tables; a picture is drawn; nothing is done twice."""
    study = ("accuracy", "--env", "ground", "--format", "json")
    first = zoobench(*study, "--quick", "--repeats", 1, "--export", "a.json", "--plots", ".")
    assert first.code == 0, first.err
    tables = json.loads(first.out)
    assert [row["fidelity"] for row in tables["levels"] if row["task"] == "turning"] == ["draft", "standard"]
    assert all(row["seconds"] > 0 for row in tables["levels"])
    assert tables["levels"][0]["error"] > 0
    assert [row["fidelity"] for row in tables["energy"]] == ["draft", "standard"]
    assert all(abs(row["unexplained"]) < 1 for row in tables["energy"])
    assert "drawn: accuracy-ground.png" in first.err
    assert "drawn: accuracy-energy.png" in first.err
    assert json.loads(zoobench(*study, "--plot").out) == tables
    again = json.loads(zoobench(*study, "--from", "a.json").out)
    assert again["levels"][0]["error"] == pytest.approx(tables["levels"][0]["error"], rel=1e-4)
    repeated = zoobench(*study, "--quick", "--repeats", 1)
    assert "0 new, 4 done already" in repeated.err
    assert "timing" not in repeated.err
    assert "following" not in repeated.err


def test_exact_answers_are_measured_kept_and_judged(zoobench: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    """Orders are met, and what was stored gives the same verdicts again."""
    from zoobench.verify.accuracy import analytic

    monkeypatch.setattr(analytic, "CASES", [case for case in analytic.CASES if case.name == "bar-mode"])
    first = zoobench("accuracy", "--exact", "--quick", "--format", "json", "--plots", ".")
    assert first.code == 0, first.err
    orders = json.loads(first.out)["orders"]
    assert {row["verdict"] for row in orders} == {"met"}
    assert json.loads(zoobench("accuracy", "--exact", "--plot", "--format", "json").out)["orders"] == orders


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--plot"], "zoobench.db"),
        (["--levels", "coarse"], "coarse"),
        (["--draws", "1,2"], "draws"),
        (["--from", "none.json"], "none.json"),
        (["--table", "none"], "none"),
    ],
)
def test_what_cannot_be_used_is_refused(zoobench: Command, options: list[str], said: str) -> None:
    """Exit code 2 and the reason; nothing is started."""
    reply = zoobench("accuracy", "--env", "ground", *options)
    assert reply.code == 2
    assert said in reply.err
