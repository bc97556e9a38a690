"""Driven bodies do what they are driven to, or their case fails."""

import pytest

from zoobench_verify.cases import Case, CaseRecorder
from zoobench_verify.validate import elements, footings, speed_control, swimming


def _push(record: CaseRecorder) -> None:
    footings.pushed(record, "2 cells", 2, 0.5)


@pytest.mark.slow
def test_a_footing_goes_as_deep_as_it_is_pushed() -> None:
    """Its depth and its speed, read from its particles, are those that were wished."""
    result = Case("push", "", _push).run()
    assert result.verdict == "pass", result.measured


@pytest.mark.slow
def test_a_rig_that_falls_short_of_its_wish_fails_its_case(monkeypatch: pytest.MonkeyPatch) -> None:
    """A velocity that is set between substeps is not that of the motion: the footing reaches half of its depth."""
    monkeypatch.setattr(speed_control, "_PROPORTIONAL", 1.0)
    monkeypatch.setattr(speed_control, "_INTEGRAL", 0.0)
    result = Case("push", "", _push).run()
    assert result.verdict == "fail"
    assert result.measured.startswith("FAILS way made by that wished, 2 cells")
    assert result.checks[0].value == pytest.approx(0.5, abs=0.05)


def test_a_particle_too_light_to_be_driven_fails_its_case(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its own stress moves it, so that it does not deform as prescribed."""
    case = Case("clay", "", elements.clay_shear)
    assert case.run().verdict == "pass"
    monkeypatch.setattr(elements, "_HEAVY", 1e3)
    assert "FAILS deformation off that prescribed" in case.run().measured


@pytest.mark.slow
def test_a_plate_makes_the_wave_that_it_is_drawn_to(monkeypatch: pytest.MonkeyPatch) -> None:
    """By a spring of a third of the rate the wave is off by more than a case forgives."""
    assert swimming._swim(8.0, -1.0, 0.5).wave == pytest.approx(1.0, abs=speed_control.TOLERANCE / 2)
    monkeypatch.setattr(swimming, "_SPRING", 300.0)
    assert swimming._swim(8.0, -1.0, 0.5).wave > 1.0 + speed_control.TOLERANCE
