"""Contact of a robot's limbs with each other, in its rest frame.

Particles of two parts that are apart (`model.body_parts`) repel each other within `REACH` edges e of their cubes, by
central forces, so that momentum and angular momentum are conserved:

    f = k (REACH e - |r|) r / |r|,    k = 4 / e^2 * w_a w_b / (w_a + w_b),    w = mu V g.

The softer of two has most say in k. The share g is below 1 for particles of thin parts, which have light nodes. There
is no friction.

Where nothing is near, nothing is computed: only parts whose boxes meet are looked at in a substep. Boxes have a margin
beside what is within reach, and are made anew once a particle may have moved by it since, so that no pair is missed and
nothing depends on where a launch begins.

    members, first, apart, share   those of `model.body_parts`
    boxes    [worlds, cells + parts + 1, 2] lower and upper corner of the particles of each cell, then of each part.
             The fourth lane of a cell's lower corner says how many times as far as its nodes they can move, as they may
             lie outside of it. The last row has the velocity of the body when boxes were made, and in its first lane
             how far a node can have moved since, relative to the body
    meeting  [worlds, pairs + 1] the pairs of parts whose boxes meet, and last how many
"""

import taichi as ti

from zoobench.sim.kernels.cell_lanes import (
    BY_STIFFNESS,
    BY_VOLUME,
    FORCE,
    OF_MU,
    OF_VOLUME,
    add_at,
    lanes_of,
    place_of,
    rows_at,
    summed,
)
from zoobench.sim.kernels.columns import dot, zero_lanes
from zoobench.sim.kernels.layout import V, X, while_compiling
from zoobench.sim.model.body_parts import REACH
from zoobench.sim.model.rest_cells import LANES

_STIFFNESS = 4.0
"""As large as the bound on the step lets it be, which does not know of it: of two cubes that meet without damping, a
collision changes the energy by up to a sixth at a Courant fraction of 0.7, and by 5 % at half of that."""

_MARGIN = 0.25
"""How far a node may move until boxes are made anew [cube's edges]; with more, more boxes meet."""

_FAR = 1e30
_TINY = 1e-12
_CLOSEST = 1e-3
"""Distance that particles have at least, so that no number is too large for single precision [cube's edges]."""


@while_compiling
@ti.data_oriented
class Limbs:
    """The arrays of a body's parts as one argument."""

    def __init__(self, members, first, apart, share, boxes, meeting):
        self.members, self.first, self.apart, self.share = members, first, apart, share
        self.boxes, self.meeting = boxes, meeting


@ti.func
def particle_rows(c: ti.template(), nodes: ti.template(), s, cell, row: ti.template()):
    """A row of the nodes at the particles of a cell, as lanes."""
    return rows_at(c, nodes, s, cell, row, c.cells.weights, cell)


@ti.func
def scatter_rows(c: ti.template(), nodes: ti.template(), s, row: ti.template(), cell, given: ti.template()):
    """Add lanes at the particles of a cell to a row of its nodes."""
    for i in ti.static(range(LANES)):
        nodes[s, c.w, c.cells.node[cell, i], row] += summed(c.cells.weights[cell, i], given[0], given[1], given[2])


@ti.func
def strength(c: ti.template(), cell, lane):
    """w of a particle [J], 0 where there is none."""
    return c.cells.law[c.w, cell, OF_VOLUME][lane] * c.cells.law[c.w, cell, OF_MU][lane] * c.limbs.share[cell][lane]


@ti.func
def strengths(c: ti.template(), cell):
    """`strength` of the particles of a cell."""
    return c.cells.law[c.w, cell, OF_VOLUME] * c.cells.law[c.w, cell, OF_MU] * c.limbs.share[cell]


@ti.func
def forget_meetings(c: ti.template()):
    """Have the next `renew_meetings` make all boxes anew."""
    c.limbs.boxes[c.w, c.limbs.boxes.shape[1] - 1, 1] = _FAR + zero_lanes()


