"""Cells of smoke size for any registered component, and a small ocean."""

from zoobench.testing import small_cell as cell

__all__ = ["POND", "cell"]

POND = "ocean[depth=0.09375,length=0.1875,width=0.125,bulk_modulus=20000]"
"""The ocean in little, and soft, so that its steps are long: whatever swims in it is at rest in a fraction of the
time."""
