"""The parts of a body that a design space optimises: geometry, stiffness and muscles, in this order."""

from collections.abc import Sequence
from typing import Literal

Optimised = Literal[
    "geometry+stiffness+muscles",
    "geometry+stiffness",
    "geometry+muscles",
    "stiffness+muscles",
    "geometry",
    "stiffness",
    "muscles",
]
"""Annotation of a parameter that names the parts. Parameter vectors hold these and nothing of the others."""

EVERYTHING: Optimised = "geometry+stiffness+muscles"


def parts_of(optimised: Optimised) -> tuple[str, ...]:
    """The names of the parts."""
    return tuple(optimised.split("+"))


def columns_of(optimised: Optimised, muscle_count: int) -> list[int]:
    """The columns that are optimised of rows with occupancy, stiffness and so many muscles."""
    every: dict[str, Sequence[int]] = {"geometry": [0], "stiffness": [1], "muscles": range(2, 2 + muscle_count)}
    return [column for part in parts_of(optimised) for column in every[part]]