@ti.func
def renew_meetings(c: ti.template()):
    """Make boxes and list anew, for the places of slot s, if a particle may have left the box of its cell."""
    if c.limbs.apart.shape[0] > 0:
        if c.limbs.boxes[c.w, c.limbs.boxes.shape[1] - 1, 1][0] > _MARGIN * c.scene.edge:
            find_meetings(c)


@ti.func
def note_motion(c: ti.template(), slot):
    """Take account of a substep with the velocities of a slot."""
    if c.limbs.apart.shape[0] > 0:
        last = c.limbs.boxes.shape[1] - 1
        drift, fastest = c.limbs.boxes[c.w, last, 0], 0.0 * c.dt
        for n in range(c.own_nodes.shape[2]):
            if c.cells.inverse[c.w, n] > 0.0:
                v = c.own_nodes[slot, c.w, n, V] - drift
                fastest = ti.max(fastest, dot(v, v))
        c.limbs.boxes[c.w, last, 1] += c.dt * ti.sqrt(fastest)


@ti.func
def find_meetings(c: ti.template()):
    """Fill `boxes` and `meeting` of a world."""
    boxes, apart, meeting = ti.static(c.limbs.boxes, c.limbs.apart, c.limbs.meeting)
    count = c.cells.node.shape[0]
    drift, moving = zero_lanes(), 0
    for n in range(c.own_nodes.shape[2]):
        if c.cells.inverse[c.w, n] > 0.0:
            drift += c.own_nodes[c.s, c.w, n, V]
            moving += 1
    drift /= ti.max(moving, 1)
    boxes[c.w, boxes.shape[1] - 1, 0], boxes[c.w, boxes.shape[1] - 1, 1] = drift, zero_lanes()
    for part in range(c.limbs.first.shape[0] - 1):
        far = ti.Vector([_FAR, _FAR, _FAR, 0.0]) + 0.0 * drift
        low, high = far, 0.0 - far
        for k in range(c.limbs.first[part], c.limbs.first[part + 1]):
            cell = c.limbs.members[k]
            x = particle_rows(c, c.own_nodes, c.s, cell, X)
            lower, upper = boxes[c.w, cell, 0], zero_lanes()
            reach = (0.5 * REACH + _MARGIN * lower[3]) * c.scene.edge
            for r in ti.static(range(3)):
                lower[r], upper[r] = x[r].min() - reach, x[r].max() + reach
            boxes[c.w, cell, 0], boxes[c.w, cell, 1] = lower, upper
            low, high = ti.min(low, lower), ti.max(high, upper)
        boxes[c.w, count + part, 0], boxes[c.w, count + part, 1] = low, high
    met = 0
    for pair in range(apart.shape[0]):
        if boxes_meet(c, count + apart[pair, 0], count + apart[pair, 1]):
            meeting[c.w, met] = pair
            met += 1
    meeting[c.w, apart.shape[0]] = met


@ti.func
def boxes_meet(c: ti.template(), a, b):
    """Whether two boxes have a point in common."""
    meet = True
    for r in ti.static(range(3)):
        meet = (
            meet and c.limbs.boxes[c.w, a, 0][r] <= c.limbs.boxes[c.w, b, 1][r]
            and c.limbs.boxes[c.w, b, 0][r] <= c.limbs.boxes[c.w, a, 1][r]
        )  # fmt: skip
    return meet


@ti.func
def for_cells_that_meet(c: ti.template(), visit: ti.template()):
    """Call `visit(c, a, b)` for all cells a and b of parts that meet, whose boxes meet."""
    members, first, apart = ti.static(c.limbs.members, c.limbs.first, c.limbs.apart)
    for m in range(c.limbs.meeting[c.w, apart.shape[0]]):
        pair = c.limbs.meeting[c.w, m]
        one, other = apart[pair, 0], apart[pair, 1]
        for i in range(first[one], first[one + 1]):
            a = members[i]
            if boxes_meet(c, a, c.cells.node.shape[0] + other):
                for j in range(first[other], first[other + 1]):
                    if boxes_meet(c, a, members[j]):
                        visit(c, a, members[j])


