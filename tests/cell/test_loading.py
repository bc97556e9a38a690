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


def test_a_gradient_loads_no_symbolic_algebra() -> None:
    """As torch does to compare the shapes of outputs and weights, in half a second."""
    program = """
import sys
import torch
import numpy as np
from zoobench.cell.robot import Built
row = torch.tensor([[1.0, 2.0]], requires_grad=True)
activity = (row[0] * torch.tensor([[3.0, 4.0], [5.0, 6.0]]))[:, None]
built = Built(row, activity, None, {"occupancy": row**2}, {})
found = built.gradient({"activity": np.array([[1.0, 0.5], [0.25, 2.0]], np.float32), "occupancy": np.array([1.0, 3.0])})
assert found.tolist() == [3.0 + 1.25 + 2.0, 2.0 + 12.0 + 12.0], found
assert "sympy" not in sys.modules
"""
    subprocess.run([sys.executable, "-c", program], cwd=Path(__file__).parents[2], check=True, timeout=120)
