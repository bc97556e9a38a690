"""The charts of a report, as Vega-Lite specifications with their data.

Lines, texts and rules of a chart have the colour of the text around it, so that it follows a dark page and a print.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from typing import Any

from zoobench.db.rows import RunState
from zoobench.report.aggregate import Aggregates
from zoobench.report.curve_plot import AMOUNTS, line, reference_means, titles_of
from zoobench.report.entries import entry_labels
from zoobench.report.foreign_text import visible
from zoobench.report.labels import labels
from zoobench.report.learning_curves import LearningCurve, cells, comparable_results, in_cells
from zoobench.report.page.sections import Accuracy, Level, Section
from zoobench.report.palette import DASHES, Style, styles, styles_of
from zoobench.report.run_results import RunResult
from zoobench.report.tables import methods_of
from zoobench.spec import Ref
from zoobench.tasks.quantities import heading

Chart = dict[str, Any]
Points = list[dict[str, Any]]

_MOST_POINTS = 15_000  # of all lines together
_FEWEST, _USUAL = 8, 60  # of one line
_DIGITS = 5
_SCHEMA = "https://vega.github.io/schema/vega-lite/v6.json"
_INK = "currentColor"
_LOG = {"type": "log", "nice": False, "padding": 20}
_CONFIG = {
    "background": None,
    "font": "system-ui, sans-serif",
    "axis": {
        "labelColor": _INK, "titleColor": _INK, "tickColor": _INK, "domainColor": _INK,
        "gridColor": _INK, "gridOpacity": 0.12, "titleFontWeight": "normal",
        "labelFontSize": 11, "titleFontSize": 12,
    },
    "legend": {"labelColor": _INK, "titleColor": _INK, "orient": "top", "titleFontWeight": "normal", "columns": 2,
               "labelLimit": 300, "labelFontSize": 12, "symbolOpacity": 1},
    "view": {"stroke": None},
}  # fmt: skip


def curve_chart(section: Section) -> Chart | None:
    """Best scores or errors by the amount spent, one cell at a time; None without a curve."""
    groups = cells(section.results, section.known)
    names = _labels(section)
    found: Points = []
    rules: Points = []
    noun = heading(group[0].quantity for group in groups)
    lines = sum(len(methods_of(result.spec for result in group)) for group in groups)
    room = max(_FEWEST, min(_USUAL, _MOST_POINTS // max(lines, 1)))
    for title, group in zip(_titles(groups), groups, strict=True):
        for method in methods_of(result.spec for result in group):
            seeds = [section.known[result.run.id] for result in group if result.run.spec.method == method]
            found += [{"cell": title, "method": names[method], **point} for point in _thinned(seeds, room)]
        means = reference_means(group)
        rules += [{"cell": title, "reference": word, "level": _short(level)} for level, word in means]
    if not found:
        return None
    kind = next(iter(section.known.values())).kind
    x = _number("spent", AMOUNTS[kind])
    look = _look(names)
    step = {"interpolate": "step-after"}
    spot = _tooltip("method", spent=AMOUNTS[kind], mean="mean of the seeds", low="lowest", high="highest")
    return _chart(
        _chosen([point["cell"] for point in found]),
        [
            _layer("lines", _band(x, _score("low", noun), look), type="area", opacity=0.18, **step),
            _layer("lines", {"x": x, "y": _score("mean", noun), **look, "tooltip": spot},
                   type="line", point={"size": 14}, **step),
            _layer("rules", {"y": _score("level", noun), "tooltip": _tooltip("reference", level=noun)},
                   type="rule", strokeDash=[2, 3], color=_INK),
        ],
        lines=found, rules=rules,
    )  # fmt: skip


def cost_chart(section: Section, accuracy: Accuracy) -> Chart | None:
    """Each run's score or error by its wall time, with the known error of its fidelity; None without a score.

    One row of the tables at a time.
    """
    scored = [
        result
        for result in comparable_results(section.results)
        if result.run.state is RunState.DONE and result.score is not None and math.isfinite(result.score.value)
    ]
    groups = in_cells(scored)
    error_at = cache(accuracy)  # there are more runs than places
    names = _labels(section)
    points = [
        {"cell": title, "method": names[result.spec.method], **_cost(result, error_at)}
        for title, group in zip(_titles(groups), groups, strict=True)
        for result in group
    ]
    if not points:
        return None
    noun = heading(group[0].quantity for group in groups)
    x = _number("seconds", "wall time of the run [s]", scale=_LOG)
    look = _look(names)
    spot = _tooltip("method", "seed", "unit", score=noun, seconds="wall time [s]", error="known error of the fidelity")
    bars = _layer("runs", _band(x, _score("low", noun), look), type="rule", opacity=0.5)
    bars["transform"] = [{"filter": "isValid(datum.low)"}]
    encoding = {"x": x, "y": _score("score", noun), "color": look["color"], "tooltip": spot}
    dots = _layer("runs", encoding, type="point", filled=True, size=60)
    layers = [bars, dots] if any("low" in point for point in points) else [dots]
    return _chart(_chosen([point["cell"] for point in points]), layers, runs=points)


def accuracy_chart(section: Section, levels: Sequence[Level]) -> Chart | None:
    """Error of scores by the cost of a fidelity, in the environments and tasks of a section; None where none is known.

    A line joins the fidelities of one environment and task.
    """
    places = {(row.env.name, row.task.name) for table in section.tables for row in table.rows}
    points: Points = [
        {"place": visible(f"{level.env} x {level.task}"), "fidelity": visible(level.fidelity),
         "error": level.error, "seconds": level.seconds}
        for level in levels
        if (level.env, level.task) in places
    ]  # fmt: skip
    if not points:
        return None
    x = _number("seconds", "CPU s per simulated second", scale=_LOG)
    y = _number("error", "known error of scores", axis={"format": ".0%"})
    spot = _tooltip("place", "fidelity", error="error", seconds="CPU s per simulated second")
    key = {"orient": "bottom", "symbolFillColor": _INK, "symbolStrokeColor": _INK}
    shape = {"field": "fidelity", "type": "nominal", "title": None, "legend": key}
    scheme = "tableau10" if len({point["place"] for point in points}) <= 10 else "tableau20"
    colour = {"field": "place", "type": "nominal", "title": None, "scale": {"scheme": scheme}}
    encoding: Chart = {"x": x, "y": y, "color": colour}
    lines = _layer("levels", encoding, type="line", opacity=0.5)
    dots = _layer("levels", {**encoding, "shape": shape, "tooltip": spot}, type="point", filled=True, size=70)
    return _chart({}, [lines, dots], levels=points)


def profile_chart(found: Aggregates) -> Chart | None:
    """Performance profiles; None where no row is complete."""
    names = entry_labels(found.entries)
    points = [
        {"method": visible(names[profile.entry]), "threshold": _short(threshold), "share": _short(share.value),
         "low": _short(share.low), "high": _short(share.high)}
        for profile in found.profiles
        for threshold, share in zip(profile.thresholds, profile.shares, strict=True)
    ]  # fmt: skip
    if not points:
        return None
    x = _number("threshold", "normalised score", scale={"nice": False})
    by_entry = styles_of({entry: entry.method for entry in names})
    look = _scales({visible(name): by_entry[entry] for entry, name in names.items()})
    title = "share of runs above it"
    spot = _tooltip("method", threshold="normalised score", share=title)
    band = _layer("profiles", _band(x, _number("low", title), look), type="area", opacity=0.18)
    line_of_shares = _layer("profiles", {"x": x, "y": _number("share", title), **look, "tooltip": spot}, type="line")
    layers = [line_of_shares] if points[0]["low"] is None else [band, line_of_shares]
    return _chart({}, layers, profiles=points)


def _chart(choice: Chart, layers: Sequence[Chart], **datasets: Points) -> Chart:
    """Layers over each other, as wide as the page allows; with a choice each shows the chosen part of its data."""
    if choice:
        only = {"filter": "datum.cell === chosen"}
        layers = [{**layer, "transform": [only, *layer.get("transform", [])]} for layer in layers]
    return {
        "$schema": _SCHEMA, **choice, "width": "container", "height": 300, "autosize": {"type": "fit-x"},
        "config": _CONFIG, "layer": list(layers), "datasets": datasets,
    }  # fmt: skip


def _chosen(cells_of_points: Sequence[str]) -> Chart:
    """A list to choose a cell from."""
    options = list(dict.fromkeys(cells_of_points))
    bind = {"input": "select", "options": options, "name": "Show "}
    return {"params": [{"name": "chosen", "value": options[0], "bind": bind}]}


def _look(names: Mapping[Ref, str]) -> Chart:
    """Colours and strokes of methods, those of every picture."""
    return _scales({names[method]: style for method, style in styles(names).items()})


def _scales(by_name: Mapping[str, Style]) -> Chart:
    """The encodings of lines with these styles by their names."""
    names = list(by_name)
    field = {"field": "method", "type": "nominal", "title": None}
    colours = [style.colour for style in by_name.values()]
    dashes = [DASHES[style.stroke] for style in by_name.values()]
    return {
        "color": {**field, "scale": {"domain": names, "range": colours}},
        "strokeDash": {**field, "scale": {"domain": names, "range": dashes}},
    }


def _layer(data: str, encoding: Chart, **mark: Any) -> Chart:
    """A layer: which data are drawn, by which marks, and what of them the marks show."""
    return {"data": {"name": data}, "mark": mark, "encoding": encoding}


def _band(x: Chart, low: Chart, look: Chart) -> Chart:
    """The encoding of a band or a bar, from the field of its lower end to `high`."""
    return {"x": x, "y": low, "y2": {"field": "high"}, "color": look["color"]}


def _number(field: str, title: str, **more: Chart) -> Chart:
    return {"field": field, "type": "quantitative", "title": title, **more}


def _score(field: str, noun: str) -> Chart:
    return _number(field, noun, scale={"zero": False})


def _tooltip(*same: str, **titled: str) -> list[Chart]:
    """Fields of a point under their own names, and those with other titles."""
    fields = [{"field": name, "title": name} for name in same]
    return fields + [{"field": name, "title": title, "format": ".4~g"} for name, title in titled.items()]


def _labels(section: Section) -> dict[Ref, str]:
    """The names of all methods of a section."""
    found = labels(result.spec.method for result in comparable_results(section.results))
    return {method: visible(found[method]) for method in sorted(found, key=str)}


def _titles(groups: Sequence[Sequence[RunResult]]) -> list[str]:
    """A name for each group; equal names are numbered."""
    titles = [visible(title) for title in titles_of(groups)]
    return [
        f"{title} #{titles[:place].count(title) + 1}" if titles.count(title) > 1 else title
        for place, title in enumerate(titles)
    ]


def _thinned(seeds: Sequence[LearningCurve], room: int) -> Iterable[dict[str, float | None]]:
    """The line of a method with no more points than there is room for, its first and last among them."""
    drawn = line(seeds)
    if drawn is None:
        return []
    last = len(drawn.spent) - 1
    kept = sorted({round(place * last / (room - 1)) for place in range(room)})
    columns = {"spent": drawn.spent, "mean": drawn.mean, "low": drawn.low, "high": drawn.high}
    return [{name: _short(values[place]) for name, values in columns.items()} for place in kept]


def _cost(result: RunResult, accuracy: Accuracy) -> dict[str, Any]:
    assert result.score is not None
    spec, quantity, seconds = result.spec, result.quantity, result.run.seconds
    score = quantity.sign * result.score.value
    error = accuracy(spec.env, spec.task, spec.fidelity)
    ends = {} if error is None else {"low": score - error * abs(score), "high": score + error * abs(score)}
    numbers = {"score": score, "seconds": max(seconds, 1e-3), "error": error, **ends}
    return {"seed": spec.seed, "unit": visible(quantity.unit_text), **{key: _short(n) for key, n in numbers.items()}}


def _short(value: float | None) -> float | None:
    """With few digits, as a picture needs them; None for a value that JSON cannot hold."""
    return None if value is None or not math.isfinite(value) else float(f"{value:.{_DIGITS}g}")
