"""The charts of a report: what is drawn, and that Vega-Lite understands it."""

import json

import pytest
import vl_convert

from tests.report.page.sections import LEVELS, section
from zoobench.report.aggregate import aggregate
from zoobench.report.page.charts import Chart, accuracy_chart, cost_chart, curve_chart, profile_chart
from zoobench.report.page.sections import Section


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> Section:
    """See `tests.report.page.sections.section`."""
    return section(tmp_path_factory.mktemp("charts"))


def understood(chart: Chart | None) -> Chart:
    """The chart, which Vega-Lite compiles and JSON holds."""
    assert chart is not None
    json.dumps(chart, allow_nan=False)
    assert vl_convert.vegalite_to_vega(chart)["marks"]
    return chart


def test_a_learning_curve_is_drawn_for_each_cell_and_method(shown: Section) -> None:
    """From the first score of all seeds, in steps, with both references; the first cell is chosen."""
    chart = understood(curve_chart(shown))
    points = chart["datasets"]["lines"]
    desert = [point for point in points if "desert" in point["cell"] and point["method"] == "diffphysics"]
    assert [(point["spent"], point["mean"]) for point in desert] == [(200.0, 5.025), (300.0, 10.05)]
    assert (desert[1]["low"], desert[1]["high"]) == (10.0, 10.1)
    assert {rule["level"] for rule in chart["datasets"]["rules"]} == {0.0, 0.5}
    (param,) = chart["params"]
    assert len(param["bind"]["options"]) == 4
    assert param["value"] in param["bind"]["options"]


def test_a_run_is_drawn_by_its_time_with_the_error_of_its_fidelity(shown: Section) -> None:
    """Bars of 20 % where the error is known, none elsewhere; the run without a score is no point."""
    chart = understood(cost_chart(shown, lambda env, *_: 0.2 if env.name == "desert" else None))
    points = chart["datasets"]["runs"]
    assert len(points) == 16
    (best,) = (point for point in points if point["score"] == 10.1)
    assert (best["low"], best["high"], best["error"]) == (pytest.approx(8.08), pytest.approx(12.12), 0.2)
    assert all("low" not in point for point in points if "ice" in point["cell"])


def test_the_accuracy_is_shown_where_the_section_has_runs(shown: Section) -> None:
    """The desert is among its environments, the ocean is not."""
    points = understood(accuracy_chart(shown, LEVELS))["datasets"]["levels"]
    assert points == [{"place": "desert x turning", "fidelity": "draft", "error": 0.2, "seconds": 1.0}]


def test_profiles_have_a_line_for_each_method(shown: Section) -> None:
    """Of the rows that are complete; the failed run's row is left out."""
    found = aggregate(shown.tables[0])
    assert found.rows == 4
    points = understood(profile_chart(found))["datasets"]["profiles"]
    assert {point["method"] for point in points} == {"diffphysics", "random"}


def test_without_data_there_is_no_chart(shown: Section) -> None:
    """Nothing is drawn of nothing."""
    nothing = Section("", "", (), (), 0, shown.foot)
    charts = (curve_chart(nothing), cost_chart(nothing, lambda *_: None), accuracy_chart(nothing, LEVELS))
    assert charts == (None, None, None)
