"""An owner is one process, living or dead."""

import os
import subprocess
import sys

from zoobench.db.owner import Owner


def test_an_owner_survives_as_text() -> None:
    """Host names may hold colons, too."""
    owner = Owner("host:name", 17, 1234.5)
    assert Owner.parse(str(owner)) == owner


def test_this_process_lives() -> None:
    """The process that asks is not dead."""
    assert not Owner.parse(str(Owner.current())).is_known_dead


def test_an_ended_process_is_dead_even_before_it_is_reaped() -> None:
    """A zombie does no work."""
    process = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    owner = Owner.parse(f"{os.uname().nodename}:{process.pid}:{_start(process.pid):.2f}")
    assert not owner.is_known_dead
    process.kill()
    os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
    assert owner.is_known_dead
    process.communicate()
    assert owner.is_known_dead


def test_a_later_process_with_the_same_number_is_another() -> None:
    """Process numbers come round again."""
    me = Owner.current()
    assert Owner(me.host, me.pid, me.start - 60.0).is_known_dead


def test_nothing_is_known_of_other_hosts() -> None:
    """There the lease decides."""
    assert not Owner("elsewhere", 1, 0.0).is_known_dead


def _start(pid: int) -> float:
    import psutil

    return psutil.Process(pid).create_time()
