"""A child process and what it leaves behind."""

import sys
import time

import pytest

from tests.harness.helpers import spec
from zoobench.db.rows import Claim
from zoobench.harness import process
from zoobench.harness.process import ChildProcess, End, LogLine

LEAVES_A_PROCESS_BEHIND = """
import subprocess, sys
subprocess.Popen([sys.executable, "-c", "import time; time.sleep(30)"])
print("last words", file=sys.stderr)
"""


def test_a_child_ends_though_what_it_started_holds_its_pipes_open(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its last words are read, its end is announced, and closing it does not hang."""
    monkeypatch.setattr(process, "_LAST_WORDS_SECONDS", 0.3)
    begin = time.monotonic()
    child = ChildProcess([sys.executable, "-c", LEAVES_A_PROCESS_BEHIND], Claim(1, spec(), "owner", 1, None))
    events = []
    while not events or events[-1] != End():
        event = child.next(10.0)
        assert event is not None
        events.append(event)
    assert LogLine("last words") in events
    assert child.wait() == 0
    child.close()
    assert time.monotonic() - begin < 20.0
