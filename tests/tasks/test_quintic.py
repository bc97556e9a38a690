"""Quintic polynomials against their states and a known polynomial."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from zoobench.errors import UsageError
from zoobench.tasks.quintic import quintic

_NUMBERS = st.floats(-1.0, 1.0)
_STATES = st.lists(_NUMBERS, min_size=18, max_size=18).map(lambda values: np.reshape(values, (3, 3, 2)))


@settings(deadline=None)  # the first call imports scipy
@given(states=_STATES, spans=st.tuples(st.floats(0.4, 3.0), st.floats(0.4, 3.0)))
def test_it_meets_its_states(states: np.ndarray, spans: tuple[float, float]) -> None:
    """Position, velocity and acceleration at every given time, ends included, to 1e-12."""
    times = np.array([0.0, spans[0], spans[0] + spans[1]])
    path = quintic(times, states)
    np.testing.assert_allclose(path(times), states[:, 0], atol=1e-12)
    np.testing.assert_allclose(path.derivative()(times), states[:, 1], atol=1e-12)
    np.testing.assert_allclose(path.derivative(2)(times), states[:, 2], atol=1e-12)


def test_it_is_the_polynomial_of_degree_five() -> None:
    """Through states of t^5 - 2 t^3 + t it is this polynomial, with its derivatives."""
    curve = np.polynomial.Polynomial([0.0, 1.0, 0.0, -2.0, 0.0, 1.0])
    ends = np.array([-0.5, 1.5])
    states = np.stack([curve(ends), curve.deriv()(ends), curve.deriv(2)(ends)], axis=1)[:, :, None]
    path, times = quintic(ends, states), np.linspace(-0.5, 1.5, 41)
    np.testing.assert_allclose(path(times)[:, 0], curve(times), atol=1e-13)
    np.testing.assert_allclose(path.derivative()(times)[:, 0], curve.deriv()(times), atol=1e-13)
    np.testing.assert_allclose(path.derivative(2)(times)[:, 0], curve.deriv(2)(times), atol=1e-12)


def test_it_is_not_extrapolated() -> None:
    """Outside of its times a path is NaN."""
    path = quintic(np.array([0.0, 1.0]), np.zeros((2, 3, 1)))
    assert np.isnan(path(np.array([-0.1, 1.1]))).all()


@pytest.mark.parametrize(
    ("times", "states"),
    [([0.0], (1, 3, 2)), ([0.0, 0.0], (2, 3, 2)), ([0.0, 1.0], (2, 2, 2)), ([0.0, 1.0], (3, 3, 2))],
)
def test_what_makes_no_path_is_refused(times: list[float], states: tuple[int, ...]) -> None:
    """One state, equal times or another shape."""
    with pytest.raises(UsageError, match="are no path"):
        quintic(np.array(times), np.zeros(states))
