"""`zoobench effects`."""

import json

from tests.cli.conftest import Command


def test_effects_derives_the_table_for_every_environment(zoobench: Command) -> None:
    """Without measuring anything."""
    reply = zoobench("effects", "--table", "coverage", "--format", "json")
    rows = {row["env"]: row for row in json.loads(reply.out)}
    assert reply.code == 0, reply.err
    assert len(rows) >= 8
    assert (rows["desert"]["medium"], rows["desert"]["plasticity"]) == ("sand", True)
    assert (rows["ground"]["medium"], rows["ground"]["thickness"]) == ("none", None)


def test_effects_measures(zoobench: Command) -> None:
    """The parts of a substep of one environment, the whole first."""
    cell = ("effects", "--env", "ground", "--fidelity", "smoke", "--repeats", "1")
    reply = zoobench(*cell, "--table", "shares", "--format", "json")
    rows = json.loads(reply.out)
    assert reply.code == 0, reply.err
    assert [row["part"] for row in rows][:3] == ["substep", "sum", "clear"]
    assert all(row["ns"] >= 0.0 for row in rows)