@ti.func
def spring(c: ti.template(), x, y: ti.template(), strong, others):
    """Between a particle and those of a cell: r, and as lanes k, the reach over |r|, and by how much that is over 1."""
    between = [x[r] - y[r] for r in ti.static(range(3))]
    square = between[0] * between[0] + between[1] * between[1] + between[2] * between[2]
    least = _CLOSEST * c.scene.edge
    closeness = REACH * c.scene.edge / ti.sqrt(ti.max(square, least * least))
    rate = _STIFFNESS / (c.scene.edge * c.scene.edge) * strong * (others / (strong + others + _TINY))
    return between, rate, closeness, ti.max(closeness - 1.0, 0.0)


@ti.func
def push_cells(c: ti.template(), a, b):
    """Add the forces between the particles of two cells to FORCE of their nodes."""
    y, others = particle_rows(c, c.own_nodes, c.s, b, X), strengths(c, b)
    on_b = [lanes_of(0.0 * c.scene.spacing) for _ in ti.static(range(3))]
    for lane in range(LANES):
        x = place_of(c.own_nodes, c.cells, c.s, c.w, a, lane, X)
        between, rate, _closeness, over = spring(c, x, y, strength(c, a, lane), others)
        push = rate * over
        for r in ti.static(range(3)):
            on_b[r] += 0.0 - push * between[r]
        force = summed(push, between[0], between[1], between[2])
        add_at(c, c.own_nodes, c.s, FORCE, a, lane, force)
    scatter_rows(c, c.own_nodes, c.s, FORCE, b, on_b)


@ti.func
def push_cells_adjoint(c: ti.template(), a, b):
    """Adjoint of `push_cells`."""
    y, others = particle_rows(c, c.own_nodes, c.s, b, X), strengths(c, b)
    given_b = particle_rows(c, c.nodes_adjoint, 0, b, FORCE)
    by_y = [lanes_of(0.0 * c.scene.spacing) for _ in ti.static(range(3))]
    by_own, by_others = lanes_of(0.0 * c.scene.spacing), lanes_of(0.0 * c.scene.spacing)
    for lane in range(LANES):
        x = place_of(c.own_nodes, c.cells, c.s, c.w, a, lane, X)
        given_a = place_of(c.nodes_adjoint, c.cells, 0, c.w, a, lane, FORCE)
        strong = strength(c, a, lane)
        between, rate, closeness, over = spring(c, x, y, strong, others)
        given = [given_a[r] - given_b[r] for r in ti.static(range(3))]
        along = between[0] * given[0] + between[1] * given[1] + between[2] * given[2]
        # of rate (reach / |r| - 1) r
        inverse = closeness / (REACH * c.scene.edge)
        varies = (over > 0.0) & (closeness * _CLOSEST < REACH)
        turned = ti.select(varies, closeness * inverse * inverse * along, 0.0 * along)
        by_between = [rate * (over * given[r] - turned * between[r]) for r in ti.static(range(3))]
        for r in ti.static(range(3)):
            by_y[r] += 0.0 - by_between[r]
        by_place = summed(lanes_of(1.0 + 0.0 * strong), by_between[0], by_between[1], by_between[2])
        add_at(c, c.nodes_adjoint, 0, X, a, lane, by_place)
        total = strong + others + _TINY
        by_rate = _STIFFNESS / (c.scene.edge * c.scene.edge) * over * along
        by_others += by_rate * (strong / total) * (strong / total)
        by_own[lane] = (by_rate * (others / total) * (others / total)).sum()
    scatter_rows(c, c.nodes_adjoint, 0, X, b, by_y)
    strengths_adjoint(c, a, by_own)
    strengths_adjoint(c, b, by_others)


@ti.func
def strengths_adjoint(c: ti.template(), cell, by_strengths):
    """Adjoint of `strengths`."""
    held = by_strengths * c.limbs.share[cell]
    c.sums[c.w, cell, BY_VOLUME] += held * c.cells.law[c.w, cell, OF_MU]
    c.sums[c.w, cell, BY_STIFFNESS] += (c.scene.mu * held) * c.cells.law[c.w, cell, OF_VOLUME]
