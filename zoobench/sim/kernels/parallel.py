"""The substep and its adjoint for many threads (CUDA): one substep of all worlds at once, each in its slab of the grid.

Arrays are those of `layout`. The sums are atomic, so that results differ in the last bits from run to run. No momenta
are kept: the reverse computes them again. The nodes of a world's window are shared among a fixed number of threads, as
the host does not know how many they are.
"""

import taichi as ti

from zoobench.sim.kernels.array_types import Rows, Scalars
from zoobench.sim.kernels.boundary import behind_wall
from zoobench.sim.kernels.flip import divide_node, divide_node_adjoint
from zoobench.sim.kernels.lane_scatter import scatter_contribution, to_grid_by_lanes
from zoobench.sim.kernels.layout import V, X, box, scene_constants
from zoobench.sim.kernels.skin_contact import push_adjoint
from zoobench.sim.kernels.splines import stencil
from zoobench.sim.kernels.substep import (
    clear_node,
    from_grid,
    press_along,
    update_node,
)
from zoobench.sim.kernels.substep_adjoint import (
    from_grid_adjoint,
    press_along_adjoint,
    to_grid_adjoint,
    unpressed,
    update_node_adjoint,
)
from zoobench.sim.kernels.transfer import AFLIP
from zoobench.sim.kernels.two_fields import layer, layers, medium_layer, update_both, update_both_adjoint

NODE_THREADS = 4096
"""Threads for the nodes of a world."""


@ti.func
def capacity(state: ti.template(), grid: ti.template(), variant: ti.template()):
    """Nodes that a world has room for, in each field of velocities."""
    return grid.shape[1] // (layers(variant) * state.shape[1])


@ti.func
def slab(boxes: ti.template(), w, room, variant: ti.template()):
    """The nodes in the present window of world w, at the beginning of its own part of the grid; see `layout.box`."""
    nodes = box(boxes, 0, w)
    origin = nodes.origin + layers(variant) * w * room
    return ti.Struct(sx=nodes.sx, sy=nodes.sy, origin=origin, size=nodes.size)


@ti.func
def takes_part(plan: ti.template(), boxes: ti.template(), w, n, room):
    """Whether world w has an n-th substep, and room for the nodes of its window."""
    size = box(boxes, 0, w).size
    return n < plan[w, 1] and size > 0 and size <= room


@ti.func
def node_index(boxes: ti.template(), w, n):
    """(i, j, k) of the n-th node in the present window of world w."""
    depth = boxes[0, w, 5] - boxes[0, w, 2]
    line = n // depth
    i = line // (boxes[0, w, 4] - boxes[0, w, 1])
    j = line - i * (boxes[0, w, 4] - boxes[0, w, 1])
    return boxes[0, w, 0] + i, boxes[0, w, 1] + j, boxes[0, w, 2] + n - line * depth


@ti.func
def turns(boxes: ti.template(), w, thread):
    """How many nodes of world w are this thread's: one in `NODE_THREADS`."""
    return (box(boxes, 0, w).size - thread + NODE_THREADS - 1) // NODE_THREADS


@ti.func
def own_node(w, room, thread, turn, variant: ti.template()):
    """The robot's node that is this thread's in one of its turns, in the part of the grid that is world w's."""
    return layers(variant) * w * room + thread + turn * NODE_THREADS


@ti.func
def clear_all(
    cleared: ti.template(), state: ti.template(), plan: ti.template(), grid: ti.template(), boxes: ti.template(),
    step: ti.template(), variant: ti.template(),
):  # fmt: skip
    """Zero the nodes of all windows, of the grid or of the adjoints, by a loop of the kernel's own."""
    for w, thread in ti.ndrange(state.shape[1], NODE_THREADS):
        n, room = step[0], capacity(state, grid, variant)
        if takes_part(plan, boxes, w, n, room):
            nodes = slab(boxes, w, room, variant)
            for turn in range(turns(boxes, w, thread)):
                m = own_node(w, room, thread, turn, variant)
                for k in ti.static(range(layers(variant))):
                    clear_node(cleared, m + k * nodes.size, variant)


