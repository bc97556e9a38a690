"""`zoobench accuracy`: the study is carried out, kept, judged again, drawn and exported."""

import json

import pytest

from tests.cli.conftest import Command


@pytest.mark.slow
def test_the_study_is_carried_out_once_and_judged_as_often_as_wanted(zoobench: Command) -> None:
    """From the database and from an exported file: the same tables; a picture is drawn; nothing is done twice."""
    study = ("accuracy", "run", "--env", "ground", "--quick", "--repeats", 1)
    show = ("accuracy", "show", "--env", "ground", "--format", "json")
    done = zoobench(*study)
    assert done.code == 0, done.err
    assert done.err.endswith("Next: zoobench accuracy show --env ground\n")
    first = zoobench(*show, "--export", "a.json", "--plots", ".")
    assert first.code == 0, first.err
    tables = json.loads(first.out)
    assert [row["fidelity"] for row in tables["levels"] if row["task"] == "turning"] == ["draft", "standard"]
    assert all(row["seconds"] > 0 for row in tables["levels"])
    assert tables["levels"][0]["error"] > 0
    assert [row["fidelity"] for row in tables["energy"]] == ["draft", "standard"]
    assert all(abs(row["unexplained"]) < 1 for row in tables["energy"])
    assert "drawn: accuracy-ground.png" in first.err
    assert "drawn: accuracy-energy.png" in first.err
    assert json.loads(zoobench(*show).out) == tables
    again = json.loads(zoobench(*show, "--from", "a.json").out)
    assert again["levels"][0]["error"] == pytest.approx(tables["levels"][0]["error"], rel=1e-4)
    repeated = zoobench(*study)
    assert "0 new, 4 done already" in repeated.err
    assert "timing" not in repeated.err
    assert "following" not in repeated.err


def test_exact_answers_are_measured_kept_and_judged(zoobench: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    """Orders are met, and what was stored gives the same verdicts again."""
    from zoobench.verify.accuracy import analytic

    monkeypatch.setattr(analytic, "CASES", [case for case in analytic.CASES if case.name == "bar-mode"])
    first = zoobench("accuracy", "exact", "--quick", "--format", "json", "--plots", ".")
    assert first.code == 0, first.err
    orders = json.loads(first.out)["orders"]
    assert {row["verdict"] for row in orders} == {"met"}
    assert json.loads(zoobench("accuracy", "exact", "--stored", "--format", "json").out)["orders"] == orders
