"""`zoobench reach`."""

import json

from tests.cli.conftest import Command


def test_scores_in_two_sizes_are_compared(zoobench: Command) -> None:
    """A row per environment, task and controller, with the verdict that the exit code repeats."""
    words = ("--env", "desert", "--task", "movement-speed", "--fidelity", "smoke", "--frames", "4")
    reply = zoobench("reach", *words, "--controllers", "2", "--format", "json")
    rows = json.loads(reply.out)
    assert [row["controller"] for row in rows] == [0, 1]
    assert all(row["particles_doubled"] > 2 * row["particles"] for row in rows)
    assert reply.code == int(not all(row["enough"] for row in rows))


def test_environment_without_a_medium_is_refused(zoobench: Command) -> None:
    """There is nothing to be too small."""
    reply = zoobench("reach", "--env", "ground")
    assert reply.code == 2
    assert "no medium that could be too small" in reply.err
