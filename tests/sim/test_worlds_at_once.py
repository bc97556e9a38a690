"""Robots in their rest frame with a thread for each world, as on a GPU, on threads of the CPU."""

import subprocess
import sys

import pytest

_COMPARE = """
import sys
import numpy as np
import taichi as ti

usual = ti.init
ti.init = lambda **given: usual(**given | {"cpu_max_num_threads": 4})
from tests.sim import scenes, test_rest_frame, test_surface_water

make = test_surface_water._muscles if sys.argv[1] == "water" else test_rest_frame._terrain_scene
(_, serial, gradient), (_, threads, other) = (
    scenes.episode(make(), 4, test_rest_frame.LAGRANGIAN, worlds=8, parallel=parallel) for parallel in (False, True)
)
assert np.array_equal(threads.positions, serial.positions)
assert scenes.same(gradient, other)
"""


@pytest.mark.slow  # its kernels take ten seconds each
@pytest.mark.parametrize("scene", ["ground", "water"])
def test_worlds_at_once_are_those_in_turn(scene: str) -> None:
    """Paths and gradients are those of one thread for all, bit for bit."""
    done = subprocess.run([sys.executable, "-c", _COMPARE, scene], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
