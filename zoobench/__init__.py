"""zoobench: a benchmark of bodies, controllers and methods for simulated soft robots."""

from typing import TYPE_CHECKING, Any

from zoobench.rounding import unify

if TYPE_CHECKING:
    from zoobench.api import evaluate, film, load, run

__version__ = "0.1.0"
__all__ = ["evaluate", "film", "load", "run"]

unify()  # before the libraries that it configures are loaded


def __getattr__(name: str) -> Any:
    """A name of `zoobench.api`, which is loaded at its first use."""
    if name not in __all__:
        raise AttributeError(f"module 'zoobench' has no attribute {name!r}")
    from zoobench import api

    return getattr(api, name)
