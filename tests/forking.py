"""Programs that need the simulator, in processes of their own, forked from one that has loaded it once for all tests.

To load it takes two seconds of a processor, more than most of these programs do. They are what Python would start: see
`zoobench.harness.fork_server`, and `tests/harness/test_fork_server.py` for what holds of it.
"""

import os
import subprocess
import sys
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from functools import cache
from pathlib import Path

import psutil
import pytest

from zoobench.harness import worker_pool
from zoobench.harness.fork_server import ForkServer, can_fork
from zoobench.harness.forked import fork
from zoobench.harness.provenance import THREAD_VARIABLES


@cache
def server() -> ForkServer:
    """The fork server of all tests of this process, started when the first asks for it."""
    return ForkServer()


def stop() -> None:
    """End the server, if there is one."""
    if server.cache_info().currsize:
        server().__exit__()
        server.cache_clear()


@contextmanager
def for_pools() -> Iterator[None]:
    """Pools of workers within have that server in place of one of their own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(worker_pool, "ForkServer", lambda: nullcontext(server()))
        yield


def children() -> list[psutil.Process]:
    """The processes that this one has started, and theirs, but for that server."""
    servers = {server()._process.pid} if server.cache_info().currsize else set()
    mine = [child for child in psutil.Process().children() if child.pid not in servers]
    return [each for child in mine for each in (child, *child.children(recursive=True))]


def run(
    *words: object, cwd: Path, environ: Mapping[str, str] | None = None, timeout: float = 300.0
) -> subprocess.CompletedProcess[str]:
    """What `python WORDS` does in a folder, where the words begin with a file or with `-m MODULE`; as `subprocess.run`.

    Args:
        environ: settings beside those of this process.
        timeout: the process is killed after it [s].
    """
    command = (sys.executable, "-m", "tests.forked_program", str(cwd), *map(str, words))
    settings = dict.fromkeys(THREAD_VARIABLES, "1") | dict(environ or {})
    if not can_fork():
        environment = os.environ | settings
        return subprocess.run(command, capture_output=True, text=True, check=False, env=environment, timeout=timeout)
    with pytest.MonkeyPatch.context() as patch:
        for name, value in settings.items():
            patch.setenv(name, value)
        process = fork(server().requests, command)
    assert process is not None
    process.stdin.close()
    watch = threading.Timer(timeout, process.kill)
    watch.start()
    errors: list[bytes] = []
    reader = threading.Thread(target=lambda: errors.append(process.stderr.read()))
    reader.start()
    out = process.stdout.read()
    reader.join()
    watch.cancel()
    return subprocess.CompletedProcess(command, process.wait(), out.decode(), errors[0].decode())
