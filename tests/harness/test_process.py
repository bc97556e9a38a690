"""A child process and what it leaves behind."""

import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from tests.harness.helpers import spec, work_on_fakes
from tests.harness.test_messages import bad
from zoobench.db.rows import Claim, RunState
from zoobench.db.store import Store
from zoobench.harness import messages, process
from zoobench.harness.process import ChildProcess, End, LogLine, StartedProcess

LEAVES_A_PROCESS_BEHIND = """
import subprocess, sys
subprocess.Popen([sys.executable, "-c", "import time; time.sleep(30)"], start_new_session=True)
print("last words", file=sys.stderr)
"""


def test_a_child_ends_though_a_process_out_of_reach_holds_its_pipes_open(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its last words are read, its end is announced, and closing it does not hang."""
    monkeypatch.setattr(process, "_LAST_WORDS_SECONDS", 0.3)
    begin = time.monotonic()
    child = ChildProcess(StartedProcess([sys.executable, "-c", LEAVES_A_PROCESS_BEHIND]))
    child.begin(Claim(1, spec(), "owner", 1, None))
    events = []
    while not events or events[-1] != End():
        event = child.next(10.0)
        assert event is not None
        events.append(event)
    assert LogLine("last words") in events
    assert child.wait() == 0
    child.close()
    assert time.monotonic() - begin < 20.0


@pytest.mark.slow
def test_a_last_message_is_read_however_long_it_takes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The patience with a dead child's pipes is with their silence, not with the work on what came out of them."""
    monkeypatch.setattr(process, "_LAST_WORDS_SECONDS", 0.2)

    def slowly(line: bytes) -> messages.Message | None:
        time.sleep(1.0 if b'"done"' in line else 0.0)
        return read(line)

    read = messages.read_message
    monkeypatch.setattr(messages, "read_message", slowly)
    assert [row.state for row in work_on_fakes(tmp_path / "zoo.db")] == [RunState.DONE]


FLOODED = """
import resource, sys
from tests.harness.helpers import work_on_fakes
from tests.harness.test_messages import bad
from zoobench.db.store import Store

def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024

before = peak()
work_on_fakes(sys.argv[1], child=bad("flood"))
print(peak() - before)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere the peak of memory has another unit")
def test_a_line_without_end_takes_no_memory(tmp_path: Path) -> None:
    """An eighth of a gigabyte on standard error without a newline; the worker keeps the beginning of it."""
    path = tmp_path / "zoo.db"
    done = subprocess.run([sys.executable, "-c", FLOODED, path], capture_output=True, text=True, check=True)
    assert int(done.stdout) < 64 * 2**20
    with Store(path) as store:
        assert [row.state for row in store.runs()] == [RunState.DONE]
        assert [line.text for line in store.logs(1)] == ["run 0", "begins", "x" * 2000]


@pytest.mark.slow
def test_a_flood_of_lines_is_read_over(tmp_path: Path) -> None:
    """Of a million lines the first are kept, and a word about the others."""
    path = tmp_path / "zoo.db"
    assert [row.state for row in work_on_fakes(path, child=bad("flood-of-lines"), timeout=120.0)] == [RunState.DONE]
    with Store(path) as store:
        lines = [line.text for line in store.logs(1)]
    assert lines[2:-1] == ["a line of twenty b."] * 9_997
    assert lines[-1].startswith("(more lines")


def test_a_method_that_closes_its_standard_input_goes_on(tmp_path: Path) -> None:
    """It is not the pipe by which it hears of the end of its worker."""
    path = tmp_path / "zoo.db"
    assert [row.state for row in work_on_fakes(path, child=bad("closes-input"))] == [RunState.DONE]


_LINUX = pytest.mark.skipif(sys.platform != "linux", reason="Linux's")


@pytest.mark.parametrize(
    "oddity",
    [
        # that nothing is left of a run after which another follows is tested with the executor, too
        pytest.param("leaves", marks=pytest.mark.slow),
        pytest.param("leaves-and-dies", marks=pytest.mark.slow),
        pytest.param("leaves-sessions", marks=_LINUX),
        pytest.param("leaves-sessions-and-dies", marks=(_LINUX, pytest.mark.slow)),
    ],
)
def test_what_a_child_has_started_ends_with_it(tmp_path: Path, oddity: str) -> None:
    """However it ended, and though another run follows."""
    path = tmp_path / "zoo.db"
    work_on_fakes(path, 2, child=bad(oddity))
    with Store(path) as store:
        left = [int(line.text.split()[1]) for line in store.logs(1) if line.text.startswith("left ")]
    assert left
    assert [pid for pid in left if psutil.pid_exists(pid) and psutil.Process(pid).status() != "zombie"] == []
