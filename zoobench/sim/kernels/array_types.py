"""Types of the tensors that kernels take."""

import taichi as ti

# `float` here gives only the shape of an element: Taichi takes the precision from the tensor that is passed.
Scalars = ti.types.ndarray()
Rows = ti.types.ndarray(dtype=ti.types.vector(4, float))

Wide = ti.types.ndarray(dtype=ti.types.vector(8, float))
"""Rows of eight lanes."""
