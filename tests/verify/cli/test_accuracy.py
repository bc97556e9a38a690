"""`zoobench verify accuracy`: the study is carried out, kept, judged again, drawn and exported."""

import json
import shlex

import pytest

from tests.cli.conftest import Command
from zoobench.accuracy import tolerance


@pytest.mark.slow
def test_the_study_is_carried_out_once_and_judged_as_often_as_wanted(zoobench: Command) -> None:
    """From the database and from an exported file: the same tables; pictures are drawn; nothing is done twice."""
    study = ("verify", "accuracy", "run", "--env", "ground", "--task", "turning", "--design", "caterpillar", "--quick")
    show = ("verify", "accuracy", "show", "--env", "ground", "--format", "json")
    planned = zoobench(*study, "--dry-run")
    assert "5 runs to do of 5" in planned.err
    done = zoobench(*study)
    assert done.code == 0, done.err
    assert done.err.endswith("Next: zoobench verify accuracy show --env ground\n")
    first = zoobench(*show, "--export", "a.json", "--plots", ".", "--publish", "levels.json")
    assert first.code == 0, first.err
    tables = json.loads(first.out)
    draft, standard = tables["levels"]
    assert (draft["fidelity"], standard["fidelity"]) == ("draft", "standard")
    assert (draft["gaits"], draft["runs"]) == (4, 2)
    assert draft["error"] > 0
    assert draft["unknown"] == pytest.approx(standard["error"])
    assert draft["angle"] > 0
    assert all(row["seconds"] > 0 for row in tables["levels"])
    assert [row["evaluated"] for row in tables["matrix"]] == ["draft", "standard"]
    assert [row["fidelity"] for row in tables["energy"]] == ["draft"]
    assert "drawn: accuracy.png" in first.err
    assert "drawn: accuracy-energy.png" in first.err
    again = json.loads(zoobench(*show, "--from", "a.json").out)
    assert again["levels"][0]["error"] == pytest.approx(draft["error"], rel=1e-4)
    repeated = zoobench(*study)
    assert "0 runs to do of 5" in repeated.err
    assert "following" not in repeated.err
    table = zoobench("table", "--format", "json")
    assert not any(cell["undecided"] for cell in json.loads(table.out)["cells"])


@pytest.mark.slow
def test_published_levels_are_shown_and_drawn_without_a_study(zoobench: Command) -> None:
    """Those by which --tolerance chooses; an export of them, or a place that was not measured, is refused."""
    show = ("verify", "accuracy", "show", "--published", "--task", "turning")
    shown = zoobench(*show, "--env", "ice,snow", "--format", "json", "--plots", ".")
    assert shown.code == 0, shown.err
    assert "drawn: accuracy.png" in shown.err
    levels = json.loads(shown.out)["levels"]
    known = [row for row in tolerance.published().levels if row.env in ("ice", "snow") and row.task == "turning"]
    assert [row["fidelity"] for row in levels] == [row.fidelity for row in known]
    assert [row["error"] for row in levels] == [row.error for row in known]
    assert zoobench(*show, "--export", "a.json").code == 2
    unknown = zoobench(*show, "--env", "shallow-water")
    assert unknown.code == 2
    assert "zoobench verify accuracy run" in unknown.err


def test_what_was_not_measured_can_be(zoobench: Command) -> None:
    """By the command that `--tolerance` names where the reference's own error is not known."""
    plan = zoobench("run", "--dry-run", "--env", "clay", "--task", "movement-speed", "--tolerance", "0.3")
    command = plan.err.split("To measure it: zoobench ")[1].split("\n")[0]
    assert zoobench(*shlex.split(command), "--dry-run").code == 0


def test_exact_answers_are_measured_kept_and_judged(zoobench: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    """Orders are met, and what was stored gives the same verdicts again."""
    from zoobench_verify.accuracy import analytic

    monkeypatch.setattr(analytic, "CASES", [case for case in analytic.CASES if case.name == "bar-mode"])
    first = zoobench("verify", "accuracy", "exact", "--quick", "--format", "json", "--plots", ".")
    assert first.code == 0, first.err
    orders = json.loads(first.out)["orders"]
    assert {row["verdict"] for row in orders} == {"met"}
    assert json.loads(zoobench("verify", "accuracy", "exact", "--stored", "--format", "json").out)["orders"] == orders
