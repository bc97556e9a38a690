"""Limits from sequences whose limit is known."""

import math

import pytest

from zoobench.verify.accuracy.reference import SAFETY, extrapolate

SPACINGS = [1 / 64, 1 / 96, 1 / 128, 1 / 192]


@pytest.mark.parametrize("order", [0.7, 1.0, 1.5, 2.0])
def test_the_limit_and_the_order_of_a_power_law_are_found(order: float) -> None:
    """f = 3 + 5 h^p at unequal ratios of h: 3 and p come out exactly, whatever came before the last three levels."""
    found = extrapolate(SPACINGS, [7.0, *(3.0 + 5.0 * h**order for h in SPACINGS[1:])])
    assert found.order == pytest.approx(order, abs=1e-9)
    assert found.value == pytest.approx(3.0, abs=1e-12)
    assert found.uncertainty == pytest.approx(SAFETY * 5.0 * SPACINGS[-1] ** order)


@pytest.mark.parametrize("values", [[1.0, 2.0, 1.5], [1.0, 2.0, 4.5], [1.0, 1.0, 2.0]])
def test_what_does_not_converge_has_a_spread_and_no_order(values: list[float]) -> None:
    """Swinging, growing apart, or coming from nowhere: the finest value, known to within the spread of the three."""
    found = extrapolate(SPACINGS[1:], values)
    assert not found.is_converged
    assert found.value == values[-1]
    assert found.uncertainty == max(values) - min(values)


def test_an_order_too_low_to_extrapolate_is_no_convergence() -> None:
    """With p = 0.3 the limit would lie many times the last difference away."""
    assert not extrapolate(SPACINGS[1:], [3.0 + 5.0 * h**0.3 for h in SPACINGS[1:]]).is_converged


def test_the_extrapolation_is_never_bolder_than_the_scheme() -> None:
    """A sequence of order 4 is extrapolated as one of order 2: further, not nearer."""
    spacings = SPACINGS[1:]
    values = [3.0 + 5e4 * h**4 for h in spacings]
    found = extrapolate(spacings, values)
    assert found.order == pytest.approx(4.0, abs=1e-6)
    by_two = values[2] + (values[2] - values[1]) / ((spacings[1] / spacings[2]) ** 2 - 1)
    assert found.value == pytest.approx(by_two)


def test_two_levels_say_nothing_about_the_limit() -> None:
    """The finest value, of unknown uncertainty."""
    found = extrapolate(SPACINGS[:2], [1.0, 2.0])
    assert (found.value, found.uncertainty, found.order) == (2.0, math.inf, None)
