"""`zoobench verify gradcheck`."""

import json

from tests.cli.conftest import Command


def test_gradcheck_finds_right_gradients_right(zoobench: Command) -> None:
    """A row for every parameter group and horizon, each within the tolerance, and a summary; exit code 0."""
    cell = ("verify", "gradcheck", "--env", "ground", "--task", "turning")
    reply = zoobench(*cell, "--horizons", "5,15", "--format", "json")
    found = json.loads(reply.out)
    assert reply.code == 0, reply.err
    assert len(found["rows"]) == 12
    assert {row["group"] for row in found["rows"]} >= {"actuation", "stiffness", "occupancy", "fibres"}
    assert all(row["relative_error"] <= 1e-4 and row["gradient_norm"] > 0 for row in found["rows"])
    (summary,) = found["summary"]
    assert summary["error"] == max(row["relative_error"] for row in found["rows"])
    assert (summary["right_until"], summary["chaos_from"]) == (max(row["substeps"] for row in found["rows"]), None)


def test_gradcheck_prints_the_summary_alone(zoobench: Command) -> None:
    """As CSV."""
    cell = ("verify", "gradcheck", "--env", "ground", "--task", "turning", "--horizons", "5", "--format", "csv")
    reply = zoobench(*cell, "--table", "summary")
    assert reply.out.splitlines()[0].startswith("env,task,error,right_until,chaos_from")
    assert len(reply.out.splitlines()) == 2


def test_tasks_without_the_object_that_they_need_are_skipped(zoobench: Command) -> None:
    """With their names; alone they are refused."""
    found = zoobench(
        "verify",
        "gradcheck",
        "--env",
        "ground",
        "--task",
        "carry,movement-speed",
        "--horizons",
        "1",
        "--table",
        "summary",
    )
    assert found.code == 0, found.err
    assert "Skipped, as the task makes no sense there: ground x carry." in found.err
    refused = zoobench("verify", "gradcheck", "--env", "ground", "--task", "carry")
    assert refused.code == 2
    assert "needs an object" in refused.err
