"""The libraries of a process that simulates."""

import subprocess
import sys
from pathlib import Path

import pytest

LOADED = """
import gc, sys
from zoobench.cell.loading import load_simulator
assert not {"taichi", "torch"} & set(sys.modules)
load_simulator()
assert {"taichi", "torch", "zoobench.sim.solver"} <= set(sys.modules)
assert gc.isenabled()
assert gc.get_freeze_count() > 100_000
assert len(gc.get_objects()) < 10_000
"""

GRADIENT = """
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

METHODS = """
from tests.methods.toy import Context, Quadratic
from zoobench.methods.cmaes import CmaEs
from zoobench.methods.diffphysics import DiffPhysics
from zoobench.spec import Budget
DiffPhysics(iterations=2).run(Quadratic(Budget("substeps", 1e9)), Context())
assert "torch._dynamo" not in sys.modules
CmaEs().run(Quadratic(Budget("episodes", 20)), Context())
assert "cma" in sys.modules
assert not {"matplotlib", "scipy.stats"} & set(sys.modules)
from scipy.stats import chi2
"""


@pytest.mark.slow
def test_a_run_loads_what_it_needs() -> None:
    """The simulator, hidden from the garbage collector, which is at work afterwards as before, on what the run makes.

    Not: symbolic algebra, which torch takes to compare the shapes of outputs and weights, in half a second; torch's
    compiler, as `torch.optim` does at its first use, for as long as a short run takes; plots and statistics, which cma
    takes where they are there, in more than a second; whoever asks for those later has them.
    """
    program = LOADED + GRADIENT + METHODS
    subprocess.run([sys.executable, "-c", program], cwd=Path(__file__).parents[2], check=True, timeout=120)
