"""Learning curves as pictures: a panel for each cell, a line for each method."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill
from types import MappingProxyType
from typing import TYPE_CHECKING

from zoobench.errors import UnknownNameError, UsageError
from zoobench.render import figures
from zoobench.report.labels import labels
from zoobench.report.learning_curves import LearningCurve, cells
from zoobench.report.normalise import REFERENCES
from zoobench.report.palette import styles
from zoobench.report.provisional import MARK, marked
from zoobench.report.run_results import RunResult
from zoobench.report.tables import methods_of
from zoobench.report.units import in_units
from zoobench.spec import Ref

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_PANELS = 24

_PANEL = (5.4, 3.9)  # [inches]
_NARROWEST, _SHORTEST = 2.3, 2.0  # panel of a figure whose width is given [inches]
_INCH = 25.4  # [mm]
_TICK, _MARGIN = 0.75, 0.85  # space for an amount on its axis, and at the side of a panel's axis [inches]
_MOST_TICKS = 6
_AXES = ("env", "task", "design", "controller", "fidelity")
_SMALL, _SMALL_LETTER = 8, 0.065  # size of the letters of a narrow figure [points], and their width [inches]
_NUMBERS, _FEWEST = 0.85, 8  # space for the numbers at the side of a panel [inches], and letters in a line at least
_LETTER, _KEY = 0.075, 7  # width of a letter of the legend [inches], and of a line's sample in letters
_UNLIKE = 20.0  # ends so many times apart ask for a logarithmic axis
AMOUNTS = {"substeps": "simulated substeps, forward and backward", "episodes": "episodes", "seconds": "wall time [s]"}
REFERENCE_NAMES = {"idle_score": "idle", "random_score": "mean random"}
CAPTION = (
    "best so far; line: mean over seeds; band: lowest to highest seed; "
    "dotted: a robot at rest (idle) and the mean random controller"
)
"""The caption of the figure, which explains its lines and bands."""
NO_NAMES: Mapping[str, str] = MappingProxyType({})


Looks = Mapping[Ref, tuple[str, str, str]]
"""Label, colour and stroke of each method."""


@dataclass(frozen=True)
class Line:
    """A method in a cell, over the amounts at which all its seeds have a score; it holds from each to the next.

    Attributes:
        spent: rising amounts.
        mean, low, high: of the best scores or errors of the seeds, at each [the task's unit].
    """

    spent: tuple[float, ...]
    mean: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]


def line(seeds: Sequence[LearningCurve], factor: float = 1.0) -> Line | None:
    """The line of a method, times a factor; None where there is no amount at which all seeds have a score."""
    first = [
        next((x for x, score in zip(one.spent, one.scores, strict=True) if score is not None), None) for one in seeds
    ]
    begins = [x for x in first if x is not None]
    if len(begins) < len(seeds):
        return None
    begin = max(begins)
    end = min(min(one.reach for one in seeds), max(one.spent[-1] for one in seeds))
    if end < begin:
        return None
    spent = sorted({begin, end, *(x for one in seeds for x in one.spent if begin < x < end)})
    scale = factor * seeds[0].result.quantity.sign
    rows = [[scale * score for one in seeds if (score := one.at(x)) is not None] for x in spent]
    return Line(
        tuple(spent),
        tuple(sum(row) / len(row) for row in rows),
        tuple(map(min, rows)),
        tuple(map(max, rows)),
    )


def draw(
    results: Iterable[RunResult],
    known: Mapping[int, LearningCurve],
    path: Path,
    width: float | None = None,
    renamed: Mapping[str, str] = NO_NAMES,
    units: Sequence[str] = (),
) -> int:
    """Draw the curves of these results, a panel for each cell; how many panels there are.

    With the width of a figure in a paper [mm] it has no caption in it, which `CAPTION` is. Methods, and the names in
    titles, may be renamed, and scores be shown in other units, each where it fits.

    Raises:
        UsageError: there is nothing to draw or too much, matplotlib is missing, or the file cannot be written.
    """
    groups = cells(results, known)
    if not groups or len(groups) > MOST_PANELS:
        raise UsageError(
            f"{len(groups)} cells have curves, and a picture holds 1 to {MOST_PANELS}. "
            "Choose others with --env, --task, --design or --fidelity."
        )
    columns, size = _layout(len(groups), width)
    figure = figures.blank(size) if width is None else figures.blank(size, dpi=300)
    looks = _looks(result.run.spec.method for group in groups for result in group)
    _check_names(renamed, groups, looks)
    looks = {method: (renamed.get(label, label), colour, stroke) for method, (label, colour, stroke) in looks.items()}
    titles = titles_of(groups, renamed)
    for number, group in enumerate(groups):
        axes = figure.add_subplot(-(-len(groups) // columns), columns, number + 1)
        _panel(axes, group, known, looks, units)
        axes.set_title(titles[number], fontsize=10)
        if width is not None:
            _fold(axes, size[0] / columns)
            _thin_out(axes, size[0] / columns)
    _draw_key(figure)
    if width is None:
        _draw_caption(figure, columns, has_mark=any(MARK in title for title in titles))
    figures.save(figure, path)
    return len(groups)


def _check_names(renamed: Iterable[str], groups: Sequence[Sequence[RunResult]], looks: Looks) -> None:
    """Check that every renamed name is in the figure."""
    there = [label for label, _, _ in looks.values()]
    there += [name for names in _names_of(groups).values() for name in names.values()]
    for name in renamed:
        if name not in there:
            raise UnknownNameError("name in the figure:", name, dict.fromkeys(there))


def _thin_out(axes: "Axes", inches: float) -> None:
    """Leave so many amounts on the axis of a panel that their numbers stay apart."""
    if axes.get_xscale() == "linear":
        room = int((inches - _MARGIN) / _TICK)
        axes.locator_params(axis="x", nbins=min(max(room, 1), _MOST_TICKS))


def _layout(count: int, width: float | None) -> tuple[int, tuple[float, float]]:
    """Number of columns, and the size of the figure [inches]."""
    columns = 2 if count == 4 else min(count, 3)
    if width is not None:
        inches = width / _INCH
        columns = max(1, min(columns, int(inches / _NARROWEST)))
        return columns, (inches, max(_SHORTEST, 0.75 * inches / columns) * -(-count // columns) + 0.5)
    return columns, (_PANEL[0] * columns + 0.4, _PANEL[1] * -(-count // columns) + 0.9)


def _fold(axes: "Axes", room: float) -> None:
    """Write title, labels and numbers small, in lines that a panel of this width [inches] has room for."""
    axes.tick_params(labelsize=_SMALL)
    for text in (axes.title, axes.xaxis.label, axes.yaxis.label):
        text.set(fontsize=_SMALL, text=fill(text.get_text(), max(_FEWEST, int((room - _NUMBERS) / _SMALL_LETTER))))


def _draw_key(figure: "Figure") -> None:
    """The legend of all panels."""
    seen = {
        label: handle for axes in figure.axes for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    room = figure.get_figwidth() / _LETTER // (_KEY + max(map(len, seen), default=0))
    ncols = int(min(max(room, 1), 4, max(len(seen), 1)))
    figure.legend(seen.values(), seen.keys(), loc="outside lower center", ncols=ncols, fontsize=9)


def _draw_caption(figure: "Figure", columns: int, *, has_mark: bool) -> None:
    caption = CAPTION if columns > 1 else CAPTION.replace("seed; dotted", "seed;\ndotted")
    if has_mark:
        caption += f"\n{MARK} provisional: `zoobench show` and the environment's name say why"
    figure.suptitle(caption, fontsize=8)


def _looks(methods: Iterable[Ref]) -> Looks:
    """Label, colour and stroke of each method, the same in all panels."""
    names = labels(methods)
    return {method: (names[method], *style) for method, style in styles(names).items()}


def titles_of(groups: Sequence[Sequence[RunResult]], renamed: Mapping[str, str] = NO_NAMES) -> list[str]:
    """The title of each group of results: environment, task, design, and the other axes in which groups differ."""
    specs = [group[0].run.spec for group in groups]
    names = {
        axis: {ref: renamed.get(name, name) for ref, name in found.items()} for axis, found in _names_of(groups).items()
    }
    names["env"] = marked(names["env"])
    shown = [axis for axis in _AXES if axis in ("env", "task", "design") or len(names[axis]) > 1]
    several = len({spec.frames for spec in specs}) > 1
    return [
        ", ".join(names[axis][getattr(spec, axis)] for axis in shown)
        + (f", {spec.frames} frames" if several else "")
        + f" ({_seeds(group)})"
        for spec, group in zip(specs, groups, strict=True)
    ]


def _names_of(groups: Sequence[Sequence[RunResult]]) -> dict[str, dict[Ref, str]]:
    """The names of the components on each axis."""
    return {axis: labels(getattr(group[0].run.spec, axis) for group in groups) for axis in _AXES}


def _seeds(group: Sequence[RunResult]) -> str:
    """The number of seeds behind each line: `3 seeds`, or `2 to 3 seeds`."""
    counts = sorted(Counter(result.run.spec.method for result in group).values())
    number = f"{counts[0]} to {counts[-1]}" if counts[0] != counts[-1] else str(counts[0])
    return f"{number} seed" if number == "1" else f"{number} seeds"


def _panel(
    axes: "Axes",
    group: Sequence[RunResult],
    known: Mapping[int, LearningCurve],
    looks: Looks,
    units: Sequence[str] = (),
) -> None:
    quantity, factor = in_units(group[0].quantity, units)
    ends = []
    for method in methods_of(result.spec for result in group):
        seeds = [known[result.run.id] for result in group if result.run.spec.method == method]
        drawn = line(seeds, factor)
        if drawn is None:
            continue
        label, colour, stroke = looks[method]
        ends.append(drawn.spent[-1])
        axes.step(drawn.spent, drawn.mean, where="post", color=colour, linestyle=stroke, label=label)
        axes.plot(drawn.spent[-1], drawn.mean[-1], color=colour, marker="o", markersize=3.5)
        axes.fill_between(drawn.spent, drawn.low, drawn.high, step="post", color=colour, alpha=0.18, linewidth=0)
    _mark_references(axes, group, factor)
    axes.locator_params(axis="x", nbins=_MOST_TICKS)  # amounts are long numbers
    if ends and max(ends) > _UNLIKE * min(ends):
        axes.set_xscale("log")
    kind = known[group[0].run.id].kind
    axes.set_xlabel(AMOUNTS[kind])
    axes.set_ylabel(f"best {quantity.title[0].lower()}{quantity.title[1:]}")
    axes.grid(alpha=0.3)


def reference_means(group: Sequence[RunResult]) -> list[tuple[float, str]]:
    """Each reference score or error, the mean over the runs that know it, and its name."""
    sign = group[0].quantity.sign
    known = {name: [run.finals[name].value for run in group if name in run.finals] for name in REFERENCES}
    return [(sign * sum(found) / len(found), REFERENCE_NAMES[name]) for name, found in known.items() if found]


def _mark_references(axes: "Axes", group: Sequence[RunResult], factor: float) -> None:
    """A thin line for each reference score, times a factor."""
    levels = [(factor * level, word) for level, word in reference_means(group)]
    for place, (level, word) in enumerate(sorted(levels)):
        axes.axhline(level, color="0.35", linewidth=0.8, linestyle=":")
        below = place == 0 and len(levels) > 1  # the words of two that are close stay apart
        axes.annotate(
            word, (0.99, level), xycoords=("axes fraction", "data"), fontsize=7, color="0.35", ha="right",
            va="top" if below else "bottom",
        )  # fmt: skip
