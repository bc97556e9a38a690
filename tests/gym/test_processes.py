"""Environments in other processes: they work there, or say why they cannot."""

import subprocess
from collections.abc import Callable
from pathlib import Path
from textwrap import dedent

import pytest

from tests import programs

HEAD = """
import gymnasium, numpy, zoobench.gym
NAME, SMALL = "zoobench/Ground-Caterpillar-Turning-v0", {"fidelity": "smoke", "frames": 3}

def asynchronous(count, **kwargs):
    return gymnasium.make_vec(NAME, num_envs=count, vectorization_mode="async", vector_kwargs=kwargs, **SMALL)
"""

Run = Callable[[str], subprocess.CompletedProcess[str]]


@pytest.fixture
def run(tmp_path: Path) -> Run:
    """A program of its own, in which nothing was simulated; one that hangs fails."""

    def run(body: str) -> subprocess.CompletedProcess[str]:
        lines = ["    " + line for line in dedent(body).splitlines()]
        (tmp_path / "program.py").write_text("\n".join([HEAD, "if __name__ == '__main__':", *lines]))
        return programs.run("program.py", cwd=tmp_path, timeout=100.0)

    return run


@pytest.mark.slow
def test_after_a_simulation_they_work_in_a_process_of_their_own(run: Run) -> None:
    """It has the threads of the simulator."""
    done = run("""
        gymnasium.make(NAME, **SMALL).reset()
        envs = asynchronous(1, context="forkserver")
        print(envs.reset(seed=0)[0].shape[0], flush=True)
        envs.close()
    """)
    assert (done.returncode, done.stdout) == (0, "1\n"), done.stderr


@pytest.mark.slow
def test_in_a_fork_they_work_or_are_refused(run: Run) -> None:
    """Making environments starts nothing that a fork would lack; after a simulation it lacks threads, and says so."""
    done = run("""
        envs = asynchronous(1, context="fork")
        envs.reset(seed=0)
        for _ in range(3):
            _, rewards, _, truncated, info = envs.step(numpy.zeros(envs.action_space.shape, numpy.float32))
        print(truncated.all(), info["score"].shape, flush=True)
        envs.close()
        gymnasium.make(NAME, **SMALL).reset()
        asynchronous(1, context="fork").reset(seed=0)
    """)
    assert done.stdout == "True (1,)\n", done.stderr
    assert "forkserver" in done.stderr.splitlines()[-1]
    assert done.returncode
