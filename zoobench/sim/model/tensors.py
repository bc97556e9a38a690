"""Memory of tensors, on the CPU and on a GPU."""

import math
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from zoobench.arrays import Array
from zoobench.errors import UsageError

ALIGNMENT = 64  # [bytes], of the widest registers

LARGEST_ARRAY = 2**31 - 1
"""Numbers in an array that every kernel can address: beyond, those without `runtime.vector_lanes` write elsewhere."""


def lazy_zeros(shape: tuple[int, ...], kind: torch.dtype, device: str) -> Tensor:
    """Zeros that on the CPU take no memory before they are touched, aligned for vector registers.

    NumPy's large arrays come from the system unread, as torch's do not.

    Raises:
        UsageError: more than `LARGEST_ARRAY` numbers.
    """
    if (count := math.prod(shape)) > LARGEST_ARRAY:
        raise UsageError(
            f"An array of the simulation would hold {count} numbers, {' x '.join(map(str, shape))}; kernels "
            f"can address {LARGEST_ARRAY}. Use fewer worlds or particles, or a coarser fidelity."
        )
    if device != "cpu":
        return torch.zeros(shape, dtype=kind, device=device)
    number = np.dtype(str(kind).removeprefix("torch."))
    room = np.zeros(count + ALIGNMENT // number.itemsize, number)
    skipped = -room.ctypes.data % ALIGNMENT // number.itemsize
    return torch.from_numpy(room[skipped : skipped + count].reshape(shape))


def memory(tensor: Tensor) -> Any:
    """The memory of a tensor, to be read and written in place: on the CPU an array, else the tensor itself.

    A call of torch costs more than a few hundred numbers do, and several times one of NumPy.
    """
    return tensor.numpy() if tensor.is_cpu else tensor


def put(target: Tensor, value: Array) -> None:
    """Write an array into a tensor."""
    if target.is_cpu:
        target.numpy()[...] = value
    else:
        target[:] = torch.as_tensor(np.ascontiguousarray(value), dtype=target.dtype, device=target.device)


def fetch(target: NDArray[np.floating], source: Tensor) -> None:
    """Write a tensor into an array, packed where it is: a host that unpacks what a GPU's kernels hold of many worlds
    takes as long as a frame's substeps."""
    into = torch.from_numpy(target)
    into.copy_(source.to(into.dtype).contiguous())
