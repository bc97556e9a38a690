"""Paths of quintic polynomials through given states (specification A.3)."""

import numpy as np

from zoobench.arrays import Array
from zoobench.errors import UsageError


class Quintic:
    """A path through states, with a polynomial of degree five in time between each two of them.

    Position, velocity and acceleration are continuous and take the given values at the given times.

    Args:
        times: `[states]` [s], increasing.
        states: `[states, 3, dimensions]`: position [m], velocity [m/s], acceleration [m/s^2].

    Raises:
        UsageError: fewer than two states, other shapes, or times that do not increase.
    """

    def __init__(self, times: Array, states: Array) -> None:
        if len(times) < 2 or states.ndim != 3 or states.shape[:2] != (len(times), 3) or not (np.diff(times) > 0).all():
            raise UsageError(
                f"States of shape {states.shape} at {len(times)} times are no path. Give position, velocity and "
                "acceleration at two or more times, each later than the one before."
            )
        from scipy.interpolate import BPoly

        # the Bernstein coefficients follow from the derivatives at both ends without a linear system or cancellation
        self._curve = BPoly.from_derivatives(times, states, extrapolate=False)

    def position(self, times: Array) -> Array:
        """`[times, dimensions]` [m]; NaN before the first state and after the last."""
        result: Array = self._curve(times)
        return result

    def velocity(self, times: Array) -> Array:
        """`[times, dimensions]` [m/s]; NaN outside of the path."""
        result: Array = self._curve.derivative()(times)
        return result

    def acceleration(self, times: Array) -> Array:
        """`[times, dimensions]` [m/s^2]; NaN outside of the path."""
        result: Array = self._curve.derivative(2)(times)
        return result
