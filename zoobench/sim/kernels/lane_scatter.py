"""What particles add to the grid, by four threads each: one for every lane of a node.

Four threads that add to the four numbers of a node are one access of a GPU's memory, and one thread's additions four:
a substep's scatter takes less than half the time, though each of the four computes the particle's stress. What is
added to the adjoints takes longer to compute: one thread leaves it in `contributions`, four rows for each field, that
of the first node of the particle's stencil and the slopes, from which the four read it.
"""

import taichi as ti

from zoobench.sim.kernels.context import is_none
from zoobench.sim.kernels.transfer import scatter

NODE_LANES = 4
"""Lanes of a node."""


@ti.func
def lane_of(row, lane):
    """One lane of a row."""
    return ti.select(lane < 2, ti.select(lane == 0, row[0], row[1]), ti.select(lane == 2, row[2], row[3]))


@ti.func
def scatter_lane(f: ti.template(), at: ti.template(), origin, slope: ti.template(), lane):
    """One lane of `transfer.scatter`."""
    w, width = ti.static(at.w, f.width)
    first = lane_of(origin, lane)
    by_x, by_y, by_z = lane_of(slope.x, lane), lane_of(slope.y, lane), lane_of(slope.z, lane)
    for i, j, k in ti.static(ti.ndrange(width, width, width)):
        share = w[i][0] * w[j][1] * w[k][2]
        node = at.node + i * f.nodes.sx + j * f.nodes.sy + k
        f.grid[f.number, node][lane] += share * (first + i * by_x + j * by_y + k * by_z)


@ti.func
def spread(f: ti.template(), at: ti.template(), origin, slope: ti.template(), lane: ti.template()):
    """`transfer.scatter`, or one lane of it where that is not None."""
    if ti.static(is_none(lane)):
        scatter(f, at, origin, slope)
    else:
        scatter_lane(f, at, origin, slope, lane)


@ti.func
def is_first(lane: ti.template()):
    """Whether what is not spread by lanes is to be done."""
    found = True
    if ti.static(not is_none(lane)):
        found = lane == 0
    return found


@ti.func
def put_contribution(c: ti.template(), p, number: ti.template(), origin, slope: ti.template()):
    """Leave what a particle adds to its field of this number."""
    c.contributions[c.w, p, 4 * number] = origin
    c.contributions[c.w, p, 4 * number + 1] = slope.x
    c.contributions[c.w, p, 4 * number + 2] = slope.y
    c.contributions[c.w, p, 4 * number + 3] = slope.z
