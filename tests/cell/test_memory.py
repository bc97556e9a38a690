"""The memory of a process, in bytes on every system, and results that do not depend on it."""

import os
import resource
import signal
import subprocess
import sys
from collections.abc import Iterator
from mmap import mmap
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import psutil
import pytest

from tests.conformance.cells import cell
from tests.methods.toy import Context
from zoobench.cell import memory
from zoobench.cell.memory import allow, begin_account, memory_of, peak_memory, share_among
from zoobench.cell.problem import Problem
from zoobench.errors import UsageError
from zoobench.harness.finals import finals_of
from zoobench.methods.diffphysics import DiffPhysics
from zoobench.sim.memory_budget import MEMORY_VARIABLE, WORKERS_VARIABLE, memory_share
from zoobench.spec import Budget


@pytest.fixture
def _own_environment(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """What is allowed here is forgotten afterwards."""
    monkeypatch.setenv(MEMORY_VARIABLE, "1GB")
    memory_share.cache_clear()
    yield
    memory_share.cache_clear()


@pytest.mark.parametrize(("system", "told"), [("linux", 3 * 2**10), ("darwin", 3 * 2**20)])
def test_peak_memory_is_in_bytes(monkeypatch: pytest.MonkeyPatch, system: str, told: int) -> None:
    """Of a whole process Linux counts in KiB, macOS in bytes."""
    monkeypatch.setattr(memory, "_STATUS", Path("/nowhere"))
    monkeypatch.setattr(sys, "platform", system)
    monkeypatch.setattr(resource, "getrusage", lambda _: SimpleNamespace(ru_maxrss=told))
    assert peak_memory() == 3 * 2**20


def test_a_system_that_does_not_tell_is_no_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """Windows does not have the module."""
    monkeypatch.setattr(memory, "_STATUS", Path("/nowhere"))
    monkeypatch.setitem(sys.modules, "resource", None)
    assert peak_memory() is None


def test_memory_that_was_used_is_in_the_peak() -> None:
    """The peak includes memory that was released, but not what was released before the account began."""
    found = []
    for size in (90 * 2**20, 50 * 2**20):
        begin_account()
        before = psutil.Process().memory_info().rss
        with mmap(-1, size) as block:
            block[::4096] = bytes(size // 4096)
        found.append((peak_memory() or 0) - before)
    assert found[0] > 85 * 2**20
    assert found[1] > 45 * 2**20
    assert found[1] < 80 * 2**20 or sys.platform != "linux"


def _outcome(size: str, design: str) -> tuple[object, int, int]:
    """All numbers of a run, its recomputed substeps, and the worlds side by side."""
    allow(size)
    memory_share.cache_clear()
    problem, context = Problem(cell(design=design, frames=12, budget=Budget("substeps", 1800))), Context(3)
    solution = DiffPhysics(restarts=2).run(problem, context)
    milestones = [(step, score, params.tolist()) for step, score, params in context.milestones]
    rows = context.curve, milestones, solution.params.tolist(), finals_of(problem, solution, {})
    width = problem.solvers.most_worlds(12, problem.substeps_per_episode)
    return rows, problem.meter.recomputed, width


@pytest.mark.slow
@pytest.mark.usefixtures("_own_environment")
@pytest.mark.parametrize(("design", "little"), [("caterpillar", "600KB"), ("voxel", "2.2MB")])
def test_no_result_depends_on_the_memory(design: str, little: str) -> None:
    """Bit for bit: neither scores, gradients and what is charged, nor how far a budget in substeps goes."""
    (rows, again, width), (others, more, narrow) = (_outcome(size, design) for size in ("1GB", little))
    assert rows == others
    assert (again, narrow) == (0, 1)
    assert more > 0
    assert width > 2


@pytest.mark.usefixtures("_own_environment")
def test_a_size_that_was_allowed_is_that_of_processes_started_later() -> None:
    """By their environment, with their number; what cannot be read is refused and changes nothing."""
    allow("2GB")
    with pytest.raises(UsageError, match="'two'"):
        allow("two")
    assert os.environ[MEMORY_VARIABLE] == "2GB"
    share_among(3)
    assert os.environ[WORKERS_VARIABLE] == "3"


@pytest.mark.usefixtures("_own_environment")
def test_one_tape_at_a_time() -> None:
    """A batch of another width frees the tape of the last; without gradient it does not."""
    problem = Problem(cell())
    draws = [problem.initial(np.random.default_rng(seed)) for seed in range(2)]
    problem.loss_and_grad_batch(draws)
    problem.evaluate_batch(draws[:1])
    pair = problem.solvers.get(2, gradient=True)
    assert pair._tape is not None
    problem.loss_and_grad_batch(draws[:1])
    assert pair._tape is None


FORKS = """
import os, sys, time
block = bytearray(os.urandom(1 << 20)) * 100
pids = [os.fork() for _ in range(5)]
print("ready", flush=True)
time.sleep(60)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere shares are not told")
def test_what_forked_processes_share_counts_once() -> None:
    """Thirty-two processes of 100 MiB that are forked from one take hardly more than that one."""
    with subprocess.Popen([sys.executable, "-c", FORKS], stdout=subprocess.PIPE, process_group=0) as process:
        assert process.stdout is not None
        for _ in range(32):
            process.stdout.readline()
        used = memory_of(process.pid)
        os.killpg(process.pid, signal.SIGKILL)
    assert 100 << 20 < used < 300 << 20
