"""Power series of symmetric matrices near zero, in kernels, with their adjoint.

A power series of a 3x3 matrix E is c0 I + c1 E + c2 E^2 with scalars c0, c1, c2: by the theorem of Cayley and Hamilton,
E^3 = I1 E^2 - I2 E + I3 I, every higher power is a sum of lower ones. Horner's scheme then runs on three numbers.
"""

import math
from collections.abc import Mapping

import taichi as ti
from taichi.lang import impl

from zoobench.sim.kernels.symmetric import both_products, double_dot, trace_of, unit

Numbers = tuple[float, ...]

NEAR = 0.1
"""Frobenius norm of E below which the series of the laws hold. Beds in use have |b - I| below 0.07."""


def _root(order: int) -> Numbers:
    numbers = [0.0, 0.5]
    for k in range(2, order + 1):
        numbers.append(-numbers[-1] * (2 * k - 3) / (2 * k))
    return tuple(numbers)


# By precision, each so long that the first term left out is below half a rounding of 1: with x = |E|, of the logarithm
# x^7 / 14 and x^15 / 30, of the root 0.02 x^6 and 0.006 x^14, of the exponential, whose argument is at most
# -log(1 - x) as no return lengthens a deviator, y^6 / 6! and y^10 / 10!.
HALF_LOGARITHM = {
    bits: (0.0, *(0.5 * (-1.0) ** (k + 1) / k for k in range(1, order + 1))) for bits, order in ((32, 6), (64, 14))
}
"""log(1 + x) / 2"""
ROOT = {32: _root(5), 64: _root(13)}
"""sqrt(1 + x) - 1"""
EXPONENTIAL = {bits: tuple(1.0 / math.factorial(k) for k in range(order + 1)) for bits, order in ((32, 5), (64, 9))}
"""exp(x)"""


def by_precision(tables: Mapping[int, Numbers]) -> Numbers:
    """The table for the default precision, while a kernel is compiled."""
    return tables[64 if impl.get_runtime().default_fp == ti.f64 else 32]


@ti.func
def series(inv, numbers: ti.template()):
    """(c0, c1, c2) of sum_k numbers[k] E^k for the invariants of E; at least three numbers, known at compile time."""
    last = ti.static(len(numbers) - 1)
    c0, c1, c2 = 0.0 * inv[0] + numbers[last - 2], 0.0 * inv[0] + numbers[last - 1], 0.0 * inv[0] + numbers[last]
    for k in ti.static(range(last - 3, -1, -1)):
        c0, c1, c2 = _horner(c0, c1, c2, inv, numbers[k])
    return ti.Vector([c0, c1, c2])


@ti.func
def _horner(c0, c1, c2, inv, number):
    """number I + E (c0 I + c1 E + c2 E^2) as such a sum again."""
    return inv[2] * c2 + number, c0 - inv[1] * c2, c1 + inv[0] * c2


@ti.func
def series_adjoint(E, E2, inv, numbers: ti.template(), adjoint):
    """Adjoint by E of its power series `numbers`; E2 is the square of E and `inv` its invariants."""
    last = ti.static(len(numbers) - 1)
    c0, c1, c2 = 0.0 * inv[0] + numbers[last - 2], 0.0 * inv[0] + numbers[last - 1], 0.0 * inv[0] + numbers[last]
    before = ti.Vector([0.0 for _ in range(last - 2)])  # c2 before each step of Horner's scheme
    for k in ti.static(range(last - 3, -1, -1)):
        before[k] = c2
        c0, c1, c2 = _horner(c0, c1, c2, inv, numbers[k])
    q0, q1, q2 = trace_of(adjoint), double_dot(adjoint, E), double_dot(adjoint, E2)
    first, second, third = 0.0 * q0, 0.0 * q0, 0.0 * q0
    for k in ti.static(range(last - 2)):
        first += q2 * before[k]
        second -= q1 * before[k]
        third += q0 * before[k]
        q0, q1, q2 = q1, q2, inv[2] * q0 - inv[1] * q1 + inv[0] * q2
    # dI1 = I : dE, dI2 = (I1 I - E) : dE, dI3 = cof(E) : dE with cof(E) = E^2 - I1 E + I2 I
    direct = c1 * adjoint + c2 * both_products(E, adjoint)
    slope = second + inv[0] * third
    return direct + third * E2 - slope * E + (first + inv[0] * second + inv[1] * third) * unit()
