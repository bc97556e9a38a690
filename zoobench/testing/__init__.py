"""The requirements of every component, as checks for the tests of a package that adds one, as `zoobench new` writes it.

Each check simulates a few control frames at most and raises AssertionError with the fault.
"""

from zoobench.testing.component_checks import check_body, check_controller, check_documentation, check_units
from zoobench.testing.memory_context import MemoryContext
from zoobench.testing.simulated_checks import check_cell, check_method, check_rest
from zoobench.testing.small_cells import DOUBLE, WITH_OBJECT, small_cell

__all__ = [
    "DOUBLE",
    "WITH_OBJECT",
    "MemoryContext",
    "check_body",
    "check_cell",
    "check_controller",
    "check_documentation",
    "check_method",
    "check_rest",
    "check_units",
    "small_cell",
]
