"""The top level of the command line: the group of another distribution, and former names."""

from importlib.metadata import EntryPoint

import pytest

from tests.cli.conftest import Command
from zoobench.cli import top_level

WORDS = (("verify",), ("verify", "--help"), ("verify", "validate", "--case", "statics"))


@pytest.mark.parametrize("words", WORDS)
def test_what_is_not_installed_says_how_to_install_it(
    zoobench: Command, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...]
) -> None:
    """Whatever was asked of it, with exit code 2; the overview lists it none the less."""
    monkeypatch.setattr(top_level, "entry_points", lambda **_: ())
    reply = zoobench(*words)
    assert (reply.code, reply.out) == (2, "")
    assert "needs the package zoobench-verify, which is not installed" in reply.err
    assert "pip install 'zoobench[verify]'" in reply.err
    assert "  verify " in zoobench("--help").out


def test_what_is_installed_has_its_commands(zoobench: Command) -> None:
    """The group is that of the distribution, with help at every step."""
    overview = zoobench("verify", "--help")
    assert overview.code == 0
    for command in ("validate", "stability", "gradcheck", "accuracy", "effects", "bench"):
        assert f"  {command} " in overview.out
        assert f"Usage: zoobench verify {command} " in zoobench("verify", command, "--help").out


def test_what_cannot_be_loaded_says_why(zoobench: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    """As a distribution of another version, which imports what is not there; other commands work."""
    broken = EntryPoint("verify", "zoobench.cli.nothing:verify", top_level.GROUP)
    monkeypatch.setattr(top_level, "entry_points", lambda **_: (broken,))
    reply = zoobench("verify", "validate")
    assert reply.code == 2
    assert "cannot be loaded: No module named 'zoobench.cli.nothing'. Install it" in reply.err
    assert zoobench("list", "envs").code == 0


@pytest.mark.parametrize(
    ("words", "present"),
    [
        (["plan", "--env", "ground"], "zoobench run --dry-run"),
        (["validate", "--fast"], "zoobench verify validate"),
        (["accuracy", "show"], "zoobench verify accuracy"),
        (["merge", "a.db", "b.db"], "zoobench db merge"),
        (["picture"], "zoobench design picture"),
        (["logs", "1", "--help"], "zoobench show RUN --log"),
    ],
)
def test_a_former_command_names_its_successor(zoobench: Command, words: list[str], present: str) -> None:
    """With exit code 2, and nothing is done."""
    reply = zoobench(*words)
    assert (reply.code, reply.out) == (2, "")
    assert reply.err.strip() == f"Error: `zoobench {words[0]}` has a new name: {present}"


def test_every_successor_exists(zoobench: Command) -> None:
    """What a message tells to type is a command, and no former name is one."""
    listed = {line.split()[0] for line in zoobench("--help").out.partition("Commands:")[2].splitlines() if line.strip()}
    for former, successor in top_level._FORMER.items():
        assert former not in listed
        words = [word for word in successor.split() if word != "RUN"]
        assert zoobench(*words, "--help").code == 0


def test_completion_goes_into_the_group(zoobench: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    """And a former name is no error while it is typed."""
    for line, word in (("zoobench verify val", "validate"), ("zoobench plan --en", "")):
        monkeypatch.setenv("_ZOOBENCH_COMPLETE", "complete_bash")
        monkeypatch.setenv("COMP_WORDS", line)
        monkeypatch.setenv("COMP_CWORD", "2")
        reply = zoobench()
        assert (reply.out.strip(), reply.err) == (word, "")
