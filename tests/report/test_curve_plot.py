"""Learning curves as pictures."""

import re
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from tests.report.content import add_curve, made_once, make_spec
from zoobench.db.store import Store
from zoobench.errors import UsageError
from zoobench.report.curve_plot import MOST_PANELS, _panel, draw, line
from zoobench.report.learning_curves import curves
from zoobench.report.run_results import choose_results
from zoobench.spec import Ref, RunSelection

REFERENCES = {"idle_score": 0.0, "random_score": 0.05}


@made_once
def _filled(store: Store) -> None:
    for env in ("desert-v1", "ice-v1"):
        for seed in range(2):
            add_curve(store, make_spec(env=env, seed=seed), [0.1, 0.2 + seed, 0.8 + seed], references=REFERENCES)
            late = [None, 0.1, 0.3, 0.3]
            add_curve(store, make_spec(env=env, method="random-v1", seed=seed), late, cost=60.0 + seed)


@pytest.fixture
def store(tmp_path: Path) -> Store:
    """Two methods with two seeds on two environments."""
    return Store(_filled(tmp_path / "runs.db"))


def test_a_line_is_the_mean_in_a_band_from_the_lowest_to_the_highest_seed(store: Store) -> None:
    """It begins where all seeds have a score, changes where any of them does, and ends where the longest does."""
    known = curves(store, choose_results(store, RunSelection()), "substeps")
    both = line([known[1], known[3]])
    assert both is not None
    assert both.spent == (100.0, 200.0, 300.0)
    assert both.mean == pytest.approx((0.1, 0.7, 1.3))
    assert both.low == (0.1, 0.2, 0.8)
    assert both.high == (0.1, 1.2, 1.8)
    late = line([known[2], known[4]])
    assert late is not None
    assert late.spent == (122.0, 180.0, 183.0, 240.0, 244.0)
    assert late.mean == pytest.approx((0.1, 0.2, 0.3, 0.3, 0.3))


def test_errors_are_drawn_as_errors(tmp_path: Path) -> None:
    """Of a task with an error the line falls, and the axis says that less is better."""
    from matplotlib.figure import Figure

    store = Store(tmp_path / "runs.db")
    for seed in range(2):
        spec = replace(make_spec(seed=seed), task=Ref("waypoint-following", 1))
        add_curve(store, spec, [-0.05, -0.02 - 0.01 * seed], unit="m", references={"idle_score": -0.1})
    known = curves(store, choose_results(store, RunSelection()), "substeps")
    drawn = line(list(known.values()))
    assert drawn is not None
    assert (drawn.mean, drawn.low, drawn.high) == ((0.05, 0.025), (0.05, 0.02), (0.05, 0.03))
    figure = Figure()
    axes = figure.add_subplot()
    _panel(axes, [curve.result for curve in known.values()], known, {make_spec().method: ("m", "C0", "-")})
    assert axes.get_ylabel() == "best error [m], less is better"
    assert [text.xy[1] for text in axes.texts] == [0.1]


def test_the_picture_has_a_panel_for_each_cell(store: Store, tmp_path: Path) -> None:
    """With words and units on both axes, a line for each method and two for the references."""
    from matplotlib.figure import Figure

    drawn: list[Figure] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", lambda figure, path: drawn.append(figure))
        results = choose_results(store, RunSelection())
        assert draw(results, curves(store, results, "seconds"), tmp_path / "curves.png") == 2
    panels = drawn[0].axes
    assert [axes.get_title() for axes in panels] == [
        f"{env}, turning, caterpillar (2 seeds)" for env in ("desert", "ice")
    ]
    for axes in panels:
        assert axes.get_xlabel() == "wall time [s]"
        assert axes.get_ylabel() == "best score [m/s]"
        assert axes.get_legend_handles_labels()[1] == ["diffphysics", "random"]
        assert {text.get_text() for text in axes.texts} == {"idle", "mean random"}


def test_a_panel_in_another_unit(store: Store) -> None:
    """Lines, bands and references by one factor, and the unit on the axis; one that does not fit is left."""
    from matplotlib.figure import Figure

    results = choose_results(store, RunSelection(env="ice"))
    known = curves(store, results, "substeps")
    looks = {result.run.spec.method: ("m", "C0", "-") for result in results}
    heights = {}
    for units in ((), ("kg", "mm/s")):
        axes = Figure().add_subplot()
        _panel(axes, results, known, looks, units)
        lines = [np.asarray(each.get_ydata()) for each in axes.lines]
        bands = [np.asarray(path.vertices)[:, 1] for each in axes.collections for path in each.get_paths()]
        heights[axes.get_ylabel()] = np.concatenate([*lines, *bands])
    assert list(heights) == ["best score [m/s]", "best score [mm/s]"]
    own, other = heights.values()
    np.testing.assert_allclose(other, 1000.0 * own)


@pytest.mark.parametrize("ending", ["png", "svg"])
def test_it_is_written_as_its_ending_says(store: Store, tmp_path: Path, ending: str) -> None:
    """A file of some substance."""
    results = choose_results(store, RunSelection(env="ice"))
    path = tmp_path / f"curves.{ending}"
    assert draw(results, curves(store, results, "episodes"), path) == 1
    assert path.stat().st_size > 5000


