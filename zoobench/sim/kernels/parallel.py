"""The substep and its adjoint for many threads (CUDA): one substep of all worlds at once, each in its slab of the grid.

Arrays are those of `layout`. The sums are atomic, so that results differ in the last bits from run to run. No momenta
are kept: the reverse computes them again. The nodes of a world's window are shared among a fixed number of threads, as
the host does not know how many they are.
"""

import taichi as ti

from zoobench.sim.kernels.array_types import Rows, Scalars
from zoobench.sim.kernels.boundary import behind_wall
from zoobench.sim.kernels.context import Context
from zoobench.sim.kernels.flip import divide_node, divide_node_adjoint
from zoobench.sim.kernels.lane_scatter import NODE_LANES
from zoobench.sim.kernels.layout import V, X, box, constants_of, layer, medium_layer
from zoobench.sim.kernels.skin_contact import push, push_adjoint
from zoobench.sim.kernels.splines import stencil
from zoobench.sim.kernels.substep import clear_node, contribution, from_grid, press_along, to_grid, update_at
from zoobench.sim.kernels.substep_adjoint import (
    from_grid_adjoint,
    press_along_adjoint,
    scatter_contribution,
    to_grid_adjoint,
    unpressed,
    update_at_adjoint,
)
from zoobench.sim.kernels.transfer import AFLIP

NODE_THREADS = 4096
"""Threads for the nodes of a world."""


@ti.func
def capacity(state: ti.template(), grid: ti.template(), variant: ti.template()):
    """Nodes that a world has room for, in each field of velocities."""
    return grid.shape[1] // (variant.layers * state.shape[1])


@ti.func
def world_slab(c: ti.template(), room):
    """The nodes in the present window of a world, at the beginning of its own part of the grid; see `layout.box`."""
    nodes = box(c.window, 0, c.w)
    origin = nodes.origin + c.variant.layers * c.w * room
    return ti.Struct(sx=nodes.sx, sy=nodes.sy, origin=origin, size=nodes.size)


@ti.func
def takes_part(plan: ti.template(), boxes: ti.template(), w, n, room):
    """Whether world w has an n-th substep, and room for the nodes of its window."""
    size = box(boxes, 0, w).size
    return n < plan[w, 1] and size > 0 and size <= room


@ti.func
def index_of(c: ti.template(), n):
    """(i, j, k) of the n-th node in the present window of a world."""
    boxes = ti.static(c.window)
    w = c.w
    depth = boxes[0, w, 5] - boxes[0, w, 2]
    line = n // depth
    i = line // (boxes[0, w, 4] - boxes[0, w, 1])
    j = line - i * (boxes[0, w, 4] - boxes[0, w, 1])
    return boxes[0, w, 0] + i, boxes[0, w, 1] + j, boxes[0, w, 2] + n - line * depth


