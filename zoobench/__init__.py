"""zoobench: a benchmark of bodies, controllers and methods for simulated soft robots."""

from pathlib import Path
from typing import TYPE_CHECKING

from zoobench.rounding import unify

if TYPE_CHECKING:
    from zoobench.db.frames import Frames

__version__ = "0.1.0"

unify()  # before the libraries that it configures are loaded


def load(location: "str | Path") -> "Frames":
    """The results in a database, a path or a PostgreSQL URL, as data frames: `load("zoobench.db").results()`.

    Raises:
        StorageError: there is no such database, or it cannot be read.
    """
    from zoobench.db.frames import Frames

    return Frames(location)
