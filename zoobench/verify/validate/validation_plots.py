"""Figures of validation cases as PNG files: what was computed beside what it is judged by."""

from pathlib import Path
from typing import TYPE_CHECKING

from zoobench.render import figures
from zoobench.verify.validate.base import Curve, Figure, Role

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLOURS = ("#0b62a4", "#c8501e", "#2b8a3e", "#7a3e9d", "#946b00", "#0aa5b5", "#d6337c", "#6b6b6b")
_FEW = 8  # points of a line that are marked, so that one sees which there are
_SIZE = (7.0, 5.2)  # [inches]


def draw(figure: Figure, path: Path) -> None:
    """Write a figure to a PNG file.

    Raises:
        UsageError: matplotlib is missing, or the file cannot be written.
    """
    canvas = figures.blank(_SIZE)
    axes = canvas.add_subplot()
    colours: dict[Role, int] = {}
    for line in figure.curves:
        number = colours.get(line.role, 0)
        colours[line.role] = number + 1
        _draw_curve(axes, line, number)
    axes.set(title=figure.title, xlabel=figure.x_label, ylabel=figure.y_label)
    if figure.log_x:
        axes.set_xscale("log")
    if figure.log_y:
        axes.set_yscale("log")
    axes.grid(alpha=0.3)
    canvas.legend(loc="outside lower center", ncols=2, fontsize=9)
    figures.save(canvas, path)


def _draw_curve(axes: "Axes", line: Curve, number: int) -> None:
    """What was computed is solid or dots, references are dashed or crosses; the pair of a number has one colour.

    Dots are rings that grow with the number, so that those on top of each other are all seen.
    """
    colour = _COLOURS[number % len(_COLOURS)]
    if line.upper is not None:
        axes.fill_between(line.x, line.y, line.upper, color=colour, alpha=0.15, label=line.label, linewidth=0)
    elif line.role is Role.REFERENCE:
        style = {"linestyle": "none", "marker": "x", "markersize": 7} if line.points else {"linestyle": "--"}
        axes.plot(line.x, line.y, color="black" if line.points else colour, linewidth=1.2, label=line.label, **style)
    else:
        ring = {"linestyle": "none", "marker": "o", "markersize": 4 + 2 * number, "markerfacecolor": "none"}
        solid = {"linestyle": "-", "marker": "." if len(line.x) <= _FEW else ""}
        style = ring if line.points else solid
        axes.plot(line.x, line.y, color=colour, linewidth=1.6, label=line.label, **style)
