"""Environments in other processes: they work there, or say why they cannot."""

import subprocess
import sys
from textwrap import dedent

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


def test_after_a_simulation_they_work_or_are_refused() -> None:
    """A process of its own has the threads of the simulator; a fork lacks them and says so."""
    done = _run("""
        gymnasium.make(NAME, **SMALL).reset()
        for context in ("forkserver", "fork"):
            envs = asynchronous(context=context)
            print(envs.reset(seed=0)[0].shape[0], flush=True)
            envs.close()
    """)
    assert done.stdout == "2\n", done.stderr
    assert "forkserver" in done.stderr.splitlines()[-1]
    assert done.returncode
