"""Small dense algebra for kernels, written out by element.

Taichi's own `@` compiles several times slower when it is unrolled, and its `sym_eig` has errors of 3e-2 near equal
eigenvalues, which are the usual ones of sand: its elastic strains are small.
"""

import taichi as ti

LARGEST_SWEEPS = 8
"""Sweeps of Jacobi rotations; convergence is quadratic, so that two or three are usual and five do for strains of 1."""


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
def assemble(frame, values):
    """U diag(values) U^T: the symmetric matrix with these eigenvectors (columns of U) and eigenvalues."""
    return matmul(ti.Matrix([[frame[i, j] * values[j] for j in range(3)] for i in range(3)]), frame.transpose())


@ti.func
def cofactor(a):
    """cof(a) = det(a) a^-T, the derivative of det(a) (Jacobi's formula), finite for singular a."""
    c0, c1, c2 = column(a, 0), column(a, 1), column(a, 2)
    return ti.Matrix.cols([c1.cross(c2), c2.cross(c0), c0.cross(c1)])


@ti.func
def _rotate(a, u, p: ti.template(), q: ti.template(), r: ti.template()):
    """One Jacobi rotation that annihilates a_pq; r is the third index."""
    apq = a[p, q]
    if apq != 0.0:
        # t = tan of the smaller angle that annihilates a_pq, without cancellation (Golub and Van Loan, 8.5)
        theta = (a[q, q] - a[p, p]) / (2.0 * apq)
        t = 1.0 / (ti.abs(theta) + ti.sqrt(theta * theta + 1.0))
        if theta < 0.0:
            t = -t
        c = 1.0 / ti.sqrt(t * t + 1.0)
        s = t * c
        a[p, p] -= t * apq
        a[q, q] += t * apq
        a[p, q] = 0.0
        # rows and columns p and q of the third index, in the upper triangle alone
        arp, arq = a[r, p], a[r, q]
        if ti.static(r < p):
            arp, arq = a[r, p], a[r, q]
            a[r, p] = c * arp - s * arq
            a[r, q] = s * arp + c * arq
        elif ti.static(r < q):
            arp, arq = a[p, r], a[r, q]
            a[p, r] = c * arp - s * arq
            a[r, q] = s * arp + c * arq
        else:
            arp, arq = a[p, r], a[q, r]
            a[p, r] = c * arp - s * arq
            a[q, r] = s * arp + c * arq
        for i in ti.static(range(3)):
            up, uq = u[i, p], u[i, q]
            u[i, p] = c * up - s * uq
            u[i, q] = s * up + c * uq
    return a, u


@ti.func
def eigen_symmetric(a):
    """Eigenvalues and eigenvectors (as columns) of a symmetric 3x3 matrix by cyclic Jacobi rotations.

    Golub and Van Loan, Matrix Computations, 8.5; only the upper triangle is read.
    """
    u = identity()
    trace = a.trace()
    sweep = 0
    # converged when the off-diagonal is lost in rounding beside the trace, in either precision; b is positive definite
    while sweep < LARGEST_SWEEPS and trace + ti.abs(a[0, 1]) + ti.abs(a[0, 2]) + ti.abs(a[1, 2]) > trace:
        a, u = _rotate(a, u, 0, 1, 2)
        a, u = _rotate(a, u, 0, 2, 1)
        a, u = _rotate(a, u, 1, 2, 0)
        sweep += 1
    return ti.Vector([a[0, 0], a[1, 1], a[2, 2]]), u


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
