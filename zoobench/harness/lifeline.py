"""The end of a process with its parent: it reads its orders from standard input and ends when that is closed.

An operating system closes a dead process's pipes whatever killed it, so nothing that `run` started outlives it. On
Linux what the process has started ends with it, too, even in a session of its own: it has a guardian, which becomes the
parent of what is left behind.
"""

import ctypes
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import NoReturn

import psutil

_CHUNK = 1 << 16
_PR_SET_PDEATHSIG = 1
_PR_SET_CHILD_SUBREAPER = 36
_ROUNDS = 200  # of killing what is there, while what is killed starts more
_ROUND_SECONDS = 0.01


class Lifeline:
    """The pipe from the parent, read without Python's buffers: they deadlock when an interpreter shuts down."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._buffer = b""

    def line(self) -> bytes | None:
        """The next line without its newline; None when the parent is gone."""
        parts = [self._buffer]
        while b"\n" not in parts[-1]:
            try:
                chunk = os.read(self._descriptor, _CHUNK)
            except OSError:
                return None
            if not chunk:
                return None
            parts.append(chunk)
        line, _, self._buffer = b"".join(parts).partition(b"\n")
        return line

    def watch(self, on_line: Callable[[bytes], None], on_end: Callable[[], None]) -> None:
        """Go on reading in a thread of its own."""

        def read() -> None:
            while (line := self.line()) is not None:
                on_line(line)
            on_end()

        threading.Thread(target=read, name="lifeline", daemon=True).start()


def take_standard_input() -> int:
    """A descriptor of standard input, which is empty from then on: what other code does with that ends nobody."""
    taken = os.dup(0)
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    return taken


def end_group() -> None:
    """End this process at once, and what it has started, on systems other than Linux if it leads a group of its own."""
    end_descendants()
    if os.getpgrp() == os.getpid():
        os.killpg(0, signal.SIGKILL)
    os._exit(1)


def stay_guarded() -> None:
    """On Linux, go on in a fork of this process, which waits for its end and then ends what it has left behind.

    The guardian ends as the fork does. If the parent of this process ends, so do both, even while a native kernel holds
    the interpreter. To be called before there are threads.
    """
    if sys.platform != "linux":
        return
    guardian = os.getpid()
    _adopt_and_die_with_parent(signal.SIGTERM)
    if pid := os.fork():
        _guard(pid)
    _adopt_and_die_with_parent(signal.SIGKILL)
    if os.getppid() != guardian:  # it ended before that call
        os._exit(1)


def _adopt_and_die_with_parent(by: signal.Signals) -> None:
    """Ask Linux to make this process the parent of those of its descendants that have lost theirs.

    And to send it a signal when its parent ends: the thread that has started it.
    """
    system = ctypes.CDLL(None)
    system.prctl(_PR_SET_CHILD_SUBREAPER, 1)
    system.prctl(_PR_SET_PDEATHSIG, by)


def _guard(pid: int) -> NoReturn:
    """Wait for the end of a child of this process, end what it has left behind, and end as it did."""
    signal.signal(signal.SIGTERM, lambda *_: os.kill(pid, signal.SIGKILL))
    _, status = os.waitpid(pid, 0)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    end_descendants()
    code = os.waitstatus_to_exitcode(status)
    if code < 0:
        import resource  # there is none on Windows

        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))  # there is one of the child
        with suppress(OSError):  # SIGKILL has no handler
            signal.signal(-code, signal.SIG_DFL)
        os.kill(os.getpid(), -code)
    os._exit(code)


def end_descendants(pid: int | None = None) -> None:
    """Kill all descendants of a process, by default this one, that are there and that come meanwhile.

    Those of another process are all there only if it has called `adopt`.
    """
    for _ in range(_ROUNDS):
        if not (found := _living(pid)):
            return
        for process in found:
            with suppress(psutil.Error):
                process.kill()
        time.sleep(_ROUND_SECONDS)


def _living(pid: int | None) -> list[psutil.Process]:
    """The descendants of a process that are no zombies."""
    found = []
    with suppress(psutil.Error):
        for each in psutil.Process(pid).children(recursive=True):
            with suppress(psutil.Error):
                found += [] if _is_zombie(each) else [each]
    return found


def _is_zombie(process: psutil.Process) -> bool:
    return process.status() in (psutil.STATUS_ZOMBIE, psutil.STATUS_DEAD)
