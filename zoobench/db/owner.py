"""The process that holds a run, distinguished from a later one with the same number."""

import os
import platform
from dataclasses import dataclass
from typing import Self

import psutil

_SAME_START = 1.0  # [s]; the clock behind a start time may be set while a process runs


@dataclass(frozen=True)
class Owner:
    """A process on a host; as text `host:pid:start`."""

    host: str
    pid: int
    start: float

    @classmethod
    def current(cls) -> Self:
        """This process."""
        return cls(platform.node(), os.getpid(), psutil.Process().create_time())

    @classmethod
    def parse(cls, text: str) -> Self:
        """The inverse of `str`."""
        host, pid, start = text.rsplit(":", 2)
        return cls(host, int(pid), float(start))

    def __str__(self) -> str:
        return f"{self.host}:{self.pid}:{self.start:.2f}"

    @property
    def is_known_dead(self) -> bool:
        """True if it ran on this host and does not any more; False for the living and for those elsewhere."""
        if self.host != platform.node():
            return False
        try:
            process = psutil.Process(self.pid)
            if process.status() == psutil.STATUS_ZOMBIE:
                return True
            return abs(process.create_time() - self.start) > _SAME_START
        except psutil.NoSuchProcess:
            return True
