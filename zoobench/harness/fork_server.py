"""A process that has loaded the simulator and forks others, which then need not load it.

`python -m zoobench.harness.fork_server DESCRIPTOR`, one for a pool of workers. It has a single thread and does nothing
but fork, wait and kill. Whoever holds the other end of the socket DESCRIPTOR may ask for processes; it ends when nobody
does. A request is a JSON object of the `module` and `arguments` of `python -m`, `environment` and `sources`, with four
descriptors: standard input, output and error, and a socket, the leash. On the leash it tells the pids of itself and of
the process, and in the end the exit code. `KILL` from the other side kills the process, and so does the end of whoever
holds that side. The end of the server kills all of them. Each leads a group, and what it has started ends with it.

It closes the leash of a process that would not be what Python starts: if the sources were changed since it began, or if
the environment has other settings for libraries that it has loaded.

To fork is safe here as nothing runs that the forked process would lack: no other thread, no runtime, no database. On
macOS the system's own libraries have threads, and there is no fork server.
"""

import json
import os
import runpy
import selectors
import signal
import socket
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple, Self

from zoobench import registry, rounding
from zoobench.harness.forked import CODE, KILL, LONGEST_REQUEST, PIDS
from zoobench.harness.lifeline import die_with
from zoobench.harness.provenance import THREAD_VARIABLES, sources

_LOADED_WITH = (*THREAD_VARIABLES, *rounding.CHOICES)
"""Environment variables that libraries read when they are loaded."""

_END_SECONDS = 5.0


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


class _Request(NamedTuple):
    """A process that is asked for: what it is to run, with its streams and its leash."""

    module: str
    arguments: list[str]
    environment: dict[str, str]
    sources: str
    descriptors: list[int]

    @classmethod
    def read(cls, requests: socket.socket) -> "Self | None":
        """The next one; None if there is nobody left to ask."""
        message, descriptors, _, _ = socket.recv_fds(requests, LONGEST_REQUEST, 4)
        return cls(**json.loads(message), descriptors=list(descriptors)) if message else None

    def begin(self) -> None:
        """Become the process, but for its module."""
        for target, descriptor in enumerate(self.descriptors[:3]):
            os.dup2(descriptor, target)
        for descriptor in self.descriptors:
            os.close(descriptor)
        os.environ.clear()
        os.environ.update(self.environment)

    def run(self) -> None:
        """Run the module as `python -m` does."""
        sys.argv = ["", *self.arguments]
        runpy.run_module(self.module, run_name="__main__", alter_sys=True)


class _Forked(NamedTuple):
    """A process in the server's care."""

    pid: int
    end: int
    leash: socket.socket


class _Server:
    def __init__(self, requests: socket.socket, sources: str) -> None:
        self._requests, self._sources = requests, sources
        self._selector = selectors.DefaultSelector()
        self._selector.register(requests, selectors.EVENT_READ)
        self._forked: list[_Forked] = []
        self._ends = False

    def serve(self) -> _Request | None:
        """Serve until nobody can ask any more: None; in a process that was forked, its request."""
        while self._forked or not self._ends:
            for key, _ in self._selector.select():
                if key.fileobj is not self._requests:
                    self._look_after(key.data, key.fileobj)
                elif request := _Request.read(self._requests):
                    if self._fork(request):
                        return request
                else:
                    self._selector.unregister(self._requests)
                    self._ends = True
        return None

    def _fork(self, request: _Request) -> bool:
        """Fork if it is to be; True in the new process."""
        leash = socket.socket(fileno=request.descriptors[3])
        settings = [request.environment.get(name) == os.environ.get(name) for name in _LOADED_WITH]
        if request.sources == self._sources and all(settings):
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
        with suppress(OSError):
            forked.leash.send(CODE.pack(code))
        self._release(forked)
        self._forked.remove(forked)

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
        self._selector.close()
        self._requests.close()


def _load() -> None:
    """Load what children need, but no plug-ins, which may do what they like."""
    from zoobench.cell.loading import load_simulator

    registry.load_own()
    load_simulator()


def main() -> int:
    """Serve; in a process that was forked, run what it was forked for."""
    requests = socket.socket(fileno=int(sys.argv[1]))
    requests.set_inheritable(False)
    before = sources()
    _load()
    if len(list(Path("/proc/self/task").iterdir())) > 1:  # it would be missing in what is forked
        return 1
    if request := _Server(requests, before).serve():
        request.run()
    return 0


if __name__ == "__main__":
    sys.exit(main())
