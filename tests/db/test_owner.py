"""An owner is one thread of one process, living or dead."""

import os
import platform
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import psutil
import pytest

from tests.harness.helpers import spec
from zoobench.db.owner import Owner
from zoobench.db.store import Store

ME = Owner.current()


@contextmanager
def _another_process() -> Iterator[tuple["subprocess.Popen[str]", Owner]]:
    """A process that waits, and the owner that it is."""
    command = "import zoobench.db.owner as owner; print(owner.Owner.current(), flush=True); input()"
    with subprocess.Popen(
        [sys.executable, "-c", command], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        yield process, Owner.parse(process.stdout.readline().strip())


def test_an_owner_survives_as_text() -> None:
    """Host names may hold colons, too."""
    owner = Owner("host:name", "1f2e3d", 17, 18, 1234)
    assert Owner.parse(str(owner)) == owner


def test_this_process_lives() -> None:
    """The process that asks is not dead."""
    me = Owner.parse(str(ME))
    assert (me.is_here, me.is_of_this_process, me.is_known_alive, me.is_known_dead) == (True, True, True, False)


def test_a_stopped_process_lives() -> None:
    """Whatever has stopped it: it goes on some time."""
    with _another_process() as (process, owner):
        process.send_signal(signal.SIGSTOP)
        os.waitid(os.P_PID, process.pid, os.WSTOPPED | os.WNOWAIT)
        assert (owner.is_known_alive, owner.is_known_dead, owner.is_of_this_process) == (True, False, False)
        process.kill()


@pytest.mark.skipif(sys.platform != "linux", reason="threads have numbers of their own on Linux alone")
def test_a_thread_that_has_ended_is_dead_though_its_process_lives() -> None:
    """A worker that gave up within a notebook holds no run any more."""
    found: list[Owner] = []
    release = threading.Event()
    thread = threading.Thread(target=lambda: (found.append(Owner.current()), release.wait()))
    thread.start()
    while not found:
        time.sleep(0.01)
    (owner,) = found
    assert (owner.is_known_alive, owner.is_of_this_process) == (True, True)
    release.set()
    thread.join()
    while owner.is_known_alive:  # Python's thread ends a moment before that of the system
        time.sleep(0.01)
    assert owner.is_known_dead


def test_an_ended_process_is_dead_even_before_it_is_reaped() -> None:
    """A zombie does no work."""
    with _another_process() as (process, owner):
        assert owner.pid == process.pid
        assert not owner.is_known_dead
        process.kill()
        os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
        assert owner.is_known_dead
    assert owner.is_known_dead


def test_a_later_process_with_the_same_number_is_another() -> None:
    """Process numbers come round again."""
    assert replace(ME, start=ME.start - 60).is_known_dead


def test_a_clock_that_is_set_kills_nobody(location: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The start of a process in seconds since the epoch moves with the clock, by 5 s here; its identity does not."""
    with Store(location) as store:
        store.enqueue([spec()])
        assert store.claim(Owner.current(), provenance={}) is not None
        before = psutil.Process.create_time
        monkeypatch.setattr(psutil.Process, "create_time", lambda process: before(process) + 5.0)
        assert store.recover() == []


@pytest.mark.parametrize(
    "owner",
    [
        replace(ME, place="another", thread=1, start=0),
        replace(ME, place=""),
        Owner.parse(f"{platform.node()}:{os.getpid()}:1234.50"),  # as earlier versions of zoobench wrote them
        Owner.parse(f"{platform.node()}:bcb14d7e-5d89-3f17:4026531836:{os.getpid()}:{ME.start}"),
    ],
)
def test_elsewhere_the_lease_decides(owner: Owner) -> None:
    """Another boot or PID namespace may bear this host's name, and its process numbers mean others here."""
    owner = Owner.parse(str(owner))
    assert (owner.is_here, owner.is_known_dead, owner.is_known_alive) == (False, False, False)


@pytest.mark.skipif(sys.platform != "linux", reason="the files are Linux's")
@pytest.mark.parametrize("fact", ["/etc/machine-id", "/proc/sys/kernel/random/boot_id", "ns/pid", "ns/time", "host"])
def test_whatever_tells_two_machines_apart_makes_two_places(fact: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Copies of a virtual machine share most of it, two time namespaces all but one."""

    def text(path: Path, *args: str, **kwargs: str) -> str:
        return "another" if str(path) == fact else read_text(path, *args, **kwargs)

    def link(path: Path) -> Path:
        return Path("another") if str(path).endswith(fact) else readlink(path)

    read_text, readlink = Path.read_text, Path.readlink
    monkeypatch.setattr(Path, "read_text", text)
    monkeypatch.setattr(Path, "readlink", link)
    if fact == "host":
        monkeypatch.setattr(platform, "node", lambda: "another")
    assert not ME.is_here
