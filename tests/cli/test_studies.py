"""`gradcheck`."""

import json

from tests.cli.conftest import Command


def test_gradcheck_finds_right_gradients_right(zoobench: Command) -> None:
    """One row for every parameter group and horizon, each within the tolerance; exit code 0."""
    reply = zoobench("gradcheck", "--env", "ground", "--task", "turning", "--horizons", "10,40", "--format", "json")
    rows = json.loads(reply.out)
    assert reply.code == 0, reply.err
    assert len(rows) == 12
    assert {row["group"] for row in rows} >= {"actuation", "stiffness", "occupancy", "fibres"}
    assert all(row["relative_error"] <= 1e-4 and row["gradient_norm"] > 0 for row in rows)


def test_gradcheck_refuses_what_it_cannot_check(zoobench: Command) -> None:
    """Unknown environments and horizons that are no numbers are usage errors."""
    reply = zoobench("gradcheck", "--env", "dessert")
    assert (reply.code, "desert" in reply.err) == (2, True)
    assert zoobench("gradcheck", "--horizons", "ten").code == 2
    assert zoobench("gradcheck", "--horizons", "0").code == 2
