"""A child process as its worker sees it: of each run a stream of messages and log lines, and at last an exit code."""

import base64
import contextlib
import json
import os
import queue
import secrets
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import IO, TYPE_CHECKING, Any, Protocol, TypeAlias

from zoobench.cell.memory import memory_of
from zoobench.db.rows import Claim
from zoobench.harness.lifeline import end_descendants
from zoobench.harness.line_reader import LineReader, PipedLine

if TYPE_CHECKING:
    from zoobench.harness.messages import Message

CHILD_COMMAND = (sys.executable, "-m", "zoobench.harness.child")
GRACE_SECONDS = 3.0  # for a child that was asked to stop
EXIT_SECONDS = 30.0  # for a child that has no run any more and writes its compile cache
LONGEST_MESSAGE = 1 << 29  # [bytes]; databases hold no more in one place
MOST_LOG_LINES = 10_000  # of one attempt
_LONGEST_LOG_LINE = 2000
_MOST_EVENTS = 1000  # that wait to be taken: a child that says more waits, too
_LAST_WORDS_SECONDS = 5.0
"""Silence after which a dead child's pipes are left alone: a process that it left behind may hold them open."""


@dataclass(frozen=True)
class LogLine:
    """One line that the child printed."""

    text: str


@dataclass(frozen=True)
class Refused:
    """The child has sent a message that cannot be taken, for this reason."""

    reason: str


@dataclass(frozen=True)
class Idle:
    """The child has said all of its run, and its log is complete: it can do another."""


@dataclass(frozen=True)
class End:
    """The child has closed its streams: it is dead, or about to be."""


Event: TypeAlias = "Message | LogLine | Refused | Idle | End"


class Process(Protocol):
    """A process that does runs, wherever it is.

    Attributes:
        stdin, stdout, stderr: this side of its standard streams.
        died_alone: once it has ended, whether what had started it lives.
    """

    stdin: IO[bytes] | None
    stdout: IO[bytes] | None
    stderr: IO[bytes] | None
    died_alone: bool

    def kill(self) -> None:
        """End it and its group now, if it still runs."""

    def wait(self) -> int:
        """Its exit code, or minus the number of the signal that killed it; then nothing of its group is left."""

    def memory(self) -> int:
        """Resident memory of it and its descendants [bytes]; 0 if it has ended."""


class StartedProcess(subprocess.Popen[bytes]):
    """A process in a group of its own; whatever it starts ends with it.

    What it has started in another group, too, if it is ended from here, or has a guardian (`lifeline.stay_guarded`).
    """

    def __init__(self, command: Sequence[str]) -> None:
        super().__init__(
            list(command), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, process_group=0
        )
        self.died_alone = True

    def kill(self) -> None:
        """End it and its group now, if it still runs."""
        if self.returncode is None:
            end_descendants(self.pid)
            self._end_group()

    def wait(self, timeout: float | None = None) -> int:
        """Its exit code, or minus the number of the signal that killed it; then nothing of its group is left."""
        was_known = self.returncode is not None
        code = super().wait(timeout)
        if not was_known:
            self._end_group()
        return code

    def memory(self) -> int:
        """Resident memory of it and its descendants [bytes]; 0 if it has ended."""
        return memory_of(self.pid)

    def _end_group(self) -> None:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(self.pid, signal.SIGKILL)


