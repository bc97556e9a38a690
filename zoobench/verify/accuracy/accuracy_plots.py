"""Work-precision plots of every environment, with the Pareto front marked, and a plot of all energy balances."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from zoobench.errors import UsageError
from zoobench.render import figures
from zoobench.verify.accuracy.analyse import Analysis, LevelRow, ReferenceRow
from zoobench.verify.accuracy.verdicts import EnergyRow, pareto

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SIZE = (4.6, 4.8)  # [inches], of one panel
_BOTTOM = 1e-9  # lower end of the hatched area
_LADDER, _KNOB, _NOISE = "#0b62a4", "#8a8a8a", "#c8501e"
_ENERGY_PARTS = {
    "back": ("taken back by muscles", "#b9c6d3"),
    "stored": ("stored", "#0b62a4"),
    "viscous": ("viscosity", "#2b8a3e"),
    "plastic": ("yield of the medium", "#946b00"),
    "contact": ("ground and walls", "#7a3e9d"),
    "unexplained": ("unexplained", "#c8501e"),
}
_ENERGY_WIDTH, _ENERGY_ROW, _ENERGY_HEAD = 5.6, 0.2, 0.85  # [inches], of a panel, a bar in it, its title with axis
_ENERGY_COLUMNS = 2


def draw(analysis: Analysis, folder: Path, *, default: str) -> list[Path]:
    """One PNG for each environment, `accuracy-ENV.png`; the paths written.

    A panel for the score of every task, and one for the gradient. `default` names the level to mark.

    Raises:
        UsageError: there are no measurements, matplotlib is missing, or a file cannot be written.
    """
    envs = list(dict.fromkeys(reference.env for reference in analysis.references))
    if not envs:
        raise UsageError("There are no measurements to draw. Use `zoobench accuracy run` first.")
    paths = []
    for env in envs:
        references = [row for row in analysis.references if row.env == env]
        canvas = figures.blank(((len(references) + 1) * _SIZE[0], _SIZE[1]), dpi=100)
        panels = canvas.subplots(1, len(references) + 1)
        for panel, reference in zip(panels, references, strict=False):
            _scores(panel, reference, analysis, default)
        _gradients(panels[-1], env, analysis, default)
        _legend(canvas, panels)
        canvas.suptitle(f"{env}: accuracy and cost")
        path = folder / f"accuracy-{env}.png"
        figures.save(canvas, path)
        paths.append(path)
    return paths


def _scores(axes: "Axes", reference: ReferenceRow, analysis: Analysis, default: str) -> None:
    """Error of the score against wall time: levels as a line, knobs as crosses, the front bold, noise hatched."""
    ladder = _of(analysis.levels, reference)
    knobs = _of(analysis.knobs, reference)
    axes.set(xscale="log", yscale="log", title=reference.task)
    axes.set(xlabel="wall time per simulated second [s]", ylabel="error of the score [share]")
    _points(axes, ladder, knobs, "error", "seconds", default)
    front = pareto([*ladder, *knobs])
    axes.plot(_column(front, "seconds"), _column(front, "error"), color="black", linewidth=3, alpha=0.25,
              label="cheapest for its error")  # fmt: skip
    if reference.floor:
        axes.fill_between([0, 1], _BOTTOM, reference.floor, hatch="///", alpha=0.12, color=_NOISE,
                          transform=axes.get_yaxis_transform(), label="below the noise floor")  # fmt: skip
    if reference.unknown:
        axes.axhline(reference.unknown, color=_NOISE, linestyle="--", linewidth=1, label="uncertainty of the reference")
    shown = [row.error for row in (*ladder, *knobs) if row.error]
    shown += [value for value in (reference.floor, reference.unknown) if value]
    if shown:
        axes.set_ylim(min(shown) / 2, max(shown) * 2)
    _finish(axes)


def _gradients(axes: "Axes", env: str, analysis: Analysis, default: str) -> None:
    """1 - cosine of the gradient against wall time with gradient."""
    rows = [row for row in analysis.levels if row.env == env and row.angle and row.gradient_seconds]
    knobs = [row for row in analysis.knobs if row.env == env and row.angle and row.gradient_seconds]
    axes.set(xscale="log", yscale="log", title="gradient")
    axes.set(xlabel="wall time per simulated second, with gradient [s]", ylabel="1 - cosine to the finest level")
    _points(axes, rows, knobs, "angle", "gradient_seconds", default)
    _finish(axes)


def _finish(axes: "Axes") -> None:
    """Add a grid, plain numbers, and room for the names beside the last points."""
    from matplotlib.ticker import FuncFormatter, LogLocator

    axes.grid(alpha=0.3, which="both")
    axes.margins(x=0.15)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(FuncFormatter(lambda value, _: ""))


def _legend(canvas: "Figure", panels: "Iterable[Axes]") -> None:
    """One legend below all panels, every entry once."""
    known: dict[str, Any] = {}
    for panel in panels:
        handles, names = panel.get_legend_handles_labels()
        known.update(zip(names, handles, strict=True))
    canvas.legend(handles=list(known.values()), labels=list(known), loc="outside lower center", ncols=6, fontsize=8)


def _points(
    axes: "Axes", levels: Sequence[LevelRow], knobs: Sequence[LevelRow], error: str, seconds: str, default: str
) -> None:
    """Draw levels joined by a line, the default one ringed, and knobs as crosses, each with its name."""
    for rows, style, colour, size, legend in (
        (levels, "o-", _LADDER, 9, "levels"),
        (knobs, "x", _KNOB, 6, "one knob turned"),
    ):
        axes.plot(_column(rows, seconds), _column(rows, error), style, color=colour, label=legend)
        for row in rows:
            place = (getattr(row, seconds), getattr(row, error))
            axes.annotate(_short(row), place, color=colour, fontsize=size, xytext=(4, 4), textcoords="offset points")
            if row.fidelity == default and rows is levels:
                axes.plot(*place, "o", markersize=14, markerfacecolor="none", color=colour, label="default")


def _short(row: LevelRow) -> str:
    """A level's name, or a short name of the turned knob: `aflip`, `27 per cell`."""
    turned = (row.env if "[" in row.env else row.fidelity).partition("[")[2].rstrip("]")
    knob, _, value = turned.partition("=")
    if not knob:
        return row.fidelity
    if knob == "bulk_modulus":
        return f"K {float(value):.2g} Pa"
    words = {"particles_per_cell": f"{value} per cell", "courant": f"courant {value}", "precision": f"float{value}"}
    return words.get(knob, value)


