"""An owner is one process, living or dead."""

import os
import platform
import subprocess
import sys
from dataclasses import replace

import psutil
import pytest

from tests.harness.helpers import spec
from zoobench.db.owner import Owner
from zoobench.db.store import Store

ME = Owner.current()


def test_an_owner_survives_as_text() -> None:
    """Host names may hold colons, too."""
    owner = Owner("host:name", "boot-1", "4026531836", 17, 1234)
    assert Owner.parse(str(owner)) == owner


def test_this_process_lives() -> None:
    """The process that asks is not dead."""
    assert Owner.parse(str(ME)).is_here
    assert not Owner.parse(str(ME)).is_known_dead


def test_an_ended_process_is_dead_even_before_it_is_reaped() -> None:
    """A zombie does no work."""
    command = "import zoobench.db.owner as owner; print(owner.Owner.current(), flush=True); input()"
    with subprocess.Popen(
        [sys.executable, "-c", command], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        owner = Owner.parse(process.stdout.readline().strip())
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
        replace(ME, boot="another-boot", pid=1, start=0),
        replace(ME, namespace="1", start=0),
        Owner.parse(f"{platform.node()}:{os.getpid()}:1234.50"),  # as an earlier zoobench wrote it
    ],
)
def test_elsewhere_the_lease_decides(owner: Owner) -> None:
    """Another boot or PID namespace may bear this host's name, and its process numbers mean others here."""
    assert not Owner.parse(str(owner)).is_here
    assert not Owner.parse(str(owner)).is_known_dead
