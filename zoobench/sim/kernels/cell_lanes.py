"""The cells of a body in its rest frame, as kernels see them: from particles to nodes and back.

The eight particles of a cell are the lanes of a vector (`wide`), in which matrices are lists of rows. A force is summed
over them with the nodes in the lanes.

    nodes    [slots, worlds, nodes, 4] rows of a node: X, V and what the substep from this slot found, FORCE and
             LAYER_FORCE
    law      [worlds, cells, 7] of the lanes of a cell, rows below
    inverse  [worlds, nodes] one over the mass of the nodes [1/kg], 0 without any
    sums     [worlds, cells, 6] adjoints of volume, stiffness, tension and fibre of the lanes of a cell
"""

import taichi as ti

from zoobench.sim.kernels.layout import MASS, STIFFNESS, TENSION, VOLUME, while_compiling
from zoobench.sim.model.rest_cells import LANES, WEAKEST

FORCE, LAYER_FORCE = 2, 3
"""Rows of a node beside X and V: internal force [N], and force of the ground's skin [N]."""

OF_VOLUME, OF_MU, OF_LAM, OF_TENSION, OF_FIBRE = 0, 1, 2, 3, 4
"""Rows of `law`: volume [m^3], Lame parameters and tension [Pa], and three of the fibre."""

BY_VOLUME, BY_STIFFNESS, BY_TENSION, BY_FIBRE = 0, 1, 2, 3
"""Rows of `sums`, three of the fibre."""

WEAK, WEAKNESS = WEAKEST, 0.01
"""Largest number of a weak point, whose particle is as far below it, and its volume by that of the particle: enough to
hold nodes with a 64th of the particle's mass, and too little for the bound on the step."""


@while_compiling
@ti.data_oriented
class Cells:
    """The arrays of a body's cells as one argument: those of `model.rest_cells`, and what is gathered from particles.

    `turned` is `slopes` with nodes in the lanes `[shapes, 24]`, by lane and axis.
    """

    def __init__(self, node, particle, shape, slopes, turned, masses, weights, law, inverse):
        self.node, self.particle, self.shape = node, particle, shape
        self.slopes, self.turned, self.masses, self.weights = slopes, turned, masses, weights
        self.law, self.inverse = law, inverse


@ti.func
def lanes_of(value):
    """A vector with the same number in every lane."""
    return ti.Vector([value, value, value, value, value, value, value, value])


@ti.func
def load_cells(body: ti.template(), cells: ti.template(), scene: ti.template(), w):
    """Fill `law` and `inverse` from the particles of a world."""
    for n in range(cells.inverse.shape[1]):
        cells.inverse[w, n] = 0.0 * scene.spacing
    for c in range(cells.node.shape[0]):
        rows = [lanes_of(0.0 * scene.spacing) for _ in ti.static(range(7))]
        for lane in ti.static(range(LANES)):
            p = cells.particle[c, lane]
            if p >= 0 or p <= WEAK:
                q = body[w, ti.max(p, WEAK - p), 0]
                rows[OF_VOLUME][lane] = ti.select(p >= 0, q[VOLUME], WEAKNESS * q[VOLUME])
                rows[OF_MU][lane] = scene.mu * q[STIFFNESS]
                rows[OF_LAM][lane] = scene.lam * q[STIFFNESS]
            if p >= 0:
                q, fibre = body[w, p, 0], body[w, p, 1]
                rows[OF_TENSION][lane] = q[TENSION]
                for d in ti.static(range(3)):
                    rows[OF_FIBRE + d][lane] = fibre[d]
                for i in ti.static(range(8)):
                    cells.inverse[w, cells.node[c, i]] += q[MASS] * cells.masses[cells.shape[c], i][lane]
        for k in ti.static(range(7)):
            cells.law[w, c, k] = rows[k]
    for n in range(cells.inverse.shape[1]):
        if cells.inverse[w, n] > 0.0:
            cells.inverse[w, n] = 1.0 / cells.inverse[w, n]


@ti.func
def slope(nodes: ti.template(), cells: ti.template(), s, w, c, row: ti.template()):
    """sum x g^T of a row of the nodes, at the particles of a cell: F of places, its rate of velocities."""
    shape = cells.shape[c]
    found = [[lanes_of(0.0 * nodes[s, w, 0, 0][3]) for _ in ti.static(range(3))] for _ in ti.static(range(3))]
    for i in ti.static(range(8)):
        q = nodes[s, w, cells.node[c, i], row]
        for k in ti.static(range(3)):
            g = cells.slopes[shape, 3 * i + k]
            for r in ti.static(range(3)):
                found[r][k] += q[r] * g
    return found


@ti.func
def add_to_nodes(target: ti.template(), s, w, row: ti.template(), cells: ti.template(), c, q: ti.template()):
    """Add sum q g over the particles of a cell to a row of its nodes."""
    shape = cells.shape[c]
    out = [0.0 * q[0][0] for _ in ti.static(range(3))]
    for lane in ti.static(range(LANES)):
        for k in ti.static(range(3)):
            g = cells.turned[shape, 3 * lane + k]
            for r in ti.static(range(3)):
                out[r] += q[r][k][lane] * g
    for i in ti.static(range(8)):
        target[s, w, cells.node[c, i], row] += ti.Vector([out[0][i], out[1][i], out[2][i], 0.0])


@ti.func
def place_of(nodes: ti.template(), cells: ti.template(), s, w, c, lane: ti.template(), row: ti.template()):
    """A row of the nodes at the place of one particle."""
    found = 0.0 * nodes[s, w, 0, row]
    for i in ti.static(range(8)):
        found += cells.weights[c, i][lane] * nodes[s, w, cells.node[c, i], row]
    return found


@ti.func
def add_at(c: ti.template(), nodes: ti.template(), s, row: ti.template(), cell, lane: ti.template(), given):
    """Add a vector at the place of one particle to a row of the nodes."""
    for i in ti.static(range(8)):
        nodes[s, c.w, c.cells.node[cell, i], row] += c.cells.weights[cell, i][lane] * given


@ti.func
def rows_at(c: ti.template(), nodes: ti.template(), s, cell, row: ti.template(), weights: ti.template(), k):
    """A row of the nodes of a cell at eight places, whose weights are row `k` of `weights`: three vectors of lanes."""
    found = [lanes_of(0.0 * c.scene.spacing) for _ in ti.static(range(3))]
    for i in ti.static(range(8)):
        q = nodes[s, c.w, c.cells.node[cell, i], row]
        for r in ti.static(range(3)):
            found[r] += q[r] * weights[k, i]
    return found


@ti.func
def summed(share, a, b, d):
    """Sums over the lanes of three values by their share, as a row."""
    return ti.Vector([(share * a).sum(), (share * b).sum(), (share * d).sum(), 0.0 * share[0]])