def _column(rows: Sequence[LevelRow], name: str) -> list[float]:
    return [float(getattr(row, name)) for row in rows]


def _of(rows: Sequence[LevelRow], reference: ReferenceRow) -> list[LevelRow]:
    """Rows of the reference's environment and task that have an error and a time and fit on logarithmic axes."""
    place = (reference.env, reference.task)
    return [row for row in rows if (row.env.partition("[")[0], row.task) == place and row.error and row.seconds]


def draw_energy(rows: Sequence[EnergyRow], folder: Path) -> Path:
    """One PNG of all energy balances: a panel for each environment, a bar for each fidelity; its path.

    Raises:
        UsageError: there are no balances, matplotlib is missing, or the file cannot be written.
    """
    panels: dict[str, list[EnergyRow]] = {}
    for row in rows:
        panels.setdefault(row.env.partition("[")[0], []).append(row)
    if not panels:
        raise UsageError("There are no energy balances to draw. Use `zoobench accuracy run` first.")
    columns = min(_ENERGY_COLUMNS, len(panels))
    lines, most = -(-len(panels) // columns), max(map(len, panels.values()))
    figure = figures.blank((columns * _ENERGY_WIDTH, lines * (_ENERGY_HEAD + most * _ENERGY_ROW) + 0.5), dpi=100)
    for number, (env, own) in enumerate(panels.items()):
        axes = figure.add_subplot(lines, columns, number + 1)
        names = [row.fidelity if row.env == env else f"{row.fidelity} {row.env}" for row in own]
        left = np.zeros(len(own))
        for part, (label, colour) in _ENERGY_PARTS.items():
            # a negative share, by rounding or released by matter, has no length
            shares = 100.0 * np.maximum([getattr(row, part) for row in own], 0.0)
            axes.barh(names, shares, left=left, color=colour, label=label, height=0.75)
            left += shares
        axes.invert_yaxis()
        axes.set(title=env, xlim=(0.0, 102.0))
        axes.set_xlabel("share of the work that muscles put in [%]", fontsize=9)
        axes.tick_params(labelsize=8)
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=9)
    path = folder / "accuracy-energy.png"
    figures.save(figure, path)
    return path
