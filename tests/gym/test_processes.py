"""Environments in other processes: they work there, or say why they cannot."""

import subprocess
import sys
from textwrap import dedent

import pytest

HEAD = """
import gymnasium, numpy, zoobench.gym
NAME, SMALL = "zoobench/Ground-Caterpillar-Turning-v0", {"fidelity": "smoke", "frames": 3}

def asynchronous(**kwargs):
    return gymnasium.make_vec(NAME, num_envs=2, vectorization_mode="async", vector_kwargs=kwargs, **SMALL)
"""


def _run(body: str) -> subprocess.CompletedProcess[str]:
    """A program of its own; one that hangs fails."""
    program = HEAD + "\nif __name__ == '__main__':\n" + "\n".join("    " + line for line in dedent(body).splitlines())
    return subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=100, check=False)


def test_asynchronous_environments_work_in_a_fork() -> None:
    """Nothing is simulated before: to make environments starts nothing that a fork would lack."""
    done = _run("""
        envs = asynchronous(context="fork")
        envs.reset(seed=0)
        for _ in range(3):
            _, rewards, _, truncated, info = envs.step(numpy.zeros(envs.action_space.shape, numpy.float32))
        print(truncated.all(), info["score"].shape)
        envs.close()
    """)
    assert (done.returncode, done.stdout) == (0, "True (2,)\n"), done.stderr


@pytest.mark.parametrize("context", ["fork", "forkserver"])
def test_after_a_simulation_they_work_or_are_refused(context: str) -> None:
    """A fork lacks the threads of the simulator and says so; a process of its own has them."""
    done = _run(f"""
        gymnasium.make(NAME, **SMALL).reset()
        envs = asynchronous(context="{context}")
        print(envs.reset(seed=0)[0].shape[0])
        envs.close()
    """)
    if context == "fork":
        assert "forkserver" in done.stderr.splitlines()[-1]
        assert done.returncode
    else:
        assert (done.returncode, done.stdout) == (0, "2\n"), done.stderr
