"""An episode in a process of its own, with nothing compiled before: its bits, what it leaves, and its machine code."""

import hashlib
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.sim import scenes

_PROGRAM = """
import taichi as ti
started = ti.init
ti.init = lambda **settings: started(**settings | {"print_kernel_asm": True})
from tests.sim.test_another_process import fingerprint
print(fingerprint())
"""


def fingerprint() -> str:
    """Hash of trajectory and gradient of a float32 episode."""
    _, rollout, gradient = scenes.episode(scenes.ground_scene(), 6, scenes.fidelity(32))
    digest = hashlib.sha256()
    for array in (rollout.positions, rollout.velocities, *(getattr(gradient, name) for name in scenes.GROUPS)):
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


@pytest.fixture(scope="module")
def other(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    """The fingerprint that another process finds, and the folder of its cache and of the code that it prints."""
    folder = tmp_path_factory.mktemp("process")
    path = os.pathsep.join([str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")])
    environment = os.environ | {"ZOOBENCH_CACHE": str(folder), "PYTHONPATH": path}
    command = [sys.executable, "-c", _PROGRAM]
    done = subprocess.run(
        command, cwd=folder, env=environment, stdout=subprocess.PIPE, text=True, check=True, timeout=300
    )
    return done.stdout.split()[-1], folder


@pytest.mark.slow
def test_float32_episode_repeats_bit_for_bit(other: tuple[str, Path]) -> None:
    """Two runs in this process and one in another give the same bits in trajectory and gradient.

    The other keeps what it compiled, though it just ends: nobody has to stop the runtime.
    """
    first = fingerprint()
    assert fingerprint() == first
    found, folder = other
    assert found == first
    assert list((folder / "kernels").rglob("*.tic"))


@pytest.mark.slow
def test_no_product_is_fused_with_a_sum(other: tuple[str, Path]) -> None:
    """In the machine code of the substep and of its reverse: processors of different make give the same bits.

    A fused product is rounded once instead of twice, and not every processor has it.
    """
    code = "\n".join(path.read_text() for path in other[1].glob("*.s"))
    products = re.findall(r"^\s+(v?mulp[sd]|fmul|fmla)\b", code, re.MULTILINE)
    assert len(products) > 300, "the kernels were printed"
    assert not re.findall(r"^\s+(vfn?m(?:add|sub)\w*|fmla|fmadd)\b", code, re.MULTILINE)
