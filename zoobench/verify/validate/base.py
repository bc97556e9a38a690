"""What a validation case is: a function that measures, with the bounds on what it measures and the source of both."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike

from zoobench.arrays import Array


class Role(StrEnum):
    """How a curve is drawn: what the simulator gave, or what it is judged against."""

    COMPUTED = "computed"
    REFERENCE = "reference"
    BAND = "band"


@dataclass(frozen=True)
class Curve:
    """One line of a figure.

    Attributes:
        x, y: `[point_count]` in the units of the figure's axes.
        upper: `[point_count]` upper edge where `y` is the lower edge of a band of references.
        points: draw single points, as for measurements.
    """

    label: str
    role: Role
    x: Array
    y: Array
    upper: Array | None = None
    points: bool = False


@dataclass(frozen=True)
class Figure:
    """A plot: curves over labelled axes; the labels hold the units."""

    title: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    log_x: bool = False
    log_y: bool = False


@dataclass(frozen=True)
class Check:
    """One measured number and the closed interval that it must lie in.

    Attributes:
        measure: what was measured.
        unit: of value and bounds; `-` for a pure number.
        at_least, at_most: None where there is no bound on that side.
    """

    measure: str
    value: float
    unit: str = "-"
    at_least: float | None = None
    at_most: float | None = None

    def __post_init__(self) -> None:
        if self.at_least is None and self.at_most is None:
            raise ValueError(f"The check {self.measure!r} has no bound.")

    @property
    def is_met(self) -> bool:
        """Finite and within the bounds."""
        low = -math.inf if self.at_least is None else self.at_least
        high = math.inf if self.at_most is None else self.at_most
        return bool(math.isfinite(self.value) and low <= self.value <= high)

    @property
    def bound(self) -> str:
        """The bounds as text."""
        if self.at_least is None:
            return f"<= {self.at_most:.4g}"
        if self.at_most is None:
            return f">= {self.at_least:.4g}"
        return f"{self.at_least:.4g} to {self.at_most:.4g}"


@dataclass(frozen=True)
class Outcome:
    """What a case found: its checks, and one figure of the curves beside the reference."""

    checks: tuple[Check, ...]
    figure: Figure
    seconds: float = 0.0

    @property
    def is_met(self) -> bool:
        """All checks are."""
        return all(check.is_met for check in self.checks)


@dataclass(frozen=True)
class Case:
    """One validation case.

    Attributes:
        name: kebab-case.
        source: the paper or the closed form that it is judged by.
        grid: its resolution, in words.
        precision: 32 or 64 bits; 0 where it compares both.
        is_fast: done in a few seconds.
        measure: does the work.
    """

    name: str
    source: str
    grid: str
    measure: Callable[[], Outcome]
    precision: int = 64
    is_fast: bool = True

    @property
    def precision_text(self) -> str:
        """The precision as a person writes it."""
        return f"float{self.precision}" if self.precision else "both"

    def run(self) -> Outcome:
        """Measure, with the time that it took [s], that of compiling included."""
        begin = time.perf_counter()
        outcome = self.measure()
        return replace(outcome, seconds=time.perf_counter() - begin)


def curve(label: str, role: Role, x: ArrayLike, y: ArrayLike, *, points: bool = False) -> Curve:
    """A curve of anything that can be made an array."""
    return Curve(label, role, np.asarray(x, float), np.asarray(y, float), points=points)


def order_of_accuracy(spacings: Array, errors: Array) -> float:
    """Slope of the line through log error over log spacing, fitted by least squares: the observed order."""
    return float(np.polyfit(np.log(spacings), np.log(np.abs(errors)), 1)[0])