class ChildProcess:
    """Sends a process one job after the other, and collects its messages.

    Args:
        process: that has just begun.
    """

    def __init__(self, process: Process) -> None:
        self._events: queue.Queue[Event] = queue.Queue(_MOST_EVENTS)
        self._process = process
        self._log_end = secrets.token_hex(16)
        self._blank_lines = 0
        self._awaited: set[str] = set()  # ends of what a run says
        self._lock = threading.Lock()
        self._is_free, self._is_killed, self._ended = True, False, threading.Event()
        assert self._process.stdout is not None
        assert self._process.stderr is not None
        self._messages = LineReader(self._process.stdout, LONGEST_MESSAGE, self._take_message)
        self._log = LineReader(self._process.stderr, 4 * _LONGEST_LOG_LINE, self._take_log, MOST_LOG_LINES)
        threading.Thread(target=self._announce_end, daemon=True).start()

    @property
    def is_idle(self) -> bool:
        """Whether it lives and has no run."""
        return self._is_free and not (self._is_killed or self._ended.is_set())

    def begin(self, claim: Claim) -> None:
        """Give it a run, where it is idle."""
        self._is_free, self._awaited = False, {"messages", "log"}
        self._log.allow(MOST_LOG_LINES)
        checkpoint = None if claim.checkpoint is None else base64.b64encode(claim.checkpoint).decode()
        stored = [{**vars(each), "spec": each.spec.to_dict()} for each in claim.stored]
        self._tell({"spec": claim.spec.to_dict(), "checkpoint": checkpoint, "stored": stored, "log_end": self._log_end})

    def next(self, timeout: float) -> "Event | None":
        """The next event, or None after `timeout` [s] without one."""
        try:
            event = self._events.get(timeout=max(timeout, 0.0))
        except queue.Empty:
            return None
        self._is_free = self._is_free or isinstance(event, Idle)
        return event

    def ask_to_stop(self) -> None:
        """Ask the method to return after its iteration."""
        self._tell("stop")

    def answer(self, value: float | None, unit: str) -> None:
        """Tell it the reference score that it has asked for; None leaves it to compute it."""
        self._tell({"reference": [value, unit]})

    def kill(self) -> None:
        """End it, and what it has started, now."""
        self._is_killed = True
        self._process.kill()

    def end(self) -> None:
        """Let it end by itself if it is idle, so that it writes its compile cache, else kill it; close its streams."""
        if self.is_idle:
            assert self._process.stdin is not None
            with contextlib.suppress(OSError):
                self._process.stdin.close()
            self._ended.wait(EXIT_SECONDS)
        self.close()

    def wait(self) -> int:
        """Its exit code, or minus the number of the signal that killed it."""
        return self._process.wait()

    @property
    def died_alone(self) -> bool:
        """Once it has ended, whether what had made it lives."""
        return self._process.died_alone

    def memory(self) -> int:
        """Resident memory of it and its descendants [bytes]; 0 if it has ended."""
        return self._process.memory()

    def close(self) -> None:
        """Kill it and close its streams."""
        self.kill()
        self.wait()
        ended = time.monotonic()
        while self._is_read(ended):
            with contextlib.suppress(queue.Empty):  # nobody takes them any more, and a reader may wait for that
                self._events.get(timeout=0.02)
        if self._messages.is_alive or self._log.is_alive:
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

    def _take_message(self, line: PipedLine) -> None:
        from zoobench.harness.messages import LastWord, RefusedMessageError, read_message

        if line.is_cut:
            self._events.put(Refused(f"The method sent a message of more than {LONGEST_MESSAGE:,} bytes."))
            return
        try:
            message = read_message(line.content)
        except RefusedMessageError as error:
            self._events.put(Refused(str(error)))
            return
        self._events.put(_log_line(line) if message is None else message)
        if isinstance(message, LastWord):
            self._note_end("messages")

    def _take_log(self, line: PipedLine) -> None:
        if not line.content:
            self._blank_lines += 1  # the last ones of a log are left out: one is of the line that ends it
            return
        blank, self._blank_lines = self._blank_lines, 0
        if line.content == self._log_end.encode():
            self._note_end("log")
            return
        for _ in range(blank):
            self._events.put(LogLine(""))
        self._events.put(_log_line(line))

    def _note_end(self, of: str) -> None:
        """All messages of a run have been read, or all of its log; with both it is over."""
        with self._lock:
            is_over = self._awaited == {of}
            self._awaited.discard(of)
        if is_over:
            self._events.put(Idle())

    def _announce_end(self) -> None:
        self._process.wait()
        self._ended.set()
        ended = time.monotonic()
        while self._is_read(ended):
            for reader in (self._messages, self._log):
                reader.join(0.02)
        self._events.put(End())

    def _is_read(self, ended: float) -> bool:
        return any(reader.is_at_work(ended, _LAST_WORDS_SECONDS) for reader in (self._messages, self._log))


def _log_line(line: PipedLine) -> LogLine:
    return LogLine(line.content.decode(errors="replace").rstrip()[:_LONGEST_LOG_LINE])
