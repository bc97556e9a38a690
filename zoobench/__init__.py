"""zoobench: a benchmark of bodies, controllers and methods for simulated soft robots."""

from zoobench.rounding import unify

__version__ = "0.1.0"

unify()  # before the libraries that it configures are loaded
