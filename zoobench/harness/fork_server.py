"""A process that has loaded the simulator and forks others, which then need not load it.

`python -m zoobench.harness.fork_server DESCRIPTOR`, one for a pool of workers. It has a single thread and does nothing
but fork, wait and kill. Whoever holds the other end of the socket DESCRIPTOR may ask for processes; it ends when nobody
does. A request is a JSON object of the `module` and `arguments` of `python -m`, `environment`, `sources` and `spec`,
with four descriptors: standard input, output and error, and a socket, the leash. On the leash it tells the pids of
itself and of the process, and in the end the exit code. `KILL` from the other side kills the process, and so does the
end of whoever holds that side. The end of the server kills all of them. Each leads a group, and what it has started
ends with it.

It closes the leash of a process that would not be what Python starts: if the sources were changed since it began, or if
the environment has other settings for libraries that it has loaded.

A process that is asked for with the `spec` of its run is forked by a branch: a server like this one, and forked from
it, that has loaded the kernels of the run's environment, design and fidelity. Where it cannot, it ends, and so the
leash is closed; who asked then asks without a spec. A branch ends with the server, and with the last of its processes
once there are newer ones.

To fork is safe here as nothing runs that the forked process would lack: no other thread, no runtime, no database. A
branch has Taichi's runtime, which lends itself to processes that are forked (`sim.runtime.lend`). On macOS the system's
own libraries have threads, and there is no fork server.
"""

import os
import selectors
import signal
import socket
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple, Self

import psutil

from zoobench import registry, rounding
from zoobench.cell.loading import load_kernels, load_simulator
from zoobench.errors import ZoobenchError
from zoobench.harness.fork_request import Request, end_without_threads
from zoobench.harness.forked import CODE, KILL, PIDS, is_held
from zoobench.harness.lifeline import adopt, die_with, end_descendants
from zoobench.harness.provenance import THREAD_VARIABLES, sources
from zoobench.registry import Kind
from zoobench.spec import RunSpec, canonical_json

_LOADED_WITH = (*THREAD_VARIABLES, *rounding.CHOICES)
"""Environment variables that libraries read when they are loaded."""

_END_SECONDS = 5.0

_MOST_BRANCHES = 2
"""That are asked for processes: at the border of two families workers need both."""


class ForkServer:
    """The fork server of this process; used as a context, at whose end it is asked to end, too.

    Attributes:
        requests: its socket, for `forked.fork`.
    """

    def __init__(self) -> None:
        self.requests, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            self._process = subprocess.Popen(
                (sys.executable, "-m", "zoobench.harness.fork_server", str(theirs.fileno())),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                start_new_session=True,
                pass_fds=(theirs.fileno(),),
                # one thread for each child: both faster and reproducible, as sums are added in one order
                env=os.environ | dict.fromkeys(THREAD_VARIABLES, "1"),
            )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.requests.close()
        try:
            self._process.wait(_END_SECONDS)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


def can_fork() -> bool:
    """Whether this system has fork servers."""
    return sys.platform == "linux" and hasattr(os, "pidfd_open")


class _Forked(NamedTuple):
    """A process in the server's care."""

    pid: int
    end: int
    leash: socket.socket


class _Branch(NamedTuple):
    """A server that has the kernels of the runs of one `key`, those of gradients too or not."""

    pid: int
    end: int
    requests: socket.socket
    key: str
    gradient: bool

    @property
    def is_dismissed(self) -> bool:
        """Whether it is asked for no more processes."""
        return self.requests.fileno() < 0


