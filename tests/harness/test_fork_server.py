"""Processes forked from one that has loaded the simulator are like those that Python starts, and end as they do."""

import json
import signal
import socket
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest

from tests.harness.helpers import enqueue, fake, numbers
from zoobench.db.rows import RunRow, RunState
from zoobench.db.store import Store
from zoobench.harness import forked, worker_pool
from zoobench.harness.fork_server import ForkServer, can_fork
from zoobench.harness.forked import ForkedProcess, fork
from zoobench.harness.provenance import THREAD_VARIABLES

pytestmark = pytest.mark.skipif(not can_fork(), reason="this system has no fork servers")

_COMMAND = (sys.executable, "-m", "tests.harness.forked_probe")


@pytest.fixture(scope="module")
def server() -> Iterator[ForkServer]:
    """A fork server."""
    with ForkServer() as server:
        yield server


@pytest.fixture(autouse=True)
def _one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    """The settings of a worker."""
    for variable in THREAD_VARIABLES:
        monkeypatch.setenv(variable, "1")


def _forked(requests: socket.socket, *arguments: str) -> ForkedProcess:
    process = fork(requests, (*_COMMAND, *arguments))
    assert process is not None
    return process


def _facts(process: ForkedProcess) -> dict[str, Any]:
    facts: dict[str, Any] = json.loads(process.stdout.readline())
    return facts


def test_it_has_the_arguments_environment_and_streams_of_its_own(
    server: ForkServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The caller's environment as it is now, libraries that are loaded, and no descriptor of the server's."""
    monkeypatch.setenv("ZOOBENCH_PROBE", "now")
    sleeping = _forked(server.requests, "sleep")
    _facts(sleeping)
    process = _forked(server.requests, "one", "two")
    facts = _facts(process)
    assert facts["arguments"] == ["one", "two"]
    assert facts["environment"]["ZOOBENCH_PROBE"] == "now"
    assert facts["loaded"]
    assert facts["threads"] == 1
    assert facts["parent"] == process.parent
    assert [each for each in facts["descriptors"] if each.startswith(("socket", "anon_inode"))] == []
    sleeping.kill()
    assert sleeping.wait() == -signal.SIGKILL


def test_it_ends_as_python_does(server: ForkServer) -> None:
    """With its exit code, after what is to be done at the end: Taichi keeps its compiled kernels only then."""
    process = _forked(server.requests, "one", "two")
    assert process.wait() == 2
    assert process.wait() == 2
    assert process.stderr.read() == b"the end\n"


def test_it_does_not_outlive_who_asked_for_it(server: ForkServer) -> None:
    """The end of a worker closes its side of the leash; others are not concerned."""
    one, other = (_forked(server.requests, "sleep") for _ in range(2))
    alive = psutil.Process(one.pid)
    one._leash.close()
    alive.wait(10.0)
    assert psutil.pid_exists(other.pid)
    other.kill()
    assert other.wait() == -signal.SIGKILL


def test_what_could_differ_is_not_forked(server: ForkServer, monkeypatch: pytest.MonkeyPatch) -> None:
    """Other commands, sources that were changed meanwhile, settings that loaded libraries would not heed."""
    assert fork(server.requests, ("true",)) is None
    with monkeypatch.context() as changed:
        changed.setattr(forked, "sources", lambda: "others")
        assert fork(server.requests, _COMMAND) is None
    with monkeypatch.context() as changed:
        changed.setenv("OMP_NUM_THREADS", "2")
        assert fork(server.requests, _COMMAND) is None
    with monkeypatch.context() as changed:
        changed.setenv("ZOOBENCH_PROBE", "x" * forked.LONGEST_REQUEST)
        assert fork(server.requests, _COMMAND) is None
    assert _forked(server.requests).wait() == 0


def test_with_a_killed_server_end_its_processes_and_nothing_is_forked() -> None:
    """Even while a native kernel holds the interpreter."""
    with ForkServer() as server:
        process = _forked(server.requests, "sleep")
        _facts(process)
        alive = psutil.Process(process.pid)
        psutil.Process(process.parent).kill()
        assert process.wait() == -signal.SIGKILL
        assert fork(server.requests, _COMMAND) is None
    alive.wait(10.0)


@pytest.fixture
def forked_fakes(monkeypatch: pytest.MonkeyPatch) -> tuple[str, ...]:
    """The command of a fake child, which is forked."""
    command = fake(iterations=500)
    monkeypatch.setattr(worker_pool, "CHILD_COMMAND", command)
    return command


def test_runs_go_on_without_the_server(tmp_path: Path, forked_fakes: tuple[str, ...]) -> None:
    """It is killed in the midst of two runs: both go on from their checkpoints in processes that are started anew."""
    path, calm = tmp_path / "zoo.db", tmp_path / "calm.db"
    killed: list[psutil.Process] = []

    def kill(rows: list[RunRow]) -> None:
        if not killed and all(row.fraction > 0.0 for row in rows):
            (server,) = filter(_is_server_at_work, psutil.Process().children())
            killed.extend(server.children())
            server.kill()

    rows = worker_pool.run_all(path, enqueue(path, 2), child=forked_fakes, on_update=kill)
    assert len(killed) == 2
    assert [row.state for row in rows] == [RunState.DONE] * 2
    with Store(path) as store:
        outcomes = [[attempt.outcome for attempt in store.attempts(row.id)] for row in rows]
    assert outcomes == [[RunState.LOST, RunState.DONE]] * 2
    worker_pool.run_all(calm, enqueue(calm, 2), child=fake(iterations=500, pause=0.0))
    assert [numbers(path, row.id) for row in rows] == [numbers(calm, row.id) for row in rows]


def test_a_forked_child_that_dies_is_known_by_its_signal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As one that was started."""
    command = fake("segfault")
    monkeypatch.setattr(worker_pool, "CHILD_COMMAND", command)
    path = tmp_path / "zoo.db"
    (row,) = worker_pool.run_all(path, enqueue(path), child=command)
    assert "killed by signal 11 (SIGSEGV)" in (row.reason or "")
    with Store(path) as store:
        assert store.attempts(1)[0].signal == signal.SIGSEGV


def _is_server_at_work(process: psutil.Process) -> bool:
    return "zoobench.harness.fork_server" in process.cmdline() and len(process.children()) == 2
