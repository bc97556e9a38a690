"""Checks, bounds and the observed order of accuracy."""

import math

import numpy as np
import pytest

from zoobench.verify.validate.base import Check, Figure, Outcome, order_of_accuracy


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
    """The bounds belong to the interval, and read as text."""
    assert Check("x", inside, at_least=low, at_most=high).is_met
    assert not Check("x", outside, at_least=low, at_most=high).is_met
    assert Check("x", inside, at_least=low, at_most=high).bound == text


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_what_is_not_finite_is_never_within_bounds(value: float) -> None:
    """A simulation that blew up does not pass, whichever side the bound is on."""
    assert not Check("x", value, at_most=1.0).is_met
    assert not Check("x", value, at_least=-1.0).is_met


def test_a_check_needs_a_bound() -> None:
    """A number without a bound could not fail."""
    with pytest.raises(ValueError, match="no bound"):
        Check("x", 1.0)


def test_an_outcome_is_met_when_all_its_checks_are() -> None:
    """One missed check misses the case."""
    figure = Figure("t", "x", "y", ())
    good, bad = Check("a", 0.0, at_most=1.0), Check("b", 2.0, at_most=1.0)
    assert Outcome((good,), figure).is_met
    assert not Outcome((good, bad), figure).is_met


def test_order_of_accuracy_is_the_slope_in_logarithms() -> None:
    """Errors that shrink with the square of the spacing have order two, whatever their sign."""
    spacings = np.array([0.1, 0.05, 0.02])
    assert order_of_accuracy(spacings, -3 * spacings**2) == pytest.approx(2.0, rel=1e-12)
