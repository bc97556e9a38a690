"""Processes forked from one that has loaded the simulator are like those that Python starts, and end as they do."""

import json
import os
import signal
import socket
import sys
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import psutil
import pytest

from tests import forking
from tests.harness.helpers import enqueue, fake, numbers
from zoobench import registry
from zoobench.db.rows import RunRow, RunState
from zoobench.db.store import Store
from zoobench.harness import forked, worker_pool
from zoobench.harness.fork_request import Request
from zoobench.harness.fork_server import ForkServer, _Server, can_fork
from zoobench.harness.forked import ForkedProcess, fork
from zoobench.harness.provenance import THREAD_VARIABLES
from zoobench.registry import Kind
from zoobench.spec import Budget, Ref, RunSpec

pytestmark = pytest.mark.skipif(not can_fork(), reason="this system has no fork servers")

_COMMAND = (sys.executable, "-m", "tests.harness.forked_probe")


@pytest.fixture
def server() -> ForkServer:
    """A fork server, that of all tests."""
    return forking.server()


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


class _ForkError(Exception):
    pass


@pytest.mark.parametrize("is_held", [False, True])
def test_what_nobody_waits_for_any_more_is_not_forked(monkeypatch: pytest.MonkeyPatch, is_held: bool) -> None:
    """Who asked may have given up while the server was loading kernels, and have the run done by another process."""

    def fork() -> int:
        raise _ForkError

    monkeypatch.setattr(os, "fork", fork)
    (requests, others), (leash, its) = (socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET) for _ in range(2))
    with requests, others, leash:
        if not is_held:
            leash.close()
        descriptors = [*(os.open(os.devnull, os.O_RDWR) for _ in range(3)), its.detach()]
        request = Request("nothing", [], dict(os.environ), "sources", None, descriptors, b"")
        with pytest.raises(_ForkError) if is_held else nullcontext():
            assert not _Server(others, "sources")._fork(request)
        for descriptor in descriptors[: 3 * is_held]:
            os.close(descriptor)


@pytest.fixture
def forked_fakes(monkeypatch: pytest.MonkeyPatch) -> tuple[str, ...]:
    """The command of a fake child, which is forked."""
    command = fake(iterations=150, pause=0.03)
    monkeypatch.setattr(worker_pool, "CHILD_COMMAND", command)
    return command


def test_runs_go_on_without_the_server(tmp_path: Path, forked_fakes: tuple[str, ...]) -> None:
    """It is killed in the midst of two runs: both go on from their checkpoints in processes that are started anew."""
    path, calm = tmp_path / "zoo.db", tmp_path / "calm.db"
    killed: list[psutil.Process] = []

    def kill(rows: list[RunRow]) -> None:
        if not killed and all(row.fraction > 0.0 for row in rows):
            (server,) = filter(_is_server_at_work, forking.children())
            killed.extend(server.children())
            server.kill()

    rows = worker_pool.run_all(path, enqueue(path, 2), child=forked_fakes, on_update=kill)
    assert len(killed) == 2
    assert [row.state for row in rows] == [RunState.DONE] * 2
    with Store(path) as store:
        outcomes = [[attempt.outcome for attempt in store.attempts(row.id)] for row in rows]
    assert outcomes == [[RunState.LOST, RunState.DONE]] * 2
    worker_pool.run_all(calm, enqueue(calm, 2), child=fake(iterations=150, pause=0.0))
    assert [numbers(path, row.id) for row in rows] == [numbers(calm, row.id) for row in rows]


