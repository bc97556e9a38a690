"""The picture of the study, a panel for each environment, and the energy balances, a bar for each."""

from collections.abc import Sequence
from itertools import cycle
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from zoobench.accuracy.levels import LevelRow
from zoobench.errors import UsageError
from zoobench.render import figures
from zoobench_verify.accuracy.energy_rows import EnergyRow

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_PANEL = (4.2, 3.4)  # [inches]
_COLUMNS = 3
_TASK_COLOURS = ("#0b62a4", "#c8501e", "#2b8a3e", "#7a3e9d", "#946b00", "#4d4d4d")
_LARGEST = 4.0  # ratio at which the scale ends; a gait that scores more than that has nothing in common with itself
_ENERGY_PARTS = {
    "back": ("taken back by muscles", "#b9c6d3"),
    "stored": ("stored", "#0b62a4"),
    "viscous": ("viscosity", "#2b8a3e"),
    "plastic": ("yield of the medium", "#946b00"),
    "contact": ("ground and walls", "#7a3e9d"),
    "unexplained": ("unexplained", "#c8501e"),
}


def draw(rows: Sequence[LevelRow], folder: Path) -> Path:
    """Score at a level by score at the finest against time, a panel for each environment and a line for each task.

    The line is the median over the gaits, the band holds 80 % of them. Returns the path of the PNG.

    Raises:
        UsageError: there are no measurements, matplotlib is missing, or the file cannot be written.
    """
    shown = [row for row in rows if row.median is not None and row.seconds]
    envs = list(dict.fromkeys(row.env for row in shown))
    if not envs:
        raise UsageError("There are no gaits to draw. Use `zoobench verify accuracy run` first.")
    colours = dict(zip(dict.fromkeys(row.task for row in shown), cycle(_TASK_COLOURS), strict=False))
    columns = min(_COLUMNS, len(envs))
    lines = -(-len(envs) // columns)
    top = min(_LARGEST, 1.05 * max(row.high or 0.0 for row in shown))
    figure = figures.blank((max(columns, 1.5) * _PANEL[0], lines * _PANEL[1] + 0.4), dpi=100)
    for number, env in enumerate(envs):
        axes = figure.add_subplot(lines, columns, number + 1)
        _panel(axes, [row for row in shown if row.env == env], colours)
        axes.set_title(env, loc="left")
        axes.set_ylim(0.0, top)
        if number % columns == 0:
            axes.set_ylabel("score / score at the finest")
        if number >= len(envs) - columns:
            axes.set_xlabel("CPU time of a simulated second [s]")
    handles = {name: handle for axes in figure.axes
               for handle, name in zip(*axes.get_legend_handles_labels(), strict=True)}  # fmt: skip
    figure.legend(list(handles.values()), list(handles), loc="outside lower center", ncols=len(handles), fontsize=9)
    path = folder / "accuracy.png"
    figures.save(figure, path)
    return path


def _panel(axes: "Axes", rows: Sequence[LevelRow], colours: dict[str, str]) -> None:
    """One environment: the levels' names stand above, where no line is."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axes.set_xscale("log")
    axes.axhline(1.0, color="#4d4d4d", linewidth=1, linestyle="--")
    for task, colour in colours.items():
        own = [row for row in rows if row.task == task]
        seconds = [row.seconds or 0.0 for row in own]
        low, median, high = ([getattr(row, name) for row in own] for name in ("low", "median", "high"))
        if own:
            axes.fill_between(seconds, low, high, color=colour, alpha=0.18, linewidth=0)
            axes.plot(seconds, median, "o-", color=colour, label=task, markersize=4)
    places = {level: float(np.median([row.seconds for row in rows if row.fidelity == level]))
              for level in dict.fromkeys(row.fidelity for row in rows)}  # fmt: skip
    names = axes.secondary_xaxis("top")
    names.set_xscale("log")
    names.set_xticks(list(places.values()), list(places), fontsize=8, rotation=30, ha="left", rotation_mode="anchor")
    names.xaxis.set_minor_formatter(NullFormatter())
    names.tick_params(which="minor", length=0)
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.margins(x=0.12)
    axes.grid(alpha=0.3)


def draw_energy(rows: Sequence[EnergyRow], folder: Path, *, level: str) -> Path:
    """One PNG with a bar for each environment, its energy balance at a level; its path.

    Raises:
        UsageError: there are no balances, matplotlib is missing, or the file cannot be written.
    """
    own = [row for row in rows if row.fidelity == level]
    if not own:
        raise UsageError(f"There are no energy balances at {level} to draw. Use `zoobench verify accuracy run` first.")
    figure = figures.blank((8.0, 1.4 + 0.32 * len(own)), dpi=100)
    axes = figure.add_subplot()
    left = np.zeros(len(own))
    for part, (label, colour) in _ENERGY_PARTS.items():
        # a negative share, by rounding or released by matter, has no length
        shares = 100.0 * np.maximum([getattr(row, part) for row in own], 0.0)
        axes.barh([row.env for row in own], shares, left=left, color=colour, label=label, height=0.75)
        left += shares
    axes.invert_yaxis()
    axes.set(title=f"Energy at {level}", xlim=(0.0, 102.0))
    axes.set_xlabel("share of the work that muscles put in [%]", fontsize=9)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=9)
    path = folder / "accuracy-energy.png"
    figures.save(figure, path)
    return path
