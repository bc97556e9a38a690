"""The picture of `bench`: rates by number of particles, and where the processor time of runs goes."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from zoobench.errors import UsageError
from zoobench.render import figures
from zoobench_verify.bench.bench_rows import BenchResults, RateRow, RunShare

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_PANEL = (7.0, 5.0)  # [inches]
_PARTS = {"advance": "#0b62a4", "reverse": "#5a9bd4", "survey": "#a8cbe8"} | {
    "launching": "#c8501e", "loading": "#e3a17f", "rest": "#b8b8b8",
}  # fmt: skip


def draw(results: BenchResults, path: Path) -> None:
    """Draw the results: a panel of rates and one of runs, as far as there are any.

    Raises:
        UsageError: there is nothing to draw, matplotlib is missing, or the file cannot be written.
    """
    panels = [panel for panel in (results.rates, results.runs) if panel]
    if not panels:
        raise UsageError("There is nothing to draw. Measure scenes or runs first.")
    figure = figures.blank((_PANEL[0] * len(panels), _PANEL[1]))
    axes = iter(figure.subplots(1, len(panels), squeeze=False)[0])
    if results.rates:
        _draw_rates(next(axes), results.rates)
    if results.runs:
        _draw_runs(next(axes), results.runs)
    figures.save(figure, path)


def _draw_rates(axes: "Axes", rows: Sequence[RateRow]) -> None:
    """Rates of every scene by its particles: forward solid, forward and backward dashed."""
    for number, scene in enumerate(dict.fromkeys(row.scene for row in rows)):
        own = sorted((row for row in rows if row.scene == scene), key=lambda row: row.particle_count)
        counts, colour = [row.particle_count for row in own], f"C{number % 10}"
        axes.plot(counts, [row.forward_mps for row in own], marker=".", color=colour, label=scene)
        both = {row.particle_count: row.both_mps for row in own if row.both_mps is not None}
        axes.plot(list(both), list(both.values()), marker=".", fillstyle="none", color=colour, linestyle="--")
    axes.set(xlim=_decades([row.particle_count for row in rows]))
    axes.set(xscale="log", yscale="log", xlabel="particles", ylabel="million particle-substeps per second")
    axes.set_title("forward (solid), forward and backward (dashed)")
    axes.grid(alpha=0.3, which="both")
    axes.legend(fontsize=9)


def _decades(counts: Sequence[int]) -> tuple[float, float]:
    """The powers of ten around some numbers."""
    return 10.0 ** math.floor(math.log10(min(counts))), 10.0 ** (math.floor(math.log10(max(counts))) + 1)


def _draw_runs(axes: "Axes", runs: Sequence[RunShare]) -> None:
    """The parts of every run's processor time as one bar."""
    labels = [run.command for run in runs]
    begins = [0.0] * len(runs)
    for part, colour in _PARTS.items():
        shares = [100 * getattr(run, f"{part}_s") / run.cpu_s for run in runs]
        axes.barh(labels, shares, left=begins, color=colour, label=part)
        begins = [begin + share for begin, share in zip(begins, shares, strict=True)]
    axes.set(xlabel="share of the processor time of `zoobench run` [%]", xlim=(0, 100))
    axes.invert_yaxis()
    axes.legend(fontsize=9, ncols=3, loc="upper center", bbox_to_anchor=(0.5, -0.15))
