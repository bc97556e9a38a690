"""Symmetric 3x3 matrices in kernels as 6-vectors (xx yy zz xy xz yz).

An adjoint A of a symmetric matrix b is symmetric too, with dL = A : db: entries off the diagonal count twice.
"""

import taichi as ti

SMALLEST_DEVIATOR = 1e-18
"""Size below which a deviator is not scaled up to find its eigenvectors: its square is still a 32-bit number."""


@ti.func
def unit():
    """The identity."""
    return ti.Vector([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])


@ti.func
def trace_of(a):
    """tr a."""
    return a[0] + a[1] + a[2]


@ti.func
def double_dot(a, b):
    """a : b, over all nine entries."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + 2.0 * (a[3] * b[3] + a[4] * b[4] + a[5] * b[5])


@ti.func
def deviator(a):
    """a - tr(a) / 3 I."""
    return a - trace_of(a) / 3.0 * unit()


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
    return ti.Vector([trace_of(a), trace_of(cof), a[0] * cof[0] + a[3] * cof[3] + a[4] * cof[4]])


@ti.func
def dyad(frame, i: ti.template(), j: ti.template()):
    """(u_i u_j^T + u_j u_i^T) / 2 of two columns of a matrix, known at compile time."""
    x, y, z = 0.5 * frame[0, j], 0.5 * frame[1, j], 0.5 * frame[2, j]
    a, b, c = frame[0, i], frame[1, i], frame[2, i]
    return ti.Vector([2.0 * a * x, 2.0 * b * y, 2.0 * c * z, a * y + b * x, a * z + c * x, b * z + c * y])


@ti.func
def _isolated_root(a):
    """The eigenvalue farthest from the two others of a matrix a with tr a = 0 and a : a = 6."""
    cof = cofactors(a)
    det = a[0] * cof[0] + a[3] * cof[3] + a[4] * cof[4]
    half = ti.min(0.5 * ti.abs(det), 1.0)
    # |x| = 2 c with 4 c^3 - 3 c = |det a| / 2 and c from sqrt(3)/2 to 1: Newton's method from within 1e-3, three times
    c = 0.8660254 + half * (0.1666667 - 0.0326921 * half)
    for _ in ti.static(range(3)):
        c = (8.0 * c * c * c + half) / (12.0 * c * c - 3.0)
    return ti.select(det < 0.0, -2.0 * c, 2.0 * c)


@ti.func
def _isolated_vector(a):
    """Unit eigenvector of the eigenvalue that lies farthest from the two others; any for a multiple of I."""
    shear = deviator(a)
    scaled = shear / ti.max(ti.sqrt(double_dot(shear, shear) / 6.0), SMALLEST_DEVIATOR)
    # the cofactors of a matrix of rank 2 are a multiple of v v^T; its longest column
    cof = cofactors(scaled - _isolated_root(scaled) * unit())
    v = ti.Vector([cof[0], cof[3], cof[4]])
    if cof[1] > cof[0] and cof[1] >= cof[2]:
        v = ti.Vector([cof[3], cof[1], cof[5]])
    elif cof[2] > cof[0]:
        v = ti.Vector([cof[4], cof[5], cof[2]])
    return v / ti.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])


@ti.func
def eigen_symmetric(a):
    """Eigenvalues, and eigenvectors as the columns of a matrix, without iteration (after Eberly 2014).

    The eigenvalue that is farthest from the others is well conditioned, and so is its eigenvector; in the plane across
    it one Jacobi rotation gives the others, however close they are.
    """
    v = _isolated_vector(a)
    # two vectors across v (Duff et al. 2017)
    side = ti.select(v[2] < 0.0, -1.0, 1.0)
    scale = -1.0 / (side + v[2])
    across = v[0] * v[1] * scale
    frame = ti.Matrix(
        [
            [v[0], 1.0 + side * v[0] * v[0] * scale, across],
            [v[1], side * across, side + v[1] * v[1] * scale],
            [v[2], -side * v[0], -v[1]],
        ]
    )
    values = ti.Vector([double_dot(a, dyad(frame, k, k)) for k in ti.static(range(3))])
    coupling = double_dot(a, dyad(frame, 1, 2))
    if coupling != 0.0:
        # t = tan of the smaller angle that annihilates it, without cancellation (Golub and Van Loan, 8.5)
        theta = (values[2] - values[1]) / (2.0 * coupling)
        t = ti.select(theta < 0.0, -1.0, 1.0) / (ti.abs(theta) + ti.sqrt(theta * theta + 1.0))
        cosine = 1.0 / ti.sqrt(t * t + 1.0)
        values += t * coupling * ti.Vector([0.0, -1.0, 1.0])
        for i in ti.static(range(3)):
            first, second = frame[i, 1], frame[i, 2]
            frame[i, 1] = cosine * (first - t * second)
            frame[i, 2] = cosine * (t * first + second)
    return values, frame


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
