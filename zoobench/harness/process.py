"""A child process as its worker sees it: a stream of messages and log lines, then an exit code."""

import base64
import contextlib
import json
import os
import queue
import socket
import subprocess
import sys
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from typing import IO, Any

from zoobench.db.rows import Claim
from zoobench.harness.forked import ForkedProcess, fork

CHILD_COMMAND = (sys.executable, "-m", "zoobench.harness.child")
_LONGEST_LOG_LINE = 2000
_LAST_WORDS_SECONDS = 5.0
"""Time for reading the pipes of a dead child to their ends: a process that it left behind may hold them open."""


@dataclass(frozen=True)
class Message:
    """One JSON object from the child; `kind` is its type."""

    kind: str
    contents: dict[str, Any]


@dataclass(frozen=True)
class LogLine:
    """One line that the child printed."""

    text: str


@dataclass(frozen=True)
class End:
    """The child has closed its streams: it is dead, or about to be."""


Event = Message | LogLine | End


class ChildProcess:
    """Starts the command, sends it its job, and collects its messages.

    Args:
        command: to start, never forked from this process, which has threads.
        claim: the run.
        requests: to the fork server that may make the process.
    """

    def __init__(self, command: Sequence[str], claim: Claim, requests: socket.socket | None = None) -> None:
        self._events: queue.SimpleQueue[Event] = queue.SimpleQueue()
        forked = None if requests is None else fork(requests, command)
        self._process: ForkedProcess | subprocess.Popen[bytes] = forked or subprocess.Popen(
            list(command), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE
        )
        parent = forked.parent if forked else os.getpid()
        assert self._process.stdout is not None
        assert self._process.stderr is not None
        self._readers = [
            threading.Thread(target=self._read_messages, args=(self._process.stdout,), daemon=True),
            threading.Thread(target=self._read_log, args=(self._process.stderr,), daemon=True),
        ]
        for reader in self._readers:
            reader.start()
        threading.Thread(target=self._announce_end, daemon=True).start()
        checkpoint = None if claim.checkpoint is None else base64.b64encode(claim.checkpoint).decode()
        stored = [{**vars(each), "spec": each.spec.to_dict()} for each in claim.stored]
        self._tell({"spec": claim.spec.to_dict(), "checkpoint": checkpoint, "stored": stored, "parent": parent})

    def next(self, timeout: float) -> Event | None:
        """The next event, or None after `timeout` [s] without one."""
        try:
            return self._events.get(timeout=max(timeout, 0.0))
        except queue.Empty:
            return None

    def ask_to_stop(self) -> None:
        """Ask the method to return after its iteration."""
        self._tell("stop")

    def answer(self, value: float | None, unit: str) -> None:
        """Tell it the reference score that it has asked for; None leaves it to compute it."""
        self._tell({"reference": [value, unit]})

    def kill(self) -> None:
        """End it now, if it still runs."""
        self._process.kill()

    def wait(self) -> int:
        """Its exit code, or minus the number of the signal that killed it."""
        return self._process.wait()

    def close(self) -> None:
        """Kill it and close its streams."""
        self.kill()
        self.wait()
        self._join_readers()
        if any(reader.is_alive() for reader in self._readers):
            return  # a stream cannot be closed while it is read; both end with the process that holds it open
        for stream in (self._process.stdin, self._process.stdout, self._process.stderr):
            assert stream is not None
            with contextlib.suppress(OSError):  # the last line may not have been read
                stream.close()

    def _tell(self, contents: Any) -> None:
        stream = self._process.stdin
        assert stream is not None
        with contextlib.suppress(OSError):  # a child that has died already is found out by its end
            stream.write(json.dumps(contents).encode() + b"\n")
            stream.flush()

    def _read_messages(self, stream: IO[bytes]) -> None:
        for line in stream:
            try:
                contents = json.loads(line)
                self._events.put(Message(contents.pop("type"), contents))
            except (ValueError, KeyError, AttributeError):  # a line that was cut off by a kill
                self._events.put(LogLine(_readable(line)))

    def _read_log(self, stream: IO[bytes]) -> None:
        for line in stream:
            self._events.put(LogLine(_readable(line)))

    def _announce_end(self) -> None:
        self._process.wait()
        self._join_readers()
        self._events.put(End())

    def _join_readers(self) -> None:
        for reader in self._readers:
            reader.join(_LAST_WORDS_SECONDS)


def _readable(line: bytes) -> str:
    return line.decode(errors="replace").rstrip()[:_LONGEST_LOG_LINE]