@ti.func
def velocities_of_all(
    state: ti.template(), body: ti.template(), plan: ti.template(), dts: ti.template(), constants: ti.template(),
    terrain: ti.template(), grid: ti.template(), boxes: ti.template(), step: ti.template(), stride,
    variant: ti.template(),
):  # fmt: skip
    """The first half of a substep, up to the nodes' velocities; by loops of the kernel's own."""
    clear_all(grid, state, plan, grid, boxes, step, variant)
    for w, number in ti.ndrange(state.shape[1], 4 * state.shape[2]):
        n, room = step[0], capacity(state, grid, variant)
        if takes_part(plan, boxes, w, n, room):
            scene, s, p, lane = (
                scene_constants(constants, variant.law),
                plan[w, 0] + n * stride,
                number // 4,
                number % 4,
            )
            nodes = slab(boxes, w, room, variant)
            to_grid_by_lanes(state, body, grid, nodes, scene, terrain, dts[w], s, w, p, lane, variant)
    for w, thread in ti.ndrange(state.shape[1], NODE_THREADS):
        n, room = step[0], capacity(state, grid, variant)
        if takes_part(plan, boxes, w, n, room):
            scene, s = scene_constants(constants, variant.law), plan[w, 0] + n * stride
            nodes = slab(boxes, w, room, variant)
            for turn in range(turns(boxes, w, thread)):
                i, j, k = node_index(boxes, w, thread + turn * NODE_THREADS)
                m = own_node(w, room, thread, turn, variant)
                if ti.static(variant.two_fields):
                    update_both(grid, m, m, nodes, boxes, 0, w, (i, j, k), dts[w], scene, terrain, variant)
                else:
                    update_node(grid, m, m, i, j, k, dts[w], scene, terrain, variant)
                if ti.static(variant.uses(AFLIP)):
                    for field in ti.static(range(layers(variant))):
                        divide_node(grid, m + field * nodes.size)
    # an edge's nodes are pressed by two walls, and their threads would write each other's
    for d in ti.static(range(3 * (variant.liquid))):
        for w, thread in ti.ndrange(state.shape[1], NODE_THREADS):
            n, room = step[0], capacity(state, grid, variant)
            if takes_part(plan, boxes, w, n, room):
                scene, nodes = scene_constants(constants, variant.law), slab(boxes, w, room, variant)
                for turn in range(turns(boxes, w, thread)):
                    index = node_index(boxes, w, thread + turn * NODE_THREADS)
                    m = own_node(w, room, thread, turn, variant) + medium_layer(nodes, variant)
                    press_along(grid, nodes, boxes, 0, w, m, index, scene, d, variant.ground)


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
    for w, d in ti.ndrange(state.shape[1], 6):
        if step[0] < plan[w, 1]:
            boxes[0, w, d] = window[plan[w, 0] + step[0] * stride, w, d]
    velocities_of_all(state, body, plan, dts, constants, terrain, grid, boxes, step, stride, variant)
    # the next slot's window is this one without its outermost nodes, extended by the particles: none moves further
    for w, d in ti.ndrange(state.shape[1], 3):
        n, room = step[0], capacity(state, grid, variant)
        if n < plan[w, 1]:
            t, margin = plan[w, 0] + (n + 1) * stride, ti.cast(takes_part(plan, boxes, w, n, room), ti.i32)
            window[t, w, d] = boxes[0, w, d] + margin
            window[t, w, 3 + d] = boxes[0, w, 3 + d] - margin
    for w, p in ti.ndrange(state.shape[1], state.shape[2]):
        n, room = step[0], capacity(state, grid, variant)
        if takes_part(plan, boxes, w, n, room):
            scene, s = scene_constants(constants, variant.law), plan[w, 0] + n * stride
            t, nodes = s + stride, slab(boxes, w, room, variant)
            at = stencil(state[s, w, p, X], scene, layer(nodes, scene, p, variant), variant.width)
            first = from_grid(state, grid, 0, nodes, at, scene, dts[w], s, t, w, p, variant)
            for d in ti.static(range(3)):
                # most are inside already, and need not wait for each other
                if first[d] < window[t, w, d]:
                    ti.atomic_min(window[t, w, d], first[d])
                if first[d] + variant.width > window[t, w, 3 + d]:
                    ti.atomic_max(window[t, w, 3 + d], first[d] + variant.width)
        elif n < plan[w, 1]:
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
    for w, d in ti.ndrange(state.shape[1], 6):
        if step[0] < plan[w, 1]:
            boxes[0, w, d] = window[plan[w, 0] + step[0], w, d]
    velocities_of_all(state, body, plan, dts, constants, terrain, grid, boxes, step, 1, variant)
    clear_all(grid_adjoint, state, plan, grid, boxes, step, variant)
    for w, p in ti.ndrange(state.shape[1], state.shape[2]):
        n, room = step[0], capacity(state, grid, variant)
        if takes_part(plan, boxes, w, n, room):
            scene, s = scene_constants(constants, variant.law), plan[w, 0] + n
            nodes = slab(boxes, w, room, variant)
            from_grid_adjoint(
                state, adjoint, grid, grid_adjoint, contributions, 0, nodes, scene, dts[w], s, s + 1, w, p, variant
            )  # fmt: skip
    for w, number in ti.ndrange(state.shape[1], 4 * state.shape[2]):
        n, room = step[0], capacity(state, grid, variant)
        if takes_part(plan, boxes, w, n, room):
            scene, s, nodes = scene_constants(constants, variant.law), plan[w, 0] + n, slab(boxes, w, room, variant)
            scatter_contribution(
                contributions, grid_adjoint, nodes, state, scene, s, w, number // 4, number % 4, variant
            )  # fmt: skip
    for d in ti.static(range(3 * (variant.liquid))):
        for w, thread in ti.ndrange(state.shape[1], NODE_THREADS):
            n, room = step[0], capacity(state, grid, variant)
            if takes_part(plan, boxes, w, n, room):
                scene, nodes = scene_constants(constants, variant.law), slab(boxes, w, room, variant)
                for turn in range(turns(boxes, w, thread)):
                    index = node_index(boxes, w, thread + turn * NODE_THREADS)
                    if behind_wall(index[d], (scene.nodes_x, scene.nodes_y, scene.nodes_z)[d], d, variant.ground) != 0:
                        m = own_node(w, room, thread, turn, variant) + medium_layer(nodes, variant)
                        free = unpressed(grid, nodes, boxes, 0, w, m, index, dts[w], scene, terrain, variant)
                        press_along_adjoint(
                            grid, grid_adjoint, nodes, boxes, 0, w, m, m, index, free, scene, d, variant.ground
                        )
    for w, thread in ti.ndrange(state.shape[1], NODE_THREADS):
        n, room = step[0], capacity(state, grid, variant)
        if takes_part(plan, boxes, w, n, room):
            scene, s = scene_constants(constants, variant.law), plan[w, 0] + n
            nodes = slab(boxes, w, room, variant)
            for turn in range(turns(boxes, w, thread)):
                i, j, k = node_index(boxes, w, thread + turn * NODE_THREADS)
                m = own_node(w, room, thread, turn, variant)
                if ti.static(variant.two_fields):
                    update_both_adjoint(
                        grid, grid_adjoint, m, m, nodes, boxes, 0, w, (i, j, k), dts[w], scene, terrain, variant
                    )
                else:
                    update_node_adjoint(grid, grid_adjoint, m, m, i, j, k, dts[w], scene, terrain, variant)
                if ti.static(variant.uses(AFLIP)):
                    for field in ti.static(range(layers(variant))):
                        here = m + field * nodes.size
                        divide_node_adjoint(grid, here, grid_adjoint, here)
    for w, p in ti.ndrange(state.shape[1], state.shape[2]):
        n, room = step[0], capacity(state, grid, variant)
        if takes_part(plan, boxes, w, n, room):
            scene, s = scene_constants(constants, variant.law), plan[w, 0] + n
            nodes = slab(boxes, w, room, variant)
            to_grid_adjoint(
                state, body, adjoint, body_adjoint, grid_adjoint, nodes, scene, dts[w], s, w, p, variant
            )  # fmt: skip
            if ti.static(variant.skin):
                if p < scene.robot:
                    push_adjoint(
                        state, body, adjoint, body_adjoint, grid_adjoint, nodes, scene, terrain, dts[w], s, w, p,
                        variant,
                    )  # fmt: skip
    for _ in range(1):
        step[0] -= 1
