"""Small dense algebra for kernels, written out by element.

Taichi's own `@` compiles several times slower when it is unrolled.
"""

import taichi as ti


@ti.func
def matmul(a, b):
    """a b for 3x3 matrices."""
    return ti.Matrix([[a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j] for j in range(3)] for i in range(3)])


@ti.func
def matvec(a, x):
    """a x."""
    return ti.Vector([a[i, 0] * x[0] + a[i, 1] * x[1] + a[i, 2] * x[2] for i in range(3)])


@ti.func
def outer(a, b):
    """a b^T."""
    return ti.Matrix([[a[i] * b[j] for j in range(3)] for i in range(3)])


@ti.func
def column(a, j: ti.template()):
    """Column j, known at compile time."""
    return ti.Vector([a[0, j], a[1, j], a[2, j]])


@ti.func
def identity():
    """The 3x3 identity in the default precision."""
    return ti.Matrix([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


@ti.func
def cofactor(a):
    """cof(a) = det(a) a^-T, the derivative of det(a) (Jacobi's formula), finite for singular a."""
    c0, c1, c2 = column(a, 0), column(a, 1), column(a, 2)
    return ti.Matrix.cols([c1.cross(c2), c2.cross(c0), c0.cross(c1)])


@ti.func
def sinhc(x):
    """sinh(x) / x, 1 at 0.

    Below 0.1 by its Taylor series to x^8, which is exact to 1e-16 relative; the quotient would cancel.
    """
    square = x * x
    value = 1.0 + square / 6.0 * (1.0 + square / 20.0 * (1.0 + square / 42.0 * (1.0 + square / 72.0)))
    if ti.abs(x) > 0.1:
        value = 0.5 * (ti.exp(x) - ti.exp(-x)) / x
    return value


@ti.func
def unpack(stored):
    """The symmetric matrix stored as (xx yy zz xy xz yz)."""
    xx, yy, zz, xy, xz, yz = stored[0], stored[1], stored[2], stored[3], stored[4], stored[5]
    return ti.Matrix([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


@ti.func
def pack(a):
    """A symmetric matrix as (xx yy zz xy xz yz)."""
    return ti.Vector([a[0, 0], a[1, 1], a[2, 2], a[0, 1], a[0, 2], a[1, 2]])
