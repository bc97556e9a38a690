"""Work and precision against exact answers: rows, orders and their verdicts."""

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, replace

import pytest

from zoobench.errors import UnknownNameError, UsageError
from zoobench_verify.accuracy.analytic import AnalyticRow, analytic, case_names, figure, summarise
from zoobench_verify.cases import select
from zoobench_verify.validate.validation_suite import CASES


@pytest.fixture(scope="module")
def rows() -> list[AnalyticRow]:
    """One case of the interior on two grids, and one with a wall on three."""
    return [
        *analytic(["manufactured-solution"], levels=2, repeats=1),
        *analytic(["gravity-column"], levels=3, repeats=1),
    ]


def _of(rows: Sequence[AnalyticRow], case: str) -> list[AnalyticRow]:
    return [row for row in rows if row.case == case]


def _fake(case: str, errors: Sequence[float], like: AnalyticRow) -> list[AnalyticRow]:
    """Rows of other errors, on grids that halve the spacing."""
    return [
        replace(like, case=case, cells=8 << level, spacing=0.125 / 2**level, error=error)
        for level, error in enumerate(errors)
    ]


@pytest.mark.slow  # `zoobench verify validate` has the case, with its order
def test_manufactured_solution_converges_with_the_interiors_order() -> None:
    """Errors are finite and fall; from 16 to 32 cells with the order that `validate` asks for."""
    found = list(analytic(["manufactured-solution"], levels=3, repeats=1))
    errors = [row.error for row in found]
    assert [row.cells for row in found] == [8, 16, 32]
    assert all(math.isfinite(error) and error > 0 for error in errors)
    assert errors[0] > errors[1] > errors[2]
    assert found[0].order is None
    assert found[1].order is not None
    assert found[1].order == pytest.approx(math.log2(errors[0] / errors[1]), rel=1e-9)
    assert found[2].order is not None
    assert found[2].order >= 1.8


def test_a_wall_makes_the_order_one(rows: list[AnalyticRow]) -> None:
    """The column stands on a wall at a grid node."""
    orders = [row.order for row in _of(rows, "gravity-column")]
    assert orders[1:] == pytest.approx([1.0, 1.0], abs=0.1)


def test_errors_are_those_that_validate_judges(rows: list[AnalyticRow]) -> None:
    """The column's largest error over h / H, to the last bit."""
    (case,) = select(CASES, ["gravity-column"], noun="case")
    expected = case.run().checks[0].value
    assert max(row.error * row.cells for row in _of(rows, "gravity-column")) == expected


def test_rows_say_what_was_paid(rows: list[AnalyticRow]) -> None:
    """A finer grid takes proportionally more substeps for the same time; the median of the cost lies in its range."""
    for case in ("manufactured-solution", "gravity-column"):
        coarse, *_, fine = _of(rows, case)
        # the step is proportional to the spacing, but for whole numbers of substeps
        assert fine.substeps == pytest.approx(fine.cells / coarse.cells * coarse.substeps, rel=0.02)
        assert fine.simulated_seconds == pytest.approx(coarse.simulated_seconds, rel=1e-9)
    for row in rows:
        assert 0 < row.seconds_min <= row.seconds <= row.seconds_max
        assert row.slowdown == row.seconds / row.simulated_seconds
        assert row.nanoseconds > 0
        assert row.precision == 64
        assert row.settings == ()


def test_rows_are_plain_data(rows: list[AnalyticRow]) -> None:
    """They go through JSON and come back."""
    for row in rows:
        document = json.loads(json.dumps(asdict(row)))
        assert AnalyticRow(**document | {"settings": tuple(document["settings"])}) == row


def test_single_precision_is_asked_for_and_named() -> None:
    """Precision reaches the simulator; its error is that of double precision to three digits, but not the same."""
    (single,) = analytic(["gravity-column"], levels=1, repeats=1, precision=32)
    (double,) = analytic(["gravity-column"], levels=1, repeats=1)
    assert (single.precision, double.precision) == (32, 64)
    assert single.error == pytest.approx(double.error, rel=1e-3)
    assert single.error != double.error


def test_further_settings_are_the_fidelitys_own() -> None:
    """A setting that it does not have is refused."""
    with pytest.raises(TypeError, match="flavour"):
        list(analytic(["gravity-column"], levels=1, repeats=1, flavour="none"))


def test_orders_are_judged_by_what_the_theory_gives(rows: list[AnalyticRow]) -> None:
    """Converging cases meet it, an error that stays does not, and where there is no theory there is no verdict."""
    assert [(each.case, each.verdict) for each in summarise(rows)] == [
        ("manufactured-solution", "met"), ("gravity-column", "met")
    ]  # fmt: skip
    like = _of(rows, "manufactured-solution")[0]
    (stalled,) = summarise(_fake("manufactured-solution", (1e-2, 4e-3, 2e-3), like))
    assert (stalled.at_least, stalled.verdict) == (1.8, "missed")
    assert stalled.order == pytest.approx(math.log2(5) / 2, rel=1e-9)
    (fast,) = summarise(_fake("gravity-column", (1e-2, 1e-3), replace(like, quantity="settlement")))
    assert fast.verdict == "missed"
    (lone,) = summarise([like])
    assert (lone.order, lone.verdict) == (None, "not judged")
    (free,) = summarise(_fake("incline", (1e-2, 2e-2), replace(like, quantity="distance")))
    assert (free.order, free.verdict) == (pytest.approx(-1.0), "not judged")


def test_figure_has_a_curve_for_every_case(rows: list[AnalyticRow]) -> None:
    """Error over wall seconds per simulated second, both in logarithms, with the grids in the label."""
    drawn = figure([*rows, replace(rows[0], quantity="another")])
    assert drawn.log == "xy"
    assert [line.label for line in drawn.curves] == [
        "manufactured-solution, 8 16 cells", "gravity-column, 8 16 32 cells"
    ]  # fmt: skip
    column = _of(rows, "gravity-column")
    assert drawn.curves[1].x == pytest.approx([row.seconds / row.simulated_seconds for row in column])
    assert drawn.curves[1].y == pytest.approx([row.error for row in column])


def test_what_cannot_be_measured_is_refused() -> None:
    """An unknown case, no level and no repeat, before anything is simulated."""
    with pytest.raises(UnknownNameError, match="gravity-column"):
        analytic(["gravity-colum"])
    with pytest.raises(UsageError, match="at least 1"):
        analytic(levels=0)
    with pytest.raises(UsageError, match="at least 1"):
        analytic(repeats=0)


@pytest.mark.slow
def test_every_case_with_a_theory_has_its_order() -> None:
    """All ladders but their finest grid; blocks on an incline and the muscle are not judged by an order."""
    found = list(analytic(levels=3, repeats=1))
    assert {row.case for row in found} == set(case_names())
    verdicts = {(each.case, each.quantity): each.verdict for each in summarise(found)}
    without_order = {"incline", "incline-damped", "muscle-stretch"}
    assert {case for (case, _), verdict in verdicts.items() if verdict == "not judged"} == without_order
    assert "missed" not in verdicts.values()
    assert max(row.error for row in found if row.case == "muscle-stretch") < 1e-5
    for name in ("incline", "incline-damped"):
        coarsest, *finer = (row.error for row in _of(found, name))
        assert coarsest < 6e-3
        assert max(finer) < 1e-3
