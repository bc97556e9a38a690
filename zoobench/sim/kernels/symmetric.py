"""Symmetric 3x3 matrices in kernels as 6-vectors (xx yy zz xy xz yz), and power series of them.

An adjoint A of a symmetric matrix b is symmetric too, with dL = A : db: entries off the diagonal count twice.

A power series of a matrix E is c0 I + c1 E + c2 E^2 with scalars c0, c1, c2: by the theorem of Cayley and Hamilton,
E^3 = I1 E^2 - I2 E + I3 I, every higher power is a sum of lower ones. Horner's scheme then runs on three numbers.
"""

from collections.abc import Mapping

import taichi as ti
from taichi.lang import impl


def by_precision(tables: Mapping[int, tuple[float, ...]]) -> tuple[float, ...]:
    """The table for the default precision, while a kernel is compiled."""
    return tables[64 if impl.get_runtime().default_fp == ti.f64 else 32]


@ti.func
def unit():
    """The identity."""
    return ti.Vector([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])


@ti.func
def trace(a):
    """tr a."""
    return a[0] + a[1] + a[2]


@ti.func
def contract(a, b):
    """a : b, over all nine entries."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + 2.0 * (a[3] * b[3] + a[4] * b[4] + a[5] * b[5])


@ti.func
def deviator(a):
    """a - tr(a) / 3 I."""
    return a - trace(a) / 3.0 * unit()


@ti.func
def cofactors(a):
    """cof(a), the derivative of det(a); for invertible a it is det(a) a^-1."""
    return ti.Vector(
        [
            a[1] * a[2] - a[5] * a[5],
            a[0] * a[2] - a[4] * a[4],
            a[0] * a[1] - a[3] * a[3],
            a[4] * a[5] - a[3] * a[2],
            a[3] * a[5] - a[1] * a[4],
            a[3] * a[4] - a[0] * a[5],
        ]
    )


@ti.func
def square(a):
    """a a."""
    xy, xz, yz = a[3] * a[3], a[4] * a[4], a[5] * a[5]
    return ti.Vector(
        [
            a[0] * a[0] + xy + xz,
            xy + a[1] * a[1] + yz,
            xz + yz + a[2] * a[2],
            (a[0] + a[1]) * a[3] + a[4] * a[5],
            (a[0] + a[2]) * a[4] + a[3] * a[5],
            (a[1] + a[2]) * a[5] + a[3] * a[4],
        ]
    )


@ti.func
def both_products(a, b):
    """a b + b a."""
    xy, xz, yz = a[3] * b[3], a[4] * b[4], a[5] * b[5]
    return ti.Vector(
        [
            2.0 * (a[0] * b[0] + xy + xz),
            2.0 * (xy + a[1] * b[1] + yz),
            2.0 * (xz + yz + a[2] * b[2]),
            (a[0] + a[1]) * b[3] + a[3] * (b[0] + b[1]) + a[4] * b[5] + a[5] * b[4],
            (a[0] + a[2]) * b[4] + a[4] * (b[0] + b[2]) + a[3] * b[5] + a[5] * b[3],
            (a[1] + a[2]) * b[5] + a[5] * (b[1] + b[2]) + a[3] * b[4] + a[4] * b[3],
        ]
    )


@ti.func
def invariants(a):
    """I1 = tr a, I2 = tr cof(a), I3 = det a."""
    cof = cofactors(a)
    return ti.Vector([trace(a), trace(cof), a[0] * cof[0] + a[3] * cof[3] + a[4] * cof[4]])


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
    q0, q1, q2 = trace(adjoint), contract(adjoint, E), contract(adjoint, E2)
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
