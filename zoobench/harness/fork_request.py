"""A request to a fork server as it arrives there, and the process that it asks for."""

import atexit
import json
import os
import runpy
import socket
import sys
import threading
import traceback
from collections.abc import Callable
from contextlib import suppress
from typing import Any, NamedTuple, NoReturn, Self

from zoobench.harness.forked import LONGEST_REQUEST


class Request(NamedTuple):
    """A process that is asked for: what it is to run, with its streams and its leash; and the message itself."""

    module: str
    arguments: list[str]
    environment: dict[str, str]
    sources: str
    spec: dict[str, Any] | None
    descriptors: list[int]
    message: bytes

    @classmethod
    def read(cls, requests: socket.socket) -> "Self | None":
        """The next one; None if there is nobody left to ask."""
        message, descriptors, _, _ = socket.recv_fds(requests, LONGEST_REQUEST, 4)
        return cls(**json.loads(message), descriptors=list(descriptors), message=message) if message else None

    def close(self) -> None:
        """Close its descriptors."""
        for descriptor in self.descriptors:
            os.close(descriptor)

    def begin(self) -> None:
        """Become the process, but for its module."""
        for target, descriptor in enumerate(self.descriptors[:3]):
            os.dup2(descriptor, target)
        self.close()
        self.set_environment()

    def set_environment(self) -> None:
        """Take the environment of whoever asks."""
        os.environ.clear()
        os.environ.update(self.environment)

    def run(self) -> None:
        """Run the module as `python -m` does."""
        sys.argv = ["", *self.arguments]
        runpy.run_module(self.module, run_name="__main__", alter_sys=True)


def end_without_threads(work: Callable[[], None]) -> NoReturn:
    """Do the last work of this process and end it, as Python does but for waiting for threads of libraries."""
    code = 0
    try:
        work()
    except SystemExit as end:
        code = (end.code or 0) if isinstance(end.code, int | None) else 1
    except BaseException:
        traceback.print_exc()
        code = 1
    threading._shutdown()  # type: ignore[attr-defined]  # as multiprocessing does
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):
            stream.flush()
    os._exit(code)
