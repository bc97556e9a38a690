"""The libraries of a process that simulates."""

import subprocess
import sys
from pathlib import Path


def test_the_simulator_is_loaded_and_hidden_from_the_garbage_collector() -> None:
    """Which is at work afterwards as before, on what the run makes."""
    program = """
import gc, sys
from zoobench.cell.loading import load_simulator
assert not {"taichi", "torch"} & set(sys.modules)
load_simulator()
assert {"taichi", "torch", "zoobench.sim.solver"} <= set(sys.modules)
assert gc.isenabled()
assert gc.get_freeze_count() > 100_000
assert len(gc.get_objects()) < 10_000
"""
    subprocess.run([sys.executable, "-c", program], cwd=Path(__file__).parents[2], check=True, timeout=120)
