"""The validation suite: its cases, all within their bounds; the fast ones here, the others with `pytest -m slow`."""

import re

import pytest

from zoobench.verify.cases import Case
from zoobench.verify.validate import conservation
from zoobench.verify.validate.validation_suite import CASES


@pytest.mark.parametrize(
    "case", [pytest.param(case, id=case.name, marks=() if case.is_fast else pytest.mark.slow) for case in CASES]
)
def test_case_is_within_its_bounds(case: Case) -> None:
    """Every number that the case measures lies within its bound, and a figure shows it."""
    result = case.run()
    assert result.is_met, result.measured
    assert result.seconds > 0
    assert result.figure is not None
    assert result.figure.curves
    assert all(len(curve.x) == len(curve.y) > 1 for curve in result.figure.curves)


def test_wrong_physics_misses_the_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    """Compared with another gravity, the simulator fails."""
    monkeypatch.setattr(conservation, "GRAVITY", 9.80)
    result = next(case for case in CASES if case.name == "free-fall").run()
    assert "FAILS centre of mass off the discrete path" in result.measured


def test_names_are_unique_and_every_case_names_source_and_resolution() -> None:
    """At least sixteen cases, among them gradients and single precision, each described."""
    names = [case.name for case in CASES]
    assert len(set(names)) == len(names) >= 16
    assert all(re.fullmatch(r"[a-z]+(-[a-z]+)*", name) for name in names)
    assert all(case.summary and case.source and case.resolution and case.precision in (0, 32, 64) for case in CASES)
    assert sum(name.startswith("gradient-") for name in names) >= 5
    assert {case.precision for case in CASES} == {0, 32, 64}
