"""Options that are given twice."""

import pytest

from tests.cli.conftest import Command


@pytest.mark.parametrize(
    ("words", "option"),
    [
        (["list", "envs", "--format", "json", "-f", "csv"], "--format"),
        (["run", "--dry-run", "--env", "ground", "--task", "turning", "--env=ice"], "--env"),
        (["verify", "accuracy", "run", "--seeds", "1", "--dry-run", "--seeds", "1"], "--seeds"),
    ],
)
def test_repeated_option_is_refused(zoobench: Command, words: list[str], option: str) -> None:
    """An option that is given twice is refused, in groups of commands too, since its first value would be lost."""
    reply = zoobench(*words)
    assert reply.code == 2
    assert f"{option} is given 2 times" in reply.err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["run", "--frames", "many"], "'--frames': 'many' is not a"),
        (["run", "--frames", ""], "'--frames': '' is not a"),
        (["run", "--frames", "1.5"], "'--frames': '1.5' is not a"),
        (["run", "--dry-run", "--tolerance", "small"], "'--tolerance': 'small' is not a"),
        (["run", "-j", "0"], "'--jobs' / '-j': 0 is"),
        (["render", "1", "-o", "a.gif", "--fps", "999"], "'--fps': 999"),
        (["render", "1", "-o", "a.gif", "--fps", "nan"], "'--fps': "),
        (["run", "--retry", "everything"], "'--retry': 'everything' is not one of 'failed', 'diverged'"),
        (["new", "colour", "red"], "Unknown kind 'colour'"),
    ],
)
def test_a_value_that_does_not_fit_is_named_in_plain_words(zoobench: Command, words: list[str], message: str) -> None:
    """What was given and what was expected, with no word of the library that reads values."""
    reply = zoobench(*words)
    assert reply.code == 2
    assert message in reply.err
    assert "Input should be" not in reply.err
    assert "Value error" not in reply.err


def test_repeated_flag_loses_nothing(zoobench: Command) -> None:
    """A flag that is given twice is still a flag."""
    reply = zoobench("run", "--env", "ground", "--task", "turning", "--smoke", "--smoke", "--no-wait")
    assert reply.code == 0, reply.err
