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


def test_after_a_simulation_they_work_or_are_refused(run: Run) -> None:
    """A process of its own has the threads of the simulator; a fork lacks them and says so."""
    done = run("""
        gymnasium.make(NAME, **SMALL).reset()
        for context in ("forkserver", "fork"):
            envs = asynchronous(1, context=context)
            print(envs.reset(seed=0)[0].shape[0], flush=True)
            envs.close()
    """)
    assert done.stdout == "1\n", done.stderr
    assert "forkserver" in done.stderr.splitlines()[-1]
    assert done.returncode


def test_asynchronous_environments_work_in_a_fork(run: Run) -> None:
    """Nothing is simulated before: to make environments starts nothing that a fork would lack."""
    done = run("""
        envs = asynchronous(2, context="fork")
        envs.reset(seed=0)
        for _ in range(3):
            _, rewards, _, truncated, info = envs.step(numpy.zeros(envs.action_space.shape, numpy.float32))
        print(truncated.all(), info["score"].shape)
        envs.close()
    """)
    assert (done.returncode, done.stdout) == (0, "True (2,)\n"), done.stderr
