"""`zoobench verify effects`."""

import json
from collections.abc import Iterator

import pytest

from tests.cli.conftest import Command
from zoobench.errors import Divergence, DivergenceError
from zoobench_verify.effects import effect_costs


def test_effects_derives_the_table_for_every_environment(zoobench: Command) -> None:
    """Without measuring anything."""
    reply = zoobench("verify", "effects", "--table", "coverage", "--format", "json")
    rows = {row["env"]: row for row in json.loads(reply.out)}
    assert reply.code == 0, reply.err
    assert len(rows) >= 8
    assert (rows["desert"]["medium"], rows["desert"]["plasticity"]) == ("sand", True)
    assert (rows["ground"]["medium"], rows["ground"]["thickness"]) == ("none", None)


@pytest.mark.slow  # costs are measured in tests/verify/effects, and printed below
def test_effects_measures(zoobench: Command) -> None:
    """What an effect of one environment costs."""
    cell = ("verify", "effects", "--env", "ground", "--fidelity", "smoke", "--repeats", "1")
    reply = zoobench(*cell, "--table", "costs", "--format", "json")
    rows = json.loads(reply.out)
    assert reply.code == 0, reply.err
    assert {row["effect"] for row in rows} >= {"muscle", "friction"}
    assert all(row["ns"] > 0.0 for row in rows)


def test_a_table_is_printed_when_it_is_ready(zoobench: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    """Coverage before anything is measured, and what was printed stays if a measurement fails."""
    monkeypatch.setattr(effect_costs, "costs", failing)
    reply = zoobench("verify", "effects", "--env", "ground,ice", "--fidelity", "smoke")
    assert reply.code == 1
    assert "diverged" in reply.err
    assert "coefficient" in reply.out
    assert [line.split()[0] for line in reply.out.splitlines() if line.startswith(("ground", "ice"))] == [
        "ground",
        "ice",
    ]


def failing(studied: object, repeats: int) -> Iterator[effect_costs.EffectCost]:
    """A measurement that diverges."""
    raise DivergenceError(Divergence(0, 0, 1, "det F", -1.0, 0.0, 0, (0.0, 0.0, 0.0), "Try something else."))
