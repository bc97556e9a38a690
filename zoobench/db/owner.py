"""The thread that holds a run, distinguished from every other one."""

import hashlib
import os
import platform
import sys
import threading
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import psutil

_ENDED = frozenset("ZXx")  # states of a thread that does no work any more: zombie, dead


@dataclass(frozen=True)
class Owner:
    """A thread of a process; as text `host:place:pid:thread:start`.

    No clock that can be set takes part in it, and no name that two machines or containers may share.

    Attributes:
        host: name of the machine, for people.
        place: a hash of the machine, this start of it, and the namespaces in which numbers and starts count: containers
            have their own. Empty if unknown.
        thread: its number. On Linux numbers of threads and processes are of one kind; elsewhere it is `pid`.
        start: when the thread started, in ticks since the boot.
    """

    host: str
    place: str
    pid: int
    thread: int
    start: int

    @classmethod
    def current(cls) -> Self:
        """This thread."""
        thread = threading.get_native_id() if sys.platform == "linux" else os.getpid()
        return cls(platform.node(), _place(), os.getpid(), thread, _started(thread) or 0)

    @classmethod
    def parse(cls, text: str) -> Self:
        """The inverse of `str`; of an owner that an earlier zoobench wrote, no place is known."""
        try:
            host, place, pid, thread, start = text.rsplit(":", 4)
            return cls(host, place, int(pid), int(thread), int(start))
        except ValueError:
            return cls(text, "", 0, 0, 0)

    def __str__(self) -> str:
        return f"{self.host}:{self.place}:{self.pid}:{self.thread}:{self.start}"

    @property
    def is_here(self) -> bool:
        """Whether its number means the same thread here."""
        return bool(self.place) and self.place == _place()

    @property
    def is_of_this_process(self) -> bool:
        """Whether it is a thread of this process."""
        return self.is_here and self.pid == os.getpid()

    @property
    def is_known_alive(self) -> bool:
        """True if it is seen here, at work or stopped; False for the dead and for those elsewhere."""
        return self.is_here and _started(self.thread) == self.start

    @property
    def is_known_dead(self) -> bool:
        """True if it ran here and does not any more; False for the living and for those elsewhere."""
        if not self.is_here:
            return False
        started = _started(self.thread)
        return started != self.start and not (started is None and _is_hidden(self.thread))


def _place() -> str:
    """A key of the place within which a number means the same thread; empty if that cannot be told."""
    if sys.platform != "linux":
        return platform.node()
    if str(Path("/proc/self").readlink()) != str(os.getpid()):  # /proc shows the processes of another namespace
        return ""
    facts = [platform.node()]  # copies of one virtual machine share the rest until they are named
    for path in ("/etc/machine-id", "/proc/sys/kernel/random/boot_id"):
        with suppress(OSError):
            facts.append(Path(path).read_text().strip())
    for kind in ("pid", "time"):  # the start of a thread is told by the clock of the namespace that asks
        with suppress(OSError):
            facts.append(str(Path(f"/proc/self/ns/{kind}").readlink()))
    return hashlib.sha256("\n".join(facts).encode()).hexdigest()[:16]


def _started(thread: int) -> int | None:
    """When a thread started; None if there is none, or none that still works."""
    if sys.platform != "linux":  # there the start is kept as it was, and not computed from the clock
        try:
            process = psutil.Process(thread)
            return None if process.status() == psutil.STATUS_ZOMBIE else int(process.create_time() * 100.0)
        except psutil.NoSuchProcess:
            return None
    try:
        facts = Path(f"/proc/{thread}/stat").read_text(errors="replace").rpartition(")")[2].split()
    except OSError:
        return None
    return None if facts[0] in _ENDED else int(facts[19])


def _is_hidden(thread: int) -> bool:
    """Whether a thread is another user's: the system may not show it."""
    try:
        os.kill(thread, 0)
    except PermissionError:
        return True
    except ProcessLookupError:
        return False
    return False