@pytest.mark.usefixtures("shared_fork_server")
def test_a_forked_child_that_dies_is_known_by_its_signal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As one that was started."""
    command = fake("segfault")
    monkeypatch.setattr(worker_pool, "CHILD_COMMAND", command)
    path = tmp_path / "zoo.db"
    (row,) = worker_pool.run_all(path, enqueue(path), child=command)
    assert "killed by signal 11 (SIGSEGV)" in (row.reason or "")
    with Store(path) as store:
        assert store.attempts(1)[0].signal == signal.SIGSEGV


_CHILD = (sys.executable, "-m", "zoobench.harness.child")


def _spec(method: str, env: str = "ground") -> RunSpec:
    """A short run, of few particles."""
    names = {Kind.ENV: env, Kind.TASK: "turning", Kind.DESIGN: "caterpillar", Kind.CONTROLLER: "sine-basis"}
    refs = (registry.resolve(kind, Ref.parse(name)) for kind, name in (names | {Kind.METHOD: method}).items())
    fidelity = registry.resolve(Kind.FIDELITY, Ref("smoke"))
    return RunSpec(*refs, seed=0, budget=Budget("episodes", 16), fidelity=fidelity, frames=4)


def _done(process: ForkedProcess, spec: RunSpec) -> dict[str, Any]:
    """Finals and parameters of a run, in a process of a child's that it ends with."""
    job = {"spec": spec.to_dict(), "checkpoint": None, "stored": [], "parent": process.parent}
    process.stdin.write(json.dumps(job).encode() + b"\n" + 2 * b'{"reference": [0.5, "m/s"]}\n')
    process.stdin.flush()
    *_, last = map(json.loads, process.stdout.readlines())
    assert process.wait() == 0, process.stderr.read()
    assert last["type"] == "done", last
    return {name: last[name] for name in ("finals", "params")}


@pytest.fixture(scope="module")
def kernels(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """An empty folder for kernels."""
    folder = tmp_path_factory.mktemp("cache")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ZOOBENCH_CACHE", str(folder))
        yield folder / "kernels"


def _child(server: ForkServer, spec: RunSpec | None, *, wanted: bool = True) -> ForkedProcess | None:
    """A child process, in an environment that is the same in every test."""
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("PYTEST_CURRENT_TEST")
        return fork(server.requests, _CHILD, spec, lambda: wanted)


def _parent(server: ForkServer, spec: RunSpec | None) -> int:
    """Process id of what forks the child of a run; the child is ended."""
    process = _child(server, spec)
    assert process is not None
    process.kill()
    process.wait()
    return process.parent


@pytest.fixture
def branch(server: ForkServer, kernels: Path, monkeypatch: pytest.MonkeyPatch) -> int:
    """Process id of a branch that has the kernels of a run and its gradient."""
    monkeypatch.setattr(forked, "_KERNEL_SECONDS", 300.0)
    return _parent(server, _spec("diffphysics"))


def test_runs_of_one_environment_are_forked_where_their_kernels_are(
    server: ForkServer, branch: int, kernels: Path
) -> None:
    """Of both methods by one branch, which has kept its kernels, and with the numbers of a process that has none."""
    assert list(kernels.glob("*.tic"))
    for method in ("diffphysics", "random"):
        spec = _spec(method)
        rich, poor = _child(server, spec), _child(server, None)
        assert rich is not None
        assert poor is not None
        assert rich.parent == branch != poor.parent
        assert _done(rich, spec) == _done(poor, spec)


def test_what_a_forked_run_compiles_is_kept(server: ForkServer, branch: int, kernels: Path) -> None:
    """Kernels that its branch does not have: here those of hills."""
    before = set(kernels.glob("*.tic"))
    process = _child(server, _spec("random"))
    assert process is not None
    assert process.parent == branch
    _done(process, _spec("random", "ground[relief=0.01]"))
    assert set(kernels.glob("*.tic")) > before


def test_who_waits_for_kernels_in_vain_is_served_without(
    server: ForkServer, branch: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Too long, not wanting it any more, of a run that cannot be simulated, and once the branch was killed."""
    spec, plain = _spec("random"), _parent(server, None)
    psutil.Process(branch).suspend()
    assert _child(server, spec, wanted=False) is None
    with monkeypatch.context() as hurried:
        hurried.setattr(forked, "_KERNEL_SECONDS", 0.1)
        assert _parent(server, spec) == plain
    psutil.Process(branch).resume()
    held = _child(server, spec)
    assert held is not None
    assert held.parent == branch
    assert [each.pid for each in psutil.Process(branch).children()] == [held.pid]
    psutil.Process(branch).kill()
    assert held.wait() == -signal.SIGKILL
    assert _parent(server, spec) == plain
    assert _parent(server, replace(spec, env=Ref("nowhere", 1))) == plain


def _is_server_at_work(process: psutil.Process) -> bool:
    return "zoobench.harness.fork_server" in process.cmdline() and len(process.children()) == 2
