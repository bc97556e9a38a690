"""zoobench: which body, which brain and which algorithm wins in which environment."""

from zoobench.rounding import unify

__version__ = "0.1.0"

unify()  # before any library is loaded that it is for
