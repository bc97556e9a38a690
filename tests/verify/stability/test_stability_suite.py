"""Every hard case passes; the fast ones here, the others with `pytest -m slow`."""

import pytest

from zoobench.errors import UnknownNameError, UsageError
from zoobench.verify.stability.base import Case
from zoobench.verify.stability.stability_suite import stability, stored, suite

FAST = [found for found in suite() if found.is_fast]
SLOW = [found for found in suite() if not found.is_fast]


def _check(found: Case) -> None:
    result = found.run()
    assert result.passed, result.measured


@pytest.mark.parametrize("found", FAST, ids=lambda found: found.name)
def test_fast_case_passes(found: Case) -> None:
    """Every figure of the case is within its bound."""
    _check(found)


@pytest.mark.slow
@pytest.mark.parametrize("found", SLOW, ids=lambda found: found.name)
def test_slow_case_passes(found: Case) -> None:
    """Every figure of the case is within its bound."""
    _check(found)


def test_the_suite_is_large_enough_and_described() -> None:
    """At least 25 cases, each with a line about it, of which most are fast."""
    assert len(suite()) >= 25
    assert all(found.about.endswith(".") for found in suite())
    assert len(FAST) >= 25


def test_cases_are_chosen_by_globs() -> None:
    """In the suite's order; a name that matches nothing is a usage error with a suggestion; slow cases are not fast."""
    names = [result.case for result in stability(["one-particle", "bad-*"], fast=True)]
    assert names == ["bad-matter", "bad-actuation", "one-particle"]
    with pytest.raises(UnknownNameError, match="bad-matter"):
        stability(["bad-mater"])
    with pytest.raises(UsageError, match="dam-break need longer"):
        stability(["dam-break"], fast=True)


def test_a_result_is_stored_with_all_that_was_measured() -> None:
    """The row's document holds every column but the case's name and verdict."""
    (result,) = stability(["one-particle"])
    row = stored(result)
    assert (row.case, row.verdict) == ("one-particle", "pass")
    assert set(row.document) >= {
        "measured",
        "smallest_j",
        "step",
        "step_fraction",
        "retries",
        "guarded_share",
        "seconds",
    }
    assert row.document["step"] > 0
