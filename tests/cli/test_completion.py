"""What a shell offers on Tab."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.conftest import Command


def offered(zoobench: Command, monkeypatch: pytest.MonkeyPatch, line: str) -> list[str]:
    """The words that bash is offered at the end of this line."""
    words = line.split(" ")
    monkeypatch.setenv("_ZOOBENCH_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", line)
    monkeypatch.setenv("COMP_CWORD", str(len(words) - 1))
    reply = zoobench()
    assert reply.err == ""
    return reply.out.split()


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("zoobench run --env de", ["desert"]),
        ("zoobench run --env ground,ic", ["ground,ice"]),
        ("zoobench run --env desert[fri", []),
        ("zoobench table --task turn", ["turning"]),
        ("zoobench run --design cat", ["caterpillar"]),
        ("zoobench results --method rand", ["random"]),
        ("zoobench verify bench --wor", ["--worlds"]),
        ("zoobench design picture --fidelity sta", ["standard"]),
        ("zoobench run --preset ppo", ["ppo"]),
        ("zoobench run --suite paper/de", ["paper/design"]),
        ("zoobench leaderboard show gai", ["gaits"]),
        ("zoobench list fid", ["fidelities"]),
        ("zoobench show shallow", ["shallow-water"]),
        ("zoobench evaluate 1", []),
    ],
)
def test_names_are_completed(zoobench: Command, monkeypatch: pytest.MonkeyPatch, line: str, words: list[str]) -> None:
    """Of components, suites, presets and kinds; the last one in a list with commas; no run before there is one."""
    assert offered(zoobench, monkeypatch, line) == words


def test_runs_of_the_named_database_are_completed(
    zoobench: Command, monkeypatch: pytest.MonkeyPatch, database: Path
) -> None:
    """By their numbers, wherever the database is."""
    database.rename(database.with_name("other.db"))
    assert sorted(offered(zoobench, monkeypatch, "zoobench show --db other.db 1")) == ["1", "10", "11", "12", "13"]
    assert offered(zoobench, monkeypatch, "zoobench cancel 1") == []


def test_nothing_heavy_is_loaded() -> None:
    """Neither torch nor Taichi: a person waits for the answer."""
    code = (
        "import sys; from zoobench.cli import completion as c; from zoobench.registry import Kind; "
        "assert all(c.components(kind)('') for kind in Kind) and c.suites('') and c.presets(''); "
        "print([name for name in ('torch', 'taichi', 'pandas') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