@ti.func
def each_world_node(worlds: ti.template(), visit: ti.template(), stride):
    """Visit the nodes of every world's window, which threads share, with their number in the grid and their index in
    the whole arena; by a loop of the kernel's own."""
    for w, thread in ti.ndrange(worlds.state.shape[1], NODE_THREADS):
        n, room = worlds.step[0], capacity(worlds.state, worlds.grid, worlds.variant)
        if takes_part(worlds.plan, worlds.window, w, n, room):
            scene = constants_of(worlds.constants, worlds.variant)
            world = worlds.but(scene=scene, dt=worlds.dts[w], w=w, s=worlds.plan[w, 0] + n * stride)
            nodes = world_slab(world, room)
            c = world.but(nodes=nodes)
            for turn in range((nodes.size - thread + NODE_THREADS - 1) // NODE_THREADS):
                own = thread + turn * NODE_THREADS
                index = index_of(c, own)
                visit(c, c.variant.layers * w * room + own, index)


@ti.func
def each_world_particle(worlds: ti.template(), visit: ti.template(), turns: ti.template(), stride):
    """Visit every particle of every world so many times, at once; by a loop of the kernel's own."""
    for w, number in ti.ndrange(worlds.state.shape[1], turns * worlds.state.shape[2]):
        n, room = worlds.step[0], capacity(worlds.state, worlds.grid, worlds.variant)
        if takes_part(worlds.plan, worlds.window, w, n, room):
            scene, s = constants_of(worlds.constants, worlds.variant), worlds.plan[w, 0] + n * stride
            t = s + stride
            world = worlds.but(scene=scene, dt=worlds.dts[w], w=w, s=s, t=t)
            nodes = world_slab(world, room)
            visit(world.but(nodes=nodes), number // turns, number % turns)


@ti.func
def clear_at(c: ti.template(), node, index: ti.template()):
    """Zero a node in all layers."""
    for k in ti.static(range(c.variant.layers)):
        clear_node(c.grid, node + k * c.nodes.size, c.variant)


@ti.func
def clear_adjoint_at(c: ti.template(), node, index: ti.template()):
    """Zero the adjoints of a node in all layers."""
    for k in ti.static(range(c.variant.layers)):
        clear_node(c.grid_adjoint, node + k * c.nodes.size, c.variant)


@ti.func
def add_lane(c: ti.template(), p, lane):
    """One lane of what a particle adds to the nodes."""
    given = contribution(c, p)
    to_grid(c, p, given, lane)
    if ti.static(c.variant.skin):
        if p < c.scene.robot and lane == 0:
            push(c, p)


@ti.func
def move_node(c: ti.template(), node, index: ti.template()):
    """Momenta of a node to velocities."""
    update_at(c, node, index)
    if ti.static(c.variant.uses(AFLIP)):
        for k in ti.static(range(c.variant.layers)):
            divide_node(c.grid, node + k * c.nodes.size)


@ti.func
def move_node_adjoint(c: ti.template(), node, index: ti.template()):
    """Adjoint of `move_node`."""
    update_at_adjoint(c, node, index)
    if ti.static(c.variant.uses(AFLIP)):
        for k in ti.static(range(c.variant.layers)):
            here = node + k * c.nodes.size
            divide_node_adjoint(c.grid, here, c.grid_adjoint, here)


@ti.func
def press_along_direction(c: ti.template(), node, index: ti.template()):
    """`press_along` one direction, of the medium's layer."""
    press_along(c, node + medium_layer(c), index, c.direction)


@ti.func
def press_along_direction_adjoint(c: ti.template(), node, index: ti.template()):
    """Adjoint of `press_along_direction`."""
    d = ti.static(c.direction)
    if behind_wall(index[d], (c.scene.nodes_x, c.scene.nodes_y, c.scene.nodes_z)[d], d, c.variant.ground) != 0:
        m = node + medium_layer(c)
        press_along_adjoint(c, m, m, index, unpressed(c, m, index), d)


@ti.func
def particle_moves(c: ti.template(), p, _turn):
    """Gather, move and deform a particle, and have it in the window of slot t."""
    at = stencil(c.state[c.s, c.w, p, X], c.scene, layer(c, p), c.variant.width)
    first = from_grid(c, p, at)
    for d in ti.static(range(3)):
        # most are inside already, and need not wait for each other
        if first[d] < c.windows[c.t, c.w, d]:
            ti.atomic_min(c.windows[c.t, c.w, d], first[d])
        if first[d] + c.variant.width > c.windows[c.t, c.w, 3 + d]:
            ti.atomic_max(c.windows[c.t, c.w, 3 + d], first[d] + c.variant.width)


@ti.func
def particle_moves_adjoint(c: ti.template(), p, _turn):
    """Adjoint of `particle_moves`."""
    from_grid_adjoint(c, p)


@ti.func
def add_adjoint(c: ti.template(), p, _turn):
    """Adjoint of what a particle adds to the nodes."""
    to_grid_adjoint(c, p)
    if ti.static(c.variant.skin):
        if p < c.scene.robot:
            push_adjoint(c, p)


@ti.func
def velocities_of_all(worlds: ti.template(), stride):
    """The first half of a substep, up to the nodes' velocities; by loops of the kernel's own."""
    each_world_node(worlds, clear_at, stride)
    each_world_particle(worlds, add_lane, NODE_LANES, stride)
    each_world_node(worlds, move_node, stride)
    # an edge's nodes are pressed by two walls, and their threads would write each other's
    for d in ti.static(range(3 * worlds.variant.liquid)):
        each_world_node(worlds.but(direction=d), press_along_direction, stride)


@ti.kernel
def advance_parallel(
    state: Rows, window: Scalars, body: Rows, plan: Scalars, dts: Scalars, constants: Scalars, terrain: Rows,
    grid: Rows, boxes: Scalars, step: Scalars, stride: int, variant: ti.template(),
):  # fmt: skip
    """The planned substep number `step[0]` of all worlds at once, and `step` to the next one's; it writes `stride`
    slots further (0: in place).

    `boxes` keeps the windows, as the next slot's may be written over them. A world whose window has more nodes than
    there is room for ends with speeds that are no numbers.
    """
    worlds = Context(
        variant, state=state, window=boxes, window_slot=0, windows=window, body=body, plan=plan, dts=dts,
        constants=constants, terrain=terrain, grid=grid, step=step, start=0,
    )  # fmt: skip
    for w, d in ti.ndrange(state.shape[1], 6):
        if step[0] < plan[w, 1]:
            boxes[0, w, d] = window[plan[w, 0] + step[0] * stride, w, d]
    velocities_of_all(worlds, stride)
    # the next slot's window is this one without its outermost nodes, extended by the particles: none moves further
    for w, d in ti.ndrange(state.shape[1], 3):
        n, room = step[0], capacity(state, grid, variant)
        if n < plan[w, 1]:
            t, margin = plan[w, 0] + (n + 1) * stride, ti.cast(takes_part(plan, boxes, w, n, room), ti.i32)
            window[t, w, d] = boxes[0, w, d] + margin
            window[t, w, 3 + d] = boxes[0, w, 3 + d] - margin
    each_world_particle(worlds, particle_moves, 1, stride)
    for w, p in ti.ndrange(state.shape[1], state.shape[2]):
        n, room = step[0], capacity(state, grid, variant)
        if n < plan[w, 1] and not takes_part(plan, boxes, w, n, room):
            state[plan[w, 0] + (n + 1) * stride, w, p, V] = ti.Vector([ti.math.nan, ti.math.nan, ti.math.nan, 0.0])
    for _ in range(1):
        step[0] += 1


@ti.kernel
def reverse_parallel(
    state: Rows, window: Scalars, body: Rows, plan: Scalars, dts: Scalars, constants: Scalars, terrain: Rows,
    grid: Rows, boxes: Scalars, step: Scalars, contributions: Rows, grid_adjoint: Rows, adjoint: Rows,
    body_adjoint: Rows, variant: ti.template(),
):  # fmt: skip
    """The adjoint of the planned substep number `step[0]` of all worlds at once, and `step` to the one before."""
    worlds = Context(
        variant, state=state, window=boxes, window_slot=0, windows=window, body=body, plan=plan, dts=dts,
        constants=constants, terrain=terrain, grid=grid, step=step, start=0, contributions=contributions,
        grid_adjoint=grid_adjoint, adjoint=adjoint, body_adjoint=body_adjoint,
    )  # fmt: skip
    for w, d in ti.ndrange(state.shape[1], 6):
        if step[0] < plan[w, 1]:
            boxes[0, w, d] = window[plan[w, 0] + step[0], w, d]
    velocities_of_all(worlds, 1)
    each_world_node(worlds, clear_adjoint_at, 1)
    each_world_particle(worlds, particle_moves_adjoint, 1, 1)
    each_world_particle(worlds, scatter_contribution, NODE_LANES, 1)
    for d in ti.static(range(3 * variant.liquid)):
        each_world_node(worlds.but(direction=d), press_along_direction_adjoint, 1)
    each_world_node(worlds, move_node_adjoint, 1)
    each_world_particle(worlds, add_adjoint, 1, 1)
    for _ in range(1):
        step[0] -= 1
