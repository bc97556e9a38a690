"""The validation suite: what it holds, how cases are chosen, and every case that is done in seconds."""

import re

import pytest

from zoobench.errors import UnknownNameError, UsageError
from zoobench.verify.validate import conservation
from zoobench.verify.validate.base import Case
from zoobench.verify.validate.validation_suite import CASES, select

FAST = [case for case in CASES if case.is_fast]
SLOW = [case for case in CASES if not case.is_fast]


def _assert_met(case: Case) -> None:
    outcome = case.run()
    missed = [f"{check.measure}: {check.value:.4g}, {check.bound}" for check in outcome.checks if not check.is_met]
    assert not missed
    assert outcome.seconds > 0
    assert all(len(curve.x) == len(curve.y) > 1 for curve in outcome.figure.curves)


@pytest.mark.parametrize("case", FAST, ids=lambda case: case.name)
def test_fast_case_is_within_its_bounds(case: Case) -> None:
    """Every number that the case measures lies within its bound."""
    _assert_met(case)


@pytest.mark.slow
@pytest.mark.parametrize("case", SLOW, ids=lambda case: case.name)
def test_slow_case_is_within_its_bounds(case: Case) -> None:
    """Likewise for the cases that need longer."""
    _assert_met(case)


def test_wrong_physics_misses_the_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    """Judged by another gravity, or another law of energy, the simulator falls short."""
    monkeypatch.setattr(conservation, "GRAVITY", 9.80)
    assert not next(case for case in CASES if case.name == "free-fall").run().is_met


def test_names_are_unique_and_every_case_names_source_and_resolution() -> None:
    """At least sixteen cases, among them gradients and single precision, each described."""
    names = [case.name for case in CASES]
    assert len(set(names)) == len(names) >= 16
    assert all(re.fullmatch(r"[a-z]+(-[a-z]+)*", name) for name in names)
    assert all(case.source and case.grid and case.precision in (0, 32, 64) for case in CASES)
    assert sum(name.startswith("gradient-") for name in names) >= 5
    assert {case.precision for case in CASES} == {0, 32, 64}


def test_cases_are_chosen_by_name_and_glob() -> None:
    """Names and globs add up, in the suite's order and without repetition."""
    chosen = [case.name for case in select(["gradient-taylor", "free-*", "free-fall"])]
    assert chosen == ["free-fall", "gradient-taylor", "free-fall-single"]
    assert [case.name for case in select(["*"])] == [case.name for case in CASES]
    assert all(case.is_fast for case in select(["*"], fast=True))
    assert len(select(["*"], fast=True)) < len(CASES)


def test_what_cannot_be_chosen_is_refused() -> None:
    """An unknown name is answered with those that exist; slow cases are not fast."""
    with pytest.raises(UnknownNameError, match=r"'free-fal'.*'free-fall'.*Known: bar-mode"):
        select(["free-fal"])
    with pytest.raises(UnknownNameError, match="validation case"):
        select(["free-fall", "nothing-*"])
    with pytest.raises(UsageError, match="dam-break need longer"):
        select(["dam-break"], fast=True)
