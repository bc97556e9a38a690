"""The probe and the case: no check that cannot fail, and no failure that goes unseen."""

import numpy as np
import pytest

from zoobench.errors import SceneError
from zoobench.verify.stability.base import Case, Probe


def _refuse() -> None:
    raise SceneError("The body is empty.")


def _result(carry_out: object) -> tuple[str, str]:
    result = Case("case", "About.", carry_out, is_fast=True).run()  # type: ignore[arg-type]
    return result.verdict, result.measured


@pytest.mark.parametrize(
    ("act", "verdict"),
    [
        (lambda probe: probe.below("x", 1.0, 1.0), "pass"),
        (lambda probe: probe.below("x", 1.1, 1.0), "fail"),
        (lambda probe: probe.below("x", np.nan, 1.0), "fail"),
        (lambda probe: probe.above("x", 1.0, 1.0), "pass"),
        (lambda probe: probe.above("x", 0.9, 1.0), "fail"),
        (lambda probe: probe.above("x", np.nan, 1.0), "fail"),
        (lambda probe: probe.holds("x", False), "fail"),
        (lambda probe: probe.refuses("x", "empty", _refuse), "pass"),
        (lambda probe: probe.refuses("x", "full", _refuse), "fail"),
        (lambda probe: probe.refuses("x", "empty", lambda: None), "fail"),
        (lambda probe: probe.remark("x"), "fail"),
    ],
)
def test_verdict_of_a_single_check(act: object, verdict: str) -> None:
    """A bound that is missed, a NaN, a refusal that does not come or for another reason, and no check at all fail."""
    assert _result(act)[0] == verdict


def test_an_exception_is_a_failure_of_the_case() -> None:
    """It is named in what was measured, beside what was found before."""

    def carry_out(probe: Probe) -> None:
        probe.below("x", 0.5, 1.0)
        raise ZeroDivisionError("by zero")

    verdict, measured = _result(carry_out)
    assert verdict == "fail"
    assert "ZeroDivisionError: by zero" in measured
    assert "x 0.5 <= 1" in measured


def test_what_falls_short_comes_first() -> None:
    """In a long line the reader meets the failure at once."""

    def carry_out(probe: Probe) -> None:
        probe.below("x", 0.5, 1.0)
        probe.below("y", 2.0, 1.0)

    assert _result(carry_out) == ("fail", "FAILS y 2 <= 1; x 0.5 <= 1")
