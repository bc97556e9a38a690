"""Memory of tensors: what kernels can reach, and what is copied to the host."""

import numpy as np
import pytest
import taichi as ti
import torch

from zoobench.errors import UsageError
from zoobench.sim import runtime
from zoobench.sim.kernels.array_types import Rows
from zoobench.sim.model.state import Matter
from zoobench.sim.model.tensors import LARGEST_ARRAY, fetch, lazy_zeros


def test_arrays_beyond_the_reach_of_kernels_are_refused() -> None:
    """With their size and what to do; those just within are made, and take no memory."""
    assert lazy_zeros((2**29 - 1, 4), torch.float32, "cpu").shape == (2**29 - 1, 4)
    with pytest.raises(UsageError, match=r"2147483648 numbers, 536870912 x 4; .* Use fewer worlds"):
        lazy_zeros((2**29, 4), torch.float32, "cpu")
    with pytest.raises(UsageError, match="kernels can address 2147483647"):
        Matter.zeros(10**6, 1, 70, 0, False, torch.float32, "cpu")


@ti.kernel
def add_to_last(a: Rows):  # noqa: ANN201  (typed by the kernel compiler)
    """Add to the last row."""
    ti.loop_config(serialize=True)
    for _ in range(1):
        a[a.shape[0] - 1] += ti.Vector([1.0, 2.0, 3.0, 4.0])


def test_kernels_reach_the_end_of_the_largest_array() -> None:
    """Compiled with scalars too, whose indices are 32 bits wide."""
    runtime.start(32)
    rows = lazy_zeros((LARGEST_ARRAY // 4, 4), torch.float32, "cpu")
    add_to_last(rows)
    assert rows[-1].tolist() == [1.0, 2.0, 3.0, 4.0]


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_a_tensor_is_fetched_into_an_array_of_another_type(kind: type[np.floating]) -> None:
    """Part of its rows, rounded once."""
    rows = torch.arange(24, dtype=torch.float64).reshape(2, 3, 4) / 7
    target = np.full((2, 3, 3), np.nan, kind)
    fetch(target, rows[:, :, :3])
    assert np.array_equal(target, rows.numpy()[:, :, :3].astype(kind))
