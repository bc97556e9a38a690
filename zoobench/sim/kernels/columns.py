"""Small dense algebra for kernels: a 3x3 matrix is three columns x, y, z of four lanes of which the last is zero.

An operation on a column is one instruction, and compiles several times faster than one on Taichi's own matrices.
"""

import taichi as ti


@ti.func
def lanes(a: ti.template(), b: ti.template(), c: ti.template(), d: ti.template()):
    """A vector of four lanes."""
    return ti.Vector([a, b, c, d])


@ti.func
def zero_lanes():
    """Zero in the default precision."""
    return ti.Vector([0.0, 0.0, 0.0, 0.0])


@ti.func
def spatial(a):
    """The vector with its fourth lane set to zero."""
    return ti.Vector([a[0], a[1], a[2], 0.0])


@ti.func
def dot(a, b):
    """Scalar product of the first three lanes."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@ti.func
def cross(a, b):
    """a x b."""
    return ti.Vector([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0], 0.0])


@ti.func
def matrix(x: ti.template(), y: ti.template(), z: ti.template()):
    """The matrix with these columns."""
    return ti.Struct(x=x, y=y, z=z)


@ti.func
def add(a: ti.template(), b: ti.template()):
    """a + b."""
    return matrix(a.x + b.x, a.y + b.y, a.z + b.z)


@ti.func
def scale(k, a: ti.template()):
    """k a."""
    return matrix(k * a.x, k * a.y, k * a.z)


@ti.func
def diagonal(k):
    """k I."""
    return matrix(lanes(k, 0.0, 0.0, 0.0), lanes(0.0, k, 0.0, 0.0), lanes(0.0, 0.0, k, 0.0))


@ti.func
def matvec(a: ti.template(), x):
    """a x."""
    return a.x * x[0] + a.y * x[1] + a.z * x[2]


@ti.func
def transposed_matvec(a: ti.template(), x):
    """a^T x."""
    return lanes(dot(a.x, x), dot(a.y, x), dot(a.z, x), 0.0)


@ti.func
def matmul(a: ti.template(), b: ti.template()):
    """a b."""
    return matrix(matvec(a, b.x), matvec(a, b.y), matvec(a, b.z))


@ti.func
def transposed_matmul(a: ti.template(), b: ti.template()):
    """a^T b."""
    return matrix(transposed_matvec(a, b.x), transposed_matvec(a, b.y), transposed_matvec(a, b.z))


@ti.func
def matmul_transposed(a: ti.template(), b: ti.template()):
    """a b^T."""
    return matrix(
        a.x * b.x[0] + a.y * b.y[0] + a.z * b.z[0],
        a.x * b.x[1] + a.y * b.y[1] + a.z * b.z[1],
        a.x * b.x[2] + a.y * b.y[2] + a.z * b.z[2],
    )


@ti.func
def transpose(a: ti.template()):
    """a^T."""
    return matrix(
        lanes(a.x[0], a.y[0], a.z[0], 0.0), lanes(a.x[1], a.y[1], a.z[1], 0.0), lanes(a.x[2], a.y[2], a.z[2], 0.0)
    )


@ti.func
def outer(a, b):
    """a b^T."""
    return matrix(a * b[0], a * b[1], a * b[2])


@ti.func
def contract(a: ti.template(), b: ti.template()):
    """a : b, the sum of the products of their elements."""
    return dot(a.x, b.x) + dot(a.y, b.y) + dot(a.z, b.z)


@ti.func
def trace(a: ti.template()):
    """Sum of the diagonal."""
    return a.x[0] + a.y[1] + a.z[2]


@ti.func
def determinant(a: ti.template()):
    """det(a)."""
    return dot(a.x, cross(a.y, a.z))


@ti.func
def cofactor(a: ti.template()):
    """cof(a) = det(a) a^-T, the derivative of det(a) (Jacobi's formula), finite for singular a."""
    return matrix(cross(a.y, a.z), cross(a.z, a.x), cross(a.x, a.y))


@ti.func
def from_symmetric(a):
    """The matrix of a symmetric tensor (xx yy zz xy xz yz)."""
    return matrix(lanes(a[0], a[3], a[4], 0.0), lanes(a[3], a[1], a[5], 0.0), lanes(a[4], a[5], a[2], 0.0))


@ti.func
def to_symmetric(a: ti.template()):
    """A symmetric matrix as (xx yy zz xy xz yz)."""
    return ti.Vector([a.x[0], a.y[1], a.z[2], a.x[1], a.x[2], a.y[2]])
