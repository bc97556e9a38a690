"""Arrays of four lanes as kernels take them, and what of a scene the kernels' functions ask for."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import taichi as ti
import torch

from zoobench.arrays import Array
from zoobench.sim import runtime
from zoobench.sim.kernels.boundary import PLANE
from zoobench.sim.kernels.laws.water import LAW
from zoobench.sim.kernels.layout import CONSTANTS, Variant
from zoobench.sim.kernels.splines import QUADRATIC
from zoobench.sim.kernels.transfer import APIC


@contextmanager
def compiled(*, vectors: bool = True) -> Iterator[None]:
    """Kernels first called within are compiled to vectors, or to scalars as those for many threads are."""
    if vectors:
        with runtime.vector_lanes():
            yield
    else:
        yield


def tensors(precision: int, *arrays: Array) -> list[torch.Tensor]:
    """The arrays in the precision, with the runtime made ready for it."""
    runtime.start(precision)
    return [torch.as_tensor(np.ascontiguousarray(a)).to(runtime.real(precision)).clone() for a in arrays]


def four(a: Array, last: float = 0.0) -> Array:
    """Vectors `[..., 3]` in four lanes."""
    return np.concatenate([a, np.full((*a.shape[:-1], 1), last)], axis=-1)


def columns(a: Array) -> Array:
    """Matrices `[n, 3, 3]` as rows of a particle, `[1, 1, n, 3, 4]`."""
    return four(np.swapaxes(a, -1, -2))[None, None]


def matrices(rows: torch.Tensor) -> Array:
    """The matrices in the rows of `columns`, after a check of their fourth lanes."""
    assert not rows[..., 3].any()
    found: Array = np.swapaxes(rows[0, 0, ..., :3].double().numpy(), -1, -2)
    return found


def constants(nodes: int, spacing: float = 1.0, density: float = 1.0) -> Array:
    """Those of a cubic grid, with water of a density."""
    given = {"spacing": spacing, "density": density, "nodes_x": nodes, "nodes_y": nodes, "nodes_z": nodes}
    return np.array([given.get(name, 0.0) for name in (*CONSTANTS, *LAW.constants)], dtype=float)


def variant(**changes: Any) -> Variant:
    """What a kernel is compiled for: a robot alone on level ground, with these changes."""
    given: dict[str, Any] = {
        "muscle": False, "damping": False, "law": None, "ground": PLANE, "skin": False, "width": QUADRATIC,
        "transfer": APIC, "medium_transfer": APIC, "sleep": False, "two_fields": False, "fbar": False,
    }  # fmt: skip
    return Variant(**given | changes)


def grid(fields: int, nodes: int, field: int, values: Array) -> Array:
    """A grid `[fields, nodes^3, 4]` with the values `[nodes, nodes, nodes, 4]` in one field and zeros in the others."""
    found = np.zeros((fields, nodes**3, 4))
    found[field] = values.reshape(-1, 4)
    return found


@ti.func
def arena(scene: ti.template()):  # noqa: ANN201  (typed by the kernel compiler)
    """The box of all nodes."""
    sy = scene.nodes_z
    sx = scene.nodes_y * sy
    return ti.Struct(sx=sx, sy=sy, origin=0, size=scene.nodes_x * sx)


def rounded(precision: int, *arrays: Array) -> list[Array]:
    """The arrays in double precision, with values that the precision holds exactly."""
    return [a.astype(np.float64 if precision == 64 else np.float32).astype(float) for a in arrays]


def symmetric(a: Array) -> Array:
    """Its symmetric part."""
    part: Array = 0.5 * (a + np.swapaxes(a, -1, -2))
    return part


def relative(found: Array, expected: Array, scale: float | Array) -> float:
    """Largest error of a tensor relative to its norm, or to the law's own scale where that is larger."""
    axes = tuple(range(1, expected.ndim))
    size = np.maximum(np.sqrt(np.square(expected).sum(axes)), scale)
    return float((np.abs(found - expected).max(axes) / size).max())
