"""Figures of computed curves with their references, drawn as PNG files."""

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from zoobench.arrays import Array
from zoobench.render import figures

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLOURS = ("#0b62a4", "#c8501e", "#2b8a3e", "#7a3e9d", "#946b00", "#0aa5b5", "#d6337c", "#6b6b6b")
_FEW = 8  # lines of at most so many points have markers
_SIZE = (7.0, 5.2)  # [inches]


Role = Literal["computed", "reference", "band"]


@dataclass(frozen=True)
class PlottedCurve:
    """One line of a figure.

    Attributes:
        x, y: `[point_count]` in the units of the figure's axes.
        points: draw single points, as for measurements.
        upper: `[point_count]` upper edge where `y` is the lower edge of a band of references.
    """

    label: str
    role: Role
    x: Array
    y: Array
    points: bool = False
    upper: Array | None = None


@dataclass
class Figure:
    """A plot of curves.

    Attributes:
        x_label, y_label: with units.
        log: names of the logarithmic axes: `x`, `y` or `xy`.
    """

    title: str
    x_label: str
    y_label: str
    log: str = ""
    curves: list[PlottedCurve] = field(default_factory=list)

    def computed(self, label: str, x: ArrayLike, y: ArrayLike, *, points: bool = False) -> None:
        """Add a result of the simulator."""
        self.curves.append(PlottedCurve(label, "computed", np.asarray(x, float), np.asarray(y, float), points))

    def reference(self, label: str, x: ArrayLike, y: ArrayLike, *, points: bool = False) -> None:
        """Add a closed form, a bound or a measurement."""
        self.curves.append(PlottedCurve(label, "reference", np.asarray(x, float), np.asarray(y, float), points))

    def level(self, label: str, x: ArrayLike, value: float) -> None:
        """Add a reference that is constant from the first to the last of `x`."""
        self.reference(label, np.asarray(x)[[0, -1]], np.full(2, value))

    def band(self, label: str, x: ArrayLike, low: float, high: float) -> None:
        """Add a constant interval of references from the first to the last of `x`."""
        ends = np.asarray(x, float)[[0, -1]]
        self.curves.append(PlottedCurve(label, "band", ends, np.full(2, low), upper=np.full(2, high)))


def draw(figure: Figure, path: Path) -> None:
    """Write a figure to a PNG file.

    Raises:
        UsageError: matplotlib is missing, or the file cannot be written.
    """
    canvas = figures.blank(_SIZE)
    axes = canvas.add_subplot()
    counts: Counter[Role] = Counter()
    for line in figure.curves:
        _draw_curve(axes, line, counts[line.role])
        counts[line.role] += 1
    axes.set(title=figure.title, xlabel=figure.x_label, ylabel=figure.y_label)
    axes.set(**{f"{axis}scale": "log" for axis in figure.log})
    axes.grid(alpha=0.3)
    canvas.legend(loc="outside lower center", ncols=2, fontsize=9)
    figures.save(canvas, path)


def _draw_curve(axes: "Axes", line: PlottedCurve, number: int) -> None:
    """Draw computed curves solid or as rings, references dashed or as crosses; a number of either has one colour.

    Rings grow with the number, so that coinciding ones remain visible.
    """
    colour = _COLOURS[number % len(_COLOURS)]
    if line.upper is not None:
        axes.fill_between(line.x, line.y, line.upper, color=colour, alpha=0.15, label=line.label, linewidth=0)
    elif line.role == "reference":
        style = {"linestyle": "none", "marker": "x", "markersize": 7} if line.points else {"linestyle": "--"}
        axes.plot(line.x, line.y, color="black" if line.points else colour, linewidth=1.2, label=line.label, **style)
    else:
        ring = {"linestyle": "none", "marker": "o", "markersize": 4 + 2 * number, "markerfacecolor": "none"}
        solid = {"linestyle": "-", "marker": "." if len(line.x) <= _FEW else ""}
        style = ring if line.points else solid
        axes.plot(line.x, line.y, color=colour, linewidth=1.6, label=line.label, **style)
