"""Limit of a quantity on ever finer grids, and its uncertainty."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from zoobench.arrays import Array

LEAST_ORDER, FORMAL_ORDER = 0.5, 2.0
"""Range of orders: below the least no limit is extrapolated, above the formal one no scheme here converges."""

SAFETY = 1.25
"""Safety factor of the grid convergence index for three grids (Roache 1994)."""


@dataclass(frozen=True)
class Reference:
    """The estimate of a limit.

    Attributes:
        value: by Richardson extrapolation if the three finest levels converge, else that of the finest.
        uncertainty: the grid convergence index in the value's own unit; the spread of the three where they do not
            converge; infinite with fewer than three.
        order: observed, None where they do not converge.
    """

    value: float
    uncertainty: float
    order: float | None

    @property
    def is_converged(self) -> bool:
        """Whether an order could be observed."""
        return self.order is not None


def extrapolate(spacings: Sequence[float], values: Sequence[float]) -> Reference:
    """The limit of values at decreasing grid spacings, from the three finest.

    With f = f0 + C h^p, the ratio of the two differences gives p (Celik et al. 2008, for unequal ratios of spacings).
    The differences must have one sign, and p must reach `LEAST_ORDER`; it is cut at `FORMAL_ORDER`, so that the
    extrapolation never exceeds the accuracy of the scheme (Roache 1994).
    """
    h, f = np.array(spacings[-3:], float), np.array(values[-3:], float)
    if len(f) < 3:
        return Reference(float(f[-1]), math.inf, None)
    coarse, fine = f[1] - f[0], f[2] - f[1]
    ratio = fine / coarse if coarse else math.inf
    order = _order(h, ratio) if ratio > 0.0 else None
    if order is None:
        return Reference(float(f[2]), float(np.ptp(f)), None)
    taken = min(order, FORMAL_ORDER)
    correction = fine / ((h[1] / h[2]) ** taken - 1.0)
    return Reference(float(f[2] + correction), SAFETY * abs(float(correction)), order)


def _order(h: Array, ratio: float) -> float | None:
    """p with (h2^p - h3^p) / (h1^p - h2^p) = ratio; None if it is below `LEAST_ORDER`."""

    def excess(p: float) -> float:
        return float((h[1] ** p - h[2] ** p) / (h[0] ** p - h[1] ** p) - ratio)

    largest = 20.0
    if excess(LEAST_ORDER) < 0.0:
        return None
    return largest if excess(largest) > 0.0 else float(brentq(excess, LEAST_ORDER, largest))
