"""The end of a process with its parent: it reads its orders from standard input and ends when that is closed.

An operating system closes a dead process's pipes whatever killed it, so nothing that `run` started outlives it. On
Linux what the process has started ends with it, too, even in a session of its own: the process becomes the parent of
what its descendants leave behind, and if it is killed, its fork server does.
"""

import ctypes
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Collection
from contextlib import suppress

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


def adopt() -> None:
    """Ask Linux to make this process the parent of those of its descendants that have lost theirs."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_CHILD_SUBREAPER, 1)


def end_descendants(pid: int | None = None, but: Collection[int] = ()) -> None:
    """Kill all descendants of a process, by default this one, that are there and that come meanwhile.

    Those of another process are all there only if it has called `adopt`.

    Args:
        but: children of it that live on, with what they have started.
    """
    for _ in range(_ROUNDS):
        if not (found := _living(pid, but)):
            return
        for process in found:
            with suppress(psutil.Error):
                process.kill()
        time.sleep(_ROUND_SECONDS)


def _living(pid: int | None, but: Collection[int]) -> list[psutil.Process]:
    """The descendants of a process that are no zombies."""
    try:
        children = [child for child in psutil.Process(pid).children() if child.pid not in but]
    except psutil.Error:
        return []
    found = []
    for child in children:
        with suppress(psutil.Error):
            found += [each for each in (child, *child.children(recursive=True)) if not _is_zombie(each)]
    return found


def _is_zombie(process: psutil.Process) -> bool:
    return process.status() in (psutil.STATUS_ZOMBIE, psutil.STATUS_DEAD)


def die_with(parent: int) -> None:
    """Ask Linux to kill this process when its parent dies, even while a native kernel holds the interpreter."""
    if sys.platform != "linux":
        return
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:  # it died before the call above
        os._exit(1)
