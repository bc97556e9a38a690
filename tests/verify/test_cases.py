"""The frame of the suites: checks and their bounds, recorders, results and the choice of cases."""

import math
import sys
from collections.abc import Callable

import numpy as np
import pytest

from zoobench.errors import SceneError, UnknownNameError, UsageError
from zoobench_verify.cases import Case, CaseRecorder, CaseResult, Check, Shortfall, case, cases_of, select


@pytest.mark.parametrize(
    ("low", "high", "inside", "outside", "text"),
    [
        (None, 1e-3, 1e-3, 1.1e-3, "<= 0.001"),
        (0.9, None, 0.9, 0.89, ">= 0.9"),
        (0.8, 1.2, 1.0, 1.21, "0.8 to 1.2"),
        (None, 0.0, 0.0, 1e-300, "<= 0"),
    ],
)
def test_a_value_lies_within_its_bounds_or_not(
    low: float | None, high: float | None, inside: float, outside: float, text: str
) -> None:
    """The bounds belong to the interval, and are part of the text."""
    check = Check("x", inside, at_least=low, at_most=high)
    assert check.is_met
    assert not Check("x", outside, at_least=low, at_most=high).is_met
    assert check.bound == text
    assert check.text == f"x {inside:.3g} {text}"


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_value_that_is_not_finite_is_never_within_bounds(value: float) -> None:
    """A simulation that blew up does not pass, whichever side the bound is on."""
    assert not Check("x", value, at_most=1.0).is_met
    assert not Check("x", value, at_least=-1.0).is_met


def test_a_number_needs_a_bound() -> None:
    """Without one it could not fail; a statement is true or not."""
    with pytest.raises(ValueError, match="no bound"):
        Check("x", 1.0)
    assert (Check("x", True).is_met, Check("x", False).is_met, Check("x", True).bound) == (True, False, "")


@pytest.mark.parametrize(("value", "verdict"), [(2.0, "known"), (0.5, "fail"), (math.nan, "fail"), (math.inf, "fail")])
def test_a_known_shortfall_neither_passes_nor_fails_until_it_is_cured(value: float, verdict: str) -> None:
    """It stands in the result with its reason; within its bound, beyond the worst, or not finite, it fails the case."""

    def carry_out(record: CaseRecorder) -> None:
        record.at_most("y", 0.5, 1.0)
        record.at_least("z", 0.4, 0.5, shortfall=Shortfall("it is thin", 0.3))
        record.at_most("x", value, 1.0, shortfall=Shortfall("it is thick", 3.0))

    result = _result(carry_out)
    assert (result.verdict, result.is_met) == (verdict, verdict == "known")
    assert "(known shortfall: it is thick)" in result.measured
    assert result.measured.startswith("FAILS x") is (verdict == "fail")


def _refuse() -> None:
    raise SceneError("The body is empty.")


def _result(carry_out: Callable[[CaseRecorder], None]) -> CaseResult:
    return Case("case", "About.", carry_out).run()


@pytest.mark.parametrize(
    ("act", "verdict"),
    [
        (lambda record: record.at_most("x", 1.0, 1.0), "pass"),
        (lambda record: record.at_most("x", 1.1, 1.0), "fail"),
        (lambda record: record.at_most("x", np.nan, 1.0), "fail"),
        (lambda record: record.at_least("x", 1.0, 1.0), "pass"),
        (lambda record: record.at_least("x", 0.9, 1.0), "fail"),
        (lambda record: record.at_least("x", np.nan, 1.0), "fail"),
        (lambda record: record.within("x", 1.0, 1.0, 2.0), "pass"),
        (lambda record: record.within("x", 2.1, 1.0, 2.0), "fail"),
        (lambda record: record.holds("x", False), "fail"),
        (lambda record: record.refuses("x", "empty", _refuse), "pass"),
        (lambda record: record.refuses("x", "full", _refuse), "fail"),
        (lambda record: record.refuses("x", "empty", lambda: None), "fail"),
        (lambda record: record.remark("x"), "fail"),
    ],
)
def test_verdict_of_a_single_check(act: Callable[[CaseRecorder], None], verdict: str) -> None:
    """A missed bound, a NaN, no refusal or one for another reason, and no check at all fail."""
    result = _result(act)
    assert (result.verdict, result.is_met) == (verdict, verdict == "pass")


def test_an_exception_is_a_failure_of_the_case() -> None:
    """It is named in the measured text, beside the checks before it."""

    def carry_out(record: CaseRecorder) -> None:
        record.at_most("x", 0.5, 1.0)
        raise ZeroDivisionError("by zero")

    assert _result(carry_out).measured == "FAILS ZeroDivisionError: by zero; x 0.5 <= 1"


def test_failed_checks_come_first_and_remarks_last() -> None:
    """One missed check fails the case."""

    def carry_out(record: CaseRecorder) -> None:
        record.remark("z")
        record.at_most("x", 0.5, 1.0)
        record.at_most("y", 2.0, 1.0)

    result = _result(carry_out)
    assert (result.verdict, result.measured) == ("fail", "FAILS y 2 <= 1; x 0.5 <= 1; z")


def test_the_decorator_adds_a_case_to_its_module() -> None:
    """Its summary is the first line of the docstring unless one is given, and arguments are passed on."""

    @case("again", args=(2.0,), summary="Another.")
    @case("first", "a source", "a grid", args=(1.0,), is_fast=False)
    def carry_out(record: CaseRecorder, value: float) -> None:
        """One.

        More.
        """
        record.at_most("x", value, 1.0)

    cases = cases_of(sys.modules[__name__])
    assert [(found.name, found.summary, found.is_fast) for found in cases] == [
        ("first", "One.", False),
        ("again", "Another.", True),
    ]
    assert [found.run().verdict for found in cases] == ["pass", "fail"]
    assert (cases[0].source, cases[0].resolution, cases[0].precision_text) == ("a source", "a grid", "float64")


CASES = [Case(name, "", _refuse, is_fast=name != "slow") for name in ("free-fall", "dam-break", "slow")]


def test_cases_are_selected_by_name_and_glob() -> None:
    """Names and globs add up, in the order of the suite and without repetition."""
    names = [found.name for found in select(CASES, ["slow", "f*", "free-fall"], noun="case")]
    assert names == ["free-fall", "slow"]
    assert [found.name for found in select(CASES, ["*"], noun="case", fast=True)] == ["free-fall", "dam-break"]


def test_a_selection_without_cases_is_refused() -> None:
    """An unknown name is answered with the existing ones; slow cases are not fast."""
    with pytest.raises(UnknownNameError, match=r"hard case.*'free-fal'.*'free-fall'"):
        select(CASES, ["free-fal"], noun="hard case")
    with pytest.raises(UnknownNameError, match="nothing"):
        select(CASES, ["free-fall", "nothing-*"], noun="case")
    with pytest.raises(UsageError, match="slow need longer"):
        select(CASES, ["slow"], noun="case", fast=True)
