"""Paths of quintic polynomials through given states (SoftZoo's paper, A.3)."""

from typing import TYPE_CHECKING

import numpy as np

from zoobench.arrays import Array
from zoobench.errors import UsageError

if TYPE_CHECKING:
    from scipy.interpolate import BPoly


def quintic(times: Array, states: Array) -> "BPoly":
    """The path through states as a function of time, with a polynomial of degree five between each two of them.

    Position, velocity and acceleration are continuous and take the given values at the given times. The path and its
    derivatives are NaN before the first state and after the last.

    Args:
        times: `[states]` [s], increasing.
        states: `[states, 3, dimensions]`: position [m], velocity [m/s], acceleration [m/s^2].

    Raises:
        UsageError: fewer than two states, other shapes, or times that do not increase.
    """
    if len(times) < 2 or states.ndim != 3 or states.shape[:2] != (len(times), 3) or not (np.diff(times) > 0).all():
        raise UsageError(
            f"States of shape {states.shape} at {len(times)} times are no path. Give position, velocity and "
            "acceleration at two or more times, each later than the one before."
        )
    from scipy.interpolate import BPoly

    # the Bernstein coefficients follow from the derivatives at both ends without a linear system or cancellation
    return BPoly.from_derivatives(times, states, extrapolate=False)
