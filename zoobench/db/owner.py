"""The process that holds a run, distinguished from every other one."""

import os
import platform
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import psutil

_ENDED = frozenset("ZXx")  # states of a process that does no work any more: zombie, dead


@dataclass(frozen=True)
class Owner:
    """A process; as text `host:boot:namespace:pid:start`.

    No clock that can be set takes part in it, and no name that two machines or containers may share.

    Attributes:
        host: name of the machine, for people.
        boot: what distinguishes this start of the machine from every other.
        namespace: in which `pid` counts: containers have one each. Empty if unknown.
        start: when the process started, in ticks since the boot.
    """

    host: str
    boot: str
    namespace: str
    pid: int
    start: int

    @classmethod
    def current(cls) -> Self:
        """This process."""
        boot, namespace = _place()
        started = _started("self" if sys.platform == "linux" else str(os.getpid()))
        return cls(platform.node(), boot, namespace, os.getpid(), started or 0)

    @classmethod
    def parse(cls, text: str) -> Self:
        """The inverse of `str`; of an owner that an earlier zoobench wrote, no place is known."""
        try:
            host, boot, namespace, pid, start = text.rsplit(":", 4)
            return cls(host, boot, namespace, int(pid), int(start))
        except ValueError:
            return cls(text, "", "", 0, 0)

    def __str__(self) -> str:
        return f"{self.host}:{self.boot}:{self.namespace}:{self.pid}:{self.start}"

    @property
    def is_here(self) -> bool:
        """Whether its process number means the same process here."""
        return bool(self.namespace) and (self.boot, self.namespace) == _place()

    @property
    def is_known_dead(self) -> bool:
        """True if it ran here and does not any more; False for the living and for those elsewhere."""
        if not self.is_here:
            return False
        started = _started(str(self.pid))
        return started != self.start and not (started is None and _is_hidden(self.pid))


def _place() -> tuple[str, str]:
    """Boot and namespace of this process."""
    if sys.platform != "linux":
        return platform.node(), "host"
    boot = Path("/proc/sys/kernel/random/boot_id").read_text().strip()
    if str(Path("/proc/self").readlink()) != str(os.getpid()):  # /proc shows the processes of another namespace
        return boot, ""
    return boot, str(Path("/proc/self/ns/pid").stat().st_ino)


def _started(pid: str) -> int | None:
    """When a process started; None if there is none, or none that still works."""
    if sys.platform != "linux":  # there the start is kept as it was, and not computed from the clock
        try:
            process = psutil.Process(int(pid))
            return None if process.status() == psutil.STATUS_ZOMBIE else int(process.create_time() * 100.0)
        except psutil.NoSuchProcess:
            return None
    try:
        facts = Path(f"/proc/{pid}/stat").read_text(errors="replace").rpartition(")")[2].split()
    except OSError:
        return None
    return None if facts[0] in _ENDED else int(facts[19])


def _is_hidden(pid: int) -> bool:
    """Whether a process is another user's: the system may not show it."""
    try:
        os.kill(pid, 0)
    except PermissionError:
        return True
    except ProcessLookupError:
        return False
    return False
