"""Driven bodies do what they are driven to, or their case fails."""

import pytest

from zoobench.verify.cases import Case, CaseRecorder
from zoobench.verify.validate import footings, speed_control


def _push(record: CaseRecorder) -> None:
    footings.pushed(record, "2 cells", 2, 0.5)


def test_a_footing_goes_as_deep_as_it_is_pushed() -> None:
    """Its depth and its speed, read from its particles, are those that were wished."""
    result = Case("push", "", _push).run()
    assert result.verdict == "pass", result.measured


def test_a_rig_that_falls_short_of_its_wish_fails_its_case(monkeypatch: pytest.MonkeyPatch) -> None:
    """A velocity that is set between substeps is not that of the motion: the footing reaches half of its depth."""
    monkeypatch.setattr(speed_control, "_PROPORTIONAL", 1.0)
    monkeypatch.setattr(speed_control, "_INTEGRAL", 0.0)
    result = Case("push", "", _push).run()
    assert result.verdict == "fail"
    assert result.measured.startswith("FAILS way made by that wished, 2 cells")
    assert result.checks[0].value == pytest.approx(0.5, abs=0.05)