class _Server:
    """A server, or with `is_branch` one that has kernels."""

    def __init__(self, requests: socket.socket, sources: str, *, is_branch: bool = False) -> None:
        self._requests, self._sources, self._is_branch = requests, sources, is_branch
        self._selector = selectors.DefaultSelector()
        self._selector.register(requests, selectors.EVENT_READ)
        self._forked: list[_Forked] = []
        self._branches: list[_Branch] = []
        self._barren: set[str] = set()
        self._ends = False

    def serve(self) -> Request | None:
        """Serve until nobody can ask any more: None; in a process that was forked, its request."""
        while self._forked or self._branches or not self._ends:
            for key, _ in self._selector.select():
                if isinstance(key.data, _Branch):
                    self._bury(key.data)
                elif key.fileobj is not self._requests:
                    self._look_after(key.data, key.fileobj)
                elif request := Request.read(self._requests):
                    if request.spec is None or self._is_branch:
                        if self._fork(request):
                            return request
                    elif (branch := self._hand_on(request)) is not None:
                        return branch.serve()
                else:
                    self._selector.unregister(self._requests)
                    self._ends = True
                    self._dismiss(0)
        return None

    def _hand_on(self, request: Request) -> "_Server | None":
        """Have a branch answer a request, or close it; in a new branch its server, else None."""
        branch = self._branch_for(request)
        if isinstance(branch, _Server):
            return branch
        if branch is not None:
            with suppress(OSError):  # it has ended a moment ago
                socket.send_fds(branch.requests, [request.message], request.descriptors)
        request.close()
        return None

    def _branch_for(self, request: Request) -> "_Branch | _Server | None":
        """The branch that has the kernels of a request, None if there can be none; in a new branch its server."""
        assert request.spec is not None
        try:
            spec = RunSpec.from_dict(request.spec)
            method = registry.get(Kind.METHOD, spec.method.name, spec.method.version)
        except ZoobenchError:  # the run will tell
            return None
        finally:
            registry.look_again()
        gradient = "gradient" in method.tags
        key = canonical_json([*map(str, (spec.env, spec.design, spec.fidelity)), request.environment])
        for branch in self._branches:
            if branch.key == key and branch.gradient >= gradient and not branch.is_dismissed:
                return branch
        if key in self._barren or not self._is_as_started(request):
            return None
        self._dismiss(_MOST_BRANCHES - 1)
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        server = os.getpid()
        pid = os.fork()
        if pid == 0:
            ours.close()
            self._leave()
            request.close()
            request.set_environment()
            die_with(server)
            adopt()
            load_kernels(spec, gradient=gradient)
            return _Server(theirs, self._sources, is_branch=True)
        theirs.close()
        branch = _Branch(pid, os.pidfd_open(pid), ours, key, gradient)
        self._branches.append(branch)
        self._selector.register(branch.end, selectors.EVENT_READ, branch)
        return branch

    def _dismiss(self, kept: int) -> None:
        """Ask no branch but the `kept` newest any more: the others end with their processes."""
        for branch in self._branches[: len(self._branches) - kept]:
            branch.requests.close()

    def _bury(self, branch: _Branch) -> None:
        """A branch has ended; if it could not do its work, no other is made."""
        if os.waitpid(branch.pid, 0)[1]:
            self._barren.add(branch.key)
        self._end_orphans(branch.pid)
        self._selector.unregister(branch.end)
        os.close(branch.end)
        branch.requests.close()
        self._branches.remove(branch)

    def _is_as_started(self, request: Request) -> bool:
        """Whether a forked process is what Python would start."""
        settings = [request.environment.get(name) == os.environ.get(name) for name in _LOADED_WITH]
        return request.sources == self._sources and all(settings)

    def _fork(self, request: Request) -> bool:
        """Fork if it is to be; True in the new process."""
        leash = socket.socket(fileno=request.descriptors[3])
        if self._is_as_started(request) and is_held(leash):
            server = os.getpid()
            pid = os.fork()
            if pid == 0:
                os.setpgid(0, 0)
                self._leave()
                leash.detach()
                request.begin()
                die_with(server)
                return True
            with suppress(OSError):  # on both sides, as either may come first
                os.setpgid(pid, pid)
            forked = _Forked(pid, os.pidfd_open(pid), leash)
            self._forked.append(forked)
            for source in (forked.end, leash):
                self._selector.register(source, selectors.EVENT_READ, forked)
            with suppress(OSError):
                leash.send(PIDS.pack(server, pid))
        else:
            leash.close()
        for descriptor in request.descriptors[:3]:
            os.close(descriptor)
        return False

    def _look_after(self, forked: _Forked, source: Any) -> None:
        if source is forked.leash:
            if forked not in self._forked:
                return  # it has ended a moment ago
            said = b""
            with suppress(OSError):
                said = forked.leash.recv(len(KILL))
            os.killpg(forked.pid, signal.SIGKILL)
            if not said:
                self._selector.unregister(forked.leash)
            return
        with suppress(ProcessLookupError):  # its number is still its own
            os.killpg(forked.pid, signal.SIGKILL)
        code = os.waitstatus_to_exitcode(os.waitpid(forked.pid, 0)[1])
        self._end_orphans(forked.pid)
        with suppress(OSError):
            forked.leash.send(CODE.pack(code))
        self._release(forked)
        self._forked.remove(forked)

    def _end_orphans(self, ended: int) -> None:
        """Kill what a process that has ended left behind: what a living one starts stays with that."""
        mine = {*(each.pid for each in self._forked), *(each.pid for each in self._branches)} - {ended}
        end_descendants(but=mine)
        for orphan in psutil.Process().children():
            if orphan.pid not in mine:
                with suppress(ChildProcessError):
                    os.waitpid(orphan.pid, os.WNOHANG)

    def _release(self, forked: _Forked) -> None:
        """Close what the server holds of a process."""
        for source in (forked.end, forked.leash):
            with suppress(KeyError):  # a leash whose other side is gone
                self._selector.unregister(source)
        os.close(forked.end)
        forked.leash.close()

    def _leave(self) -> None:
        """In a new process, close what is the server's."""
        for forked in self._forked:
            os.close(forked.end)
            forked.leash.close()
        for branch in self._branches:
            os.close(branch.end)
            branch.requests.close()
        self._selector.close()
        self._requests.close()


def main() -> None:
    """Serve; in a process that was forked, run what it was forked for."""
    requests = socket.socket(fileno=int(sys.argv[1]))
    requests.set_inheritable(False)
    before = sources()
    # what children need, but no plug-ins, which may do what they like
    registry.load_own()
    load_simulator()
    if len(list(Path("/proc/self/task").iterdir())) > 1:  # it would be missing in what is forked
        sys.exit(1)
    adopt()
    server = os.getpid()
    request = _Server(requests, before).serve()
    if request and os.getppid() == server:
        request.run()
    else:  # forked by a branch, or a server at its end
        end_without_threads(request.run if request else lambda: None)


if __name__ == "__main__":
    main()
