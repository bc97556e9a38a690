"""AFLIP: particles keep most of the motion that the grid does not resolve, of velocity and affine field alike.

Scattering a particle's motion u = (v, C) and gathering it again is a map P on the particles' motions. It is symmetric
in their kinetic energy m (v^2 + M |C|^2) / 2, as gathering is the transpose of scattering, and its eigenvalues lie
between 0 and 1: a resolved motion has 1, what the grid cannot hold has 0. A particle takes the grid's motion after the
forces and a share of the rest, u <- P u' + share (u - P u). Without forces that is P + share (1 - P), symmetric too and
never adding energy: with share 0 it is APIC, with 1 nothing is lost.

Fei et al. (2021) keep the rest of v alone. That map is not symmetric, and adds energy where motion is violent: a cube
that lands at 0.9 cells a step had 3.5 times its energy then, and has 1.00 times with the affine rest kept as well.

As P keeps affine motions, the rest has no first moment, sum m (v_rest x^T + M C_rest) = 0. Particles move with the
grid, and where that turns them with the spin W, x <- (1 + dt W) x, the rest of C must turn, too, C_rest (1 + dt W)^T.
Else a body loses angular momentum: a spinning disc 0.7 % of it, and 1.3 % of its energy, in a revolution; with it 4e-7
and 3e-4. To follow the whole gradient in place of W would keep even that, but stretching adds to the rest's energy.

The nodes' velocity before forces and contact comes from a field of its own, BEFORE, into which the particles' motion is
scattered without stress. The correction of positions of Fei et al. is left out.
"""

import taichi as ti

from zoobench.sim.kernels.columns import add, dot, matmul, matmul_transposed, scale, transpose, transposed_matmul
from zoobench.sim.kernels.layout import BEFORE

FLIP_SHARE = 0.95
"""Share of the unresolved motion that is kept in a substep [-].

Noise dies within some twenty substeps. Of the muscles' work on the ground at draft 2.6 % is lost without a cause, 1.2 %
with 0.99, 6 % with 0.8 and 14.6 % with APIC.
"""


@ti.func
def spin(rate: ti.template()):
    """The antisymmetric part of a velocity gradient."""
    return scale(0.5, add(rate, scale(-1.0, transpose(rate))))


@ti.func
def kept_affine(affine: ti.template(), before: ti.template(), rate: ti.template(), dt):
    """What a particle keeps of its affine field in a substep in which the grid moves it with the gradient `rate`."""
    rest = add(affine, scale(-1.0, before))
    return scale(FLIP_SHARE, add(rest, scale(dt, matmul_transposed(rest, spin(rate)))))


@ti.func
def kept_affine_adjoint(
    affine: ti.template(), before: ti.template(), rate: ti.template(), dt, adjoint: ti.template()
):  # fmt: skip
    """Adjoint of `kept_affine`: by `affine`, which is that by `before` with the other sign, and by `rate`."""
    rest = add(affine, scale(-1.0, before))
    by_rest = scale(FLIP_SHARE, add(adjoint, scale(dt, matmul(adjoint, spin(rate)))))
    return by_rest, scale(FLIP_SHARE * dt, spin(transposed_matmul(adjoint, rest)))


@ti.func
def divide_node(grid: ti.template(), node):
    """Momentum to velocity at `node`."""
    q = grid[BEFORE, node]
    if q[3] > 0.0:
        r = 1.0 / q[3]
        grid[BEFORE, node] = ti.Vector([q[0] * r, q[1] * r, q[2] * r, q[3]])


@ti.func
def divide_node_adjoint(grid: ti.template(), node, grid_adjoint: ti.template(), m):
    """Adjoint of `divide_node`, whose result is at `node`, at node m; an empty node has no derivative."""
    q = grid[BEFORE, node]
    adjoint = ti.Vector([0.0, 0.0, 0.0, 0.0])
    if q[3] > 0.0:
        # v = q / m: dv/dq = 1 / m and dv/dm = -v / m
        a = grid_adjoint[BEFORE, m] * (1.0 / q[3])
        adjoint = ti.Vector([a[0], a[1], a[2], -dot(a, q)])
    grid_adjoint[BEFORE, m] = adjoint
