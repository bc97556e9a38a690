"""The end of a process with its parent: it reads its orders from standard input and ends when that is closed.

An operating system closes a dead process's pipes whatever killed it, so nothing that `run` started outlives it.
"""

import ctypes
import os
import signal
import sys
import threading
from collections.abc import Callable

_CHUNK = 1 << 16
_PR_SET_PDEATHSIG = 1


class Lifeline:
    """The pipe from the parent, read without Python's buffers: they deadlock when an interpreter shuts down."""

    def __init__(self, descriptor: int = 0) -> None:
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


def end_group() -> None:
    """End this process at once, and what it has started if it leads a group of its own."""
    if os.getpgrp() == os.getpid():
        os.killpg(0, signal.SIGKILL)
    os._exit(1)


def die_with(parent: int) -> None:
    """Ask Linux to kill this process when its parent dies, even while a native kernel holds the interpreter."""
    if sys.platform != "linux":
        return
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:  # it died before the call above
        os._exit(1)
