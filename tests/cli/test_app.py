"""Options that are given twice."""

import pytest

from tests.cli.conftest import Command


@pytest.mark.parametrize(
    ("words", "option"),
    [
        (["list", "envs", "--format", "json", "-f", "csv"], "--format"),
        (["plan", "--env", "ground", "--task", "turning", "--env=ice"], "--env"),
        (["accuracy", "run", "--seeds", "1", "--dry-run", "--seeds", "1"], "--seeds"),
    ],
)
def test_repeated_option_is_refused(zoobench: Command, words: list[str], option: str) -> None:
    """An option that is given twice is refused, in groups of commands too, since its first value would be lost."""
    reply = zoobench(*words)
    assert reply.code == 2
    assert f"{option} is given 2 times" in reply.err


def test_repeated_flag_loses_nothing(zoobench: Command) -> None:
    """A flag that is given twice is still a flag."""
    reply = zoobench("run", "--env", "ground", "--task", "turning", "--smoke", "--smoke", "--no-wait")
    assert reply.code == 0, reply.err
