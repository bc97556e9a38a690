"""Plot of the energy balances: a panel for each environment, a bar for each fidelity."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from zoobench.errors import UsageError
from zoobench.render import figures
from zoobench.verify.accuracy.verdicts import EnergyRow

NAME = "accuracy-energy.png"

_PARTS = {
    "back": ("taken back by muscles", "#b9c6d3"),
    "stored": ("stored", "#0b62a4"),
    "viscous": ("viscosity", "#2b8a3e"),
    "plastic": ("yield of the medium", "#946b00"),
    "contact": ("ground and walls", "#7a3e9d"),
    "unexplained": ("unexplained", "#c8501e"),
}
_WIDTH, _ROW, _HEAD = 5.6, 0.2, 0.85  # sizes of a panel, of a bar in it, and of its title and axis [inches]
_COLUMNS = 2


def draw(rows: Sequence[EnergyRow], folder: Path) -> Path:
    """One PNG of all rows; its path.

    Raises:
        UsageError: there are no balances, matplotlib is missing, or the file cannot be written.
    """
    panels: dict[str, list[EnergyRow]] = {}
    for row in rows:
        panels.setdefault(row.env.partition("[")[0], []).append(row)
    if not panels:
        raise UsageError("There are no energy balances to draw. Use `zoobench accuracy run` first.")
    columns = min(_COLUMNS, len(panels))
    lines, most = -(-len(panels) // columns), max(map(len, panels.values()))
    figure = figures.blank((columns * _WIDTH, lines * (_HEAD + most * _ROW) + 0.5), dpi=100)
    for number, (env, own) in enumerate(panels.items()):
        axes = figure.add_subplot(lines, columns, number + 1)
        names = [row.fidelity if row.env == env else f"{row.fidelity} {row.env}" for row in own]
        left = np.zeros(len(own))
        for part, (label, colour) in _PARTS.items():
            # a negative share, by rounding or released by matter, has no length
            shares = 100.0 * np.maximum([getattr(row, part) for row in own], 0.0)
            axes.barh(names, shares, left=left, color=colour, label=label, height=0.75)
            left += shares
        axes.invert_yaxis()
        axes.set(title=env, xlim=(0.0, 102.0))
        axes.set_xlabel("share of the work that muscles put in [%]", fontsize=9)
        axes.tick_params(labelsize=8)
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=9)
    path = folder / NAME
    figures.save(figure, path)
    return path
