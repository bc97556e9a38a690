"""What particles add to the grid, by four threads each: one for every lane of a node.

Four threads that add to the four numbers of a node are one access of a GPU's memory, and one thread's additions four:
a substep's scatter takes less than half the time, though each of the four computes the particle's stress. What is
added to the adjoints takes longer to compute: one thread leaves it in `contributions`, four rows for each field, that
of the first node of the particle's stencil and the slopes, from which the four read it.
"""

import taichi as ti

from zoobench.sim.kernels.columns import matrix
from zoobench.sim.kernels.drift import scatter_ratio
from zoobench.sim.kernels.fbar import scatter_rate
from zoobench.sim.kernels.layout import BEFORE, MASS, MOMENTUM, X, history
from zoobench.sim.kernels.skin_contact import push
from zoobench.sim.kernels.splines import stencil, weights
from zoobench.sim.kernels.substep import contribution, has_transfer, linear_motion
from zoobench.sim.kernels.transfer import AFLIP
from zoobench.sim.kernels.two_fields import layer


def is_none(rows: object) -> bool:
    """Whether a kernel has no such rows: for use where it is compiled, as kernels have no `is`."""
    return rows is None


@ti.func
def lane_of(row, lane):
    """One lane of a row."""
    return ti.select(lane < 2, ti.select(lane == 0, row[0], row[1]), ti.select(lane == 2, row[2], row[3]))


@ti.func
def scatter_lane(
    grid: ti.template(), field: ti.template(), nodes: ti.template(), node, w: ti.template(), origin,
    slope: ti.template(), lane, width: ti.template(),
):  # fmt: skip
    """One lane of `transfer.scatter`."""
    first = lane_of(origin, lane)
    by_x, by_y, by_z = lane_of(slope.x, lane), lane_of(slope.y, lane), lane_of(slope.z, lane)
    for i, j, k in ti.static(ti.ndrange(width, width, width)):
        share = w[i][0] * w[j][1] * w[k][2]
        grid[field, node + i * nodes.sx + j * nodes.sy + k][lane] += share * (first + i * by_x + j * by_y + k * by_z)


@ti.func
def put_contribution(contributions: ti.template(), w, p, number: ti.template(), origin, slope: ti.template()):
    """Leave what a particle adds to its field of this number."""
    contributions[w, p, 4 * number] = origin
    contributions[w, p, 4 * number + 1] = slope.x
    contributions[w, p, 4 * number + 2] = slope.y
    contributions[w, p, 4 * number + 3] = slope.z


@ti.func
def scatter_contribution(
    contributions: ti.template(), grid: ti.template(), nodes: ti.template(), state: ti.template(), scene: ti.template(),
    s, w, p, lane, variant: ti.template(),
):  # fmt: skip
    """One lane of what a particle left in `contributions`, to the nodes of its stencil."""
    at = stencil(state[s, w, p, X], scene, layer(nodes, scene, p, variant), variant.width)
    share = weights(at.offset, variant.width)
    for number in ti.static(range(1 + variant.uses(AFLIP))):
        if number == 0 or has_transfer(scene, p, variant, AFLIP):
            field, first = ti.static((MOMENTUM, BEFORE)[number]), 4 * number
            slope = matrix(
                contributions[w, p, first + 1], contributions[w, p, first + 2], contributions[w, p, first + 3]
            )
            scatter_lane(grid, field, nodes, at.node, share, contributions[w, p, first], slope, lane, variant.width)


@ti.func
def to_grid_by_lanes(
    state: ti.template(), body: ti.template(), grid: ti.template(), nodes: ti.template(), scene: ti.template(),
    terrain: ti.template(), dt, s, w, p, lane, variant: ti.template(),
):  # fmt: skip
    """One lane of all that a particle adds to the nodes of its stencil; with the first, what is not by lanes."""
    given = contribution(state, body, nodes, scene, dt, s, w, p, variant)
    share = weights(given.offset, variant.width)
    scatter_lane(grid, MOMENTUM, nodes, given.node, share, given.origin, given.slope, lane, variant.width)
    if ti.static(variant.uses(AFLIP)):
        if has_transfer(scene, p, variant, AFLIP):
            origin, motion = linear_motion(state, scene, s, w, p, body[w, p, 0][MASS], given)
            scatter_lane(grid, BEFORE, nodes, given.node, share, origin, motion, lane, variant.width)
    if lane == 0:
        if ti.static(variant.liquid):
            if p >= scene.robot:
                mass = body[w, p, 0][MASS]
                scatter_ratio(grid, nodes, given.node, share, history(state, s, w, p), mass, variant.width)
        if ti.static(variant.fbar):
            if p >= scene.robot:
                scatter_rate(state, body, grid, 0, layer(nodes, scene, p, variant), scene, s, w, p)
        if ti.static(variant.skin):
            if p < scene.robot:
                push(state, body, grid, 0, nodes, scene, terrain, dt, s, w, p, variant)
