"""A process that a fork server has made, seen by the one who asked for it."""

import json
import os
import signal
import socket
import struct
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from multiprocessing import connection
from typing import IO

from zoobench.cell.memory import memory_of
from zoobench.harness.provenance import sources
from zoobench.spec import RunSpec

LONGEST_REQUEST = 1 << 17
KILL = b"kill"
PIDS, CODE = struct.Struct("qq"), struct.Struct("q")

_PATIENCE_SECONDS = 60.0  # for the server to load and to answer
_KERNEL_SECONDS = 300.0  # for a branch to load kernels, too, or to compile them
_LOOK_SECONDS = 0.2


class ForkedProcess:
    """Used like `subprocess.Popen`.

    Attributes:
        stdin, stdout, stderr: this side of its standard streams.
        parent: process id of the server.
        pid: its own.
        died_alone: once it has ended, whether the server lives.
    """

    def __init__(self, streams: Sequence[IO[bytes]], leash: socket.socket, parent: int, pid: int) -> None:
        self.stdin: IO[bytes] | None
        self.stdout: IO[bytes] | None
        self.stderr: IO[bytes] | None
        self.stdin, self.stdout, self.stderr = streams
        self.parent, self.pid = parent, pid
        self._leash, self._lock = leash, threading.Lock()
        self._code: int | None = None
        self.died_alone = True

    def kill(self) -> None:
        """End it now, if it still runs."""
        with suppress(OSError):
            self._leash.send(KILL)

    def memory(self) -> int:
        """Resident memory of it and its descendants [bytes]; 0 if it has ended."""
        return memory_of(self.pid)

    def wait(self) -> int:
        """Its exit code, or minus the number of the signal that killed it; it dies with its server, by SIGKILL.

        Then nothing of its group is left.
        """
        with self._lock:
            if self._code is None:
                said = hear(self._leash, CODE.size)
                self._code = int(CODE.unpack(said)[0]) if said else -signal.SIGKILL
                self.died_alone = bool(said)
                if not said:  # else the server has done so
                    with suppress(ProcessLookupError, PermissionError):
                        os.killpg(self.pid, signal.SIGKILL)
                self._leash.close()
            return self._code


def fork(
    requests: socket.socket,
    command: Sequence[str],
    spec: RunSpec | None = None,
    is_wanted: Callable[[], bool] = lambda: True,
) -> ForkedProcess | None:
    """A process for a command `python -m`, with the environment of this one; None if it has to be started anew.

    Args:
        requests: to the fork server.
        command: as for `subprocess.Popen`.
        spec: of the run that it is to do, whose kernels it is to have; if they cannot be had soon, it has none.
        is_wanted: asked several times a second while the server is waited for; what it raises ends the waiting.
    """
    if tuple(command[:2]) != (sys.executable, "-m"):
        return None
    process = None if spec is None else _ask(requests, command, spec, _KERNEL_SECONDS, is_wanted)
    if process is None and is_wanted():
        process = _ask(requests, command, None, _PATIENCE_SECONDS, is_wanted)
    return process


def _ask(
    requests: socket.socket,
    command: Sequence[str],
    spec: RunSpec | None,
    patience: float,
    is_wanted: Callable[[], bool],
) -> ForkedProcess | None:
    wanted = {
        "module": command[2],
        "arguments": command[3:],
        "environment": dict(os.environ),
        "sources": sources(),
        "spec": None if spec is None else spec.to_dict(),
    }
    request = json.dumps(wanted).encode()
    if len(request) > LONGEST_REQUEST:
        return None
    with ExitStack() as ours, ExitStack() as theirs:
        pipes = [[os.fdopen(end, mode) for end, mode in zip(os.pipe(), ("rb", "wb"), strict=True)] for _ in range(3)]
        pipes[0].reverse()  # to standard input it is we who write
        streams, others = zip(*pipes, strict=True)
        for mine, other in pipes:
            ours.enter_context(mine)
            theirs.enter_context(other)
        ends = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        leash = ours.enter_context(ends[0])
        theirs.enter_context(ends[1])
        try:
            socket.send_fds(requests, [request], [each.fileno() for each in (*others, ends[1])])
            theirs.close()  # else the end of the server would not be noticed
        except OSError:
            return None
        deadline = time.monotonic() + patience
        while not connection.wait([leash], _LOOK_SECONDS):
            if time.monotonic() > deadline or not is_wanted():
                return None
        said = hear(leash, PIDS.size)
        if not said:
            return None
        ours.pop_all()
        return ForkedProcess(streams, leash, *PIDS.unpack(said))


def hear(leash: socket.socket, size: int) -> bytes:
    """The next message; empty if the other side is gone."""
    try:
        return leash.recv(size)
    except OSError:
        return b""


def is_held(leash: socket.socket) -> bool:
    """Whether the other side of a leash on which nothing is said yet is still there."""
    try:
        return bool(leash.recv(1, socket.MSG_PEEK | socket.MSG_DONTWAIT))
    except BlockingIOError:
        return True
    except OSError:
        return False
