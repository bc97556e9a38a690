"""Cells of smoke size for any registered component, and a small ocean and shallow water."""

from zoobench.testing import small_cell as cell

__all__ = ["POND", "SEA", "TANK", "cell"]

POND = "ocean[water=grid,depth=0.09375,length=0.1875,width=0.125,bulk_modulus=20000]"
"""The ocean in little, and soft, so that its steps are long: whatever swims in it is at rest in a fraction of the
time."""

SEA = "ocean"
"""Water by forces on the surface, which is as large for every body."""

TANK = "shallow-water[length=0.3125,width=0.1875]"
"""A quarter of the shallow water: scores would feel its walls, gradients and bodies at rest do not."""
