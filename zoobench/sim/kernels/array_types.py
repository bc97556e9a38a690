"""Types of the tensors that kernels take."""

import taichi as ti

# `float` here gives only the shape of an element: Taichi takes the precision from the tensor that is passed.
Scalars = ti.types.ndarray()
Vectors = ti.types.ndarray(dtype=ti.types.vector(3, float))
Matrices = ti.types.ndarray(dtype=ti.types.matrix(3, 3, float))
Symmetric = ti.types.ndarray(dtype=ti.types.vector(6, float))
Pairs = ti.types.ndarray(dtype=ti.types.vector(2, float))
Nodes = ti.types.ndarray(dtype=ti.types.vector(4, float))