def test_what_cannot_be_drawn_is_refused(store: Store, tmp_path: Path) -> None:
    """Nothing, too many cells, and a file that is no picture."""
    results = choose_results(store, RunSelection())
    known = curves(store, results, "substeps")
    with pytest.raises(UsageError, match="0 cells"):
        draw([], {}, tmp_path / "curves.png")
    with pytest.raises(UsageError, match=r"curves\.png"):
        draw(results, known, tmp_path / "curves.doc")
    for number in range(MOST_PANELS):
        add_curve(store, make_spec(env=f"place{number}-v1"), [0.1])
    results = choose_results(store, RunSelection())
    with pytest.raises(UsageError, match=f"{MOST_PANELS + 2} cells"):
        draw(results, curves(store, results, "substeps"), tmp_path / "curves.png")


def test_missing_matplotlib_is_told(store: Store, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With what to install."""
    monkeypatch.setitem(sys.modules, "matplotlib.backends.backend_agg", None)
    results = choose_results(store, RunSelection())
    with pytest.raises(UsageError, match="pip install"):
        draw(results, curves(store, results, "substeps"), tmp_path / "curves.png")


@pytest.mark.parametrize("width", [45.0, *(pytest.param(mm, marks=pytest.mark.slow) for mm in (85.0, 180.0))])
def test_words_stay_within_a_figure_for_a_paper(store: Store, tmp_path: Path, width: float) -> None:
    """Titles and labels are folded, not cut off."""
    from matplotlib.figure import Figure

    drawn: list[Figure] = []
    spec = replace(make_spec(env="shallow-water-v1"), task=Ref("velocity-tracking", 1))
    add_curve(store, spec, [-0.05, -0.02], unit="m/s")
    results = choose_results(store, RunSelection())
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", lambda figure, path: drawn.append(figure))
        draw(results, curves(store, results, "substeps"), tmp_path / "curves.png", width)
    (figure,) = drawn
    figure.draw_without_rendering()
    for axes in figure.axes:
        for text in (axes.title, axes.xaxis.label, axes.yaxis.label):
            ends = text.get_window_extent()
            assert figure.bbox.x0 <= ends.x0 < ends.x1 <= figure.bbox.x1, text.get_text()


@pytest.mark.parametrize("width", [60.0, pytest.param(85.0, marks=pytest.mark.slow)])
@pytest.mark.parametrize("cost", [90.0, 4_500.0, 30_000.0])
def test_the_amounts_of_a_narrow_figure_stay_apart(store: Store, tmp_path: Path, width: float, cost: float) -> None:
    """A space of half a digit at least is between the numbers of the horizontal axis, and there are two of them."""
    from matplotlib.figure import Figure

    for method in ("cmaes-v1", "sac-v1"):
        add_curve(store, make_spec(env="snow-v1", method=method), [0.1] * 9, cost=cost)
    drawn: list[Figure] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", lambda figure, path: drawn.append(figure))
        results = choose_results(store, RunSelection(env="snow"))
        draw(results, curves(store, results, "substeps"), tmp_path / "curves.png", width=width)
    (figure,) = drawn
    figure.draw_without_rendering()
    (axes,) = figure.axes
    low, high = axes.get_xlim()
    shown = [tick.label1.get_window_extent() for tick in axes.xaxis.get_major_ticks() if low <= tick.get_loc() <= high]
    assert len(shown) >= 2
    assert all(right.x0 - left.x1 > 0.04 * figure.dpi for left, right in pairwise(shown))


def test_the_names_of_a_figure_may_be_others(store: Store, tmp_path: Path) -> None:
    """Those of methods in the legend and of components in the title; one that is not there is refused."""
    from matplotlib.figure import Figure

    drawn: list[Figure] = []
    results = choose_results(store, RunSelection(env="ice"))
    known = curves(store, results, "substeps")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", lambda figure, path: drawn.append(figure))
        draw(results, known, tmp_path / "curves.png")
        draw(results, known, tmp_path / "curves.png", renamed={"diffphysics": "Gradient", "caterpillar": "Robot"})
    usual, other = (figure.axes[0] for figure in drawn)
    assert other.get_title() == usual.get_title().replace("caterpillar", "Robot")
    assert other.get_legend_handles_labels()[1] == ["Gradient", "random"]
    assert [line.get_color() for line in other.lines] == [line.get_color() for line in usual.lines]
    with pytest.raises(UsageError, match="'panda'"):
        draw(results, known, tmp_path / "curves.png", renamed={"panda": "Robot"})


@pytest.mark.slow
def test_a_figure_for_a_paper_has_its_width_and_fonts_that_publishers_take(store: Store, tmp_path: Path) -> None:
    """85 mm are 241 points; the fonts are embedded as TrueType, and the caption is left to the paper."""
    results = choose_results(store, RunSelection())
    draw(results, curves(store, results, "substeps"), tmp_path / "curves.pdf", width=85.0)
    text = (tmp_path / "curves.pdf").read_bytes()
    (box,) = re.findall(rb"/MediaBox \[ 0 0 ([0-9.]+) [0-9.]+ \]", text)
    assert float(box) == pytest.approx(85 / 25.4 * 72, abs=0.01)
    assert b"/Type3" not in text
    assert b"/FontFile2" in text
