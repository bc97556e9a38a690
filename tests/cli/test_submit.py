"""`zoobench submit`."""

from pathlib import Path

import pytest

from tests.cli.conftest import Command

CELL = ("--env", "ground", "--task", "turning", "--fidelity", "draft[grid_spacing=0.03]", "--frames", "2")
AGENT = "def act(seen):\n    return [0.5] * {}\n"


@pytest.mark.slow
def test_an_agent_gets_into_the_table(zoobench: Command, tmp_path: Path) -> None:
    """Marked, once, and with a line on what is not known of it; the run can be filmed without the agent."""
    (tmp_path / "agent.py").write_text(AGENT.format(90))
    words = ("submit", "--policy", "agent:act", *CELL, "--name", "mine")
    assert zoobench(*words).code == 0
    assert "0 new, 1 done" in zoobench(*words).err
    table = zoobench("table").out
    assert "external" in table
    assert "mine was trained elsewhere" in table
    (tmp_path / "agent.py").unlink()
    assert zoobench("render", "1", "-o", "film.npz").code == 0


@pytest.mark.parametrize(
    ("policy", "word"), [("agent", "module:function"), ("nobody:act", "no module"), ("agent.py:act", "not there")]
)
def test_what_cannot_be_found_is_refused_at_once(zoobench: Command, policy: str, word: str) -> None:
    """Before anything is queued."""
    reply = zoobench("submit", "--policy", policy, *CELL)
    assert reply.code == 2
    assert word in reply.err
