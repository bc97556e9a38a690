"""The substep and its adjoint for many threads (CUDA): one substep of all worlds at once, each in its slab of the grid.

Arrays are those of `layout`. The sums are atomic, so that results differ in the last bits from run to run. No momenta
are kept: the reverse computes them again.
"""

import taichi as ti

from zoobench.sim.kernels.array_types import Rows, Scalars
from zoobench.sim.kernels.flip import divide_node, divide_node_adjoint
from zoobench.sim.kernels.layout import X, scene_constants
from zoobench.sim.kernels.media import WATER
from zoobench.sim.kernels.skin_contact import push, push_adjoint
from zoobench.sim.kernels.splines import stencil
from zoobench.sim.kernels.substep import (
    clear_node,
    contribution,
    from_grid,
    press_node,
    to_grid,
    update_node,
)
from zoobench.sim.kernels.substep_adjoint import (
    from_grid_adjoint,
    press_node_adjoint,
    to_grid_adjoint,
    update_node_adjoint,
)
from zoobench.sim.kernels.transfer import AFLIP
from zoobench.sim.kernels.two_fields import layer, layers, medium_layer, update_both, update_both_adjoint


@ti.func
def arena(scene: ti.template(), w, variant: ti.template()):
    """The box of all nodes of world w, with two fields those of the robot.

    The window of a slot is overwritten while its nodes are still needed.
    """
    sy = scene.nodes_z
    sx = scene.nodes_y * sy
    size = scene.nodes_x * sx
    return ti.Struct(sx=sx, sy=sy, origin=layers(variant) * w * size, size=size)


@ti.func
def index_of(scene: ti.template(), node):
    """(i, j, k) of `node` of a world."""
    i = node // (scene.nodes_y * scene.nodes_z)
    j = node // scene.nodes_z - i * scene.nodes_y
    return i, j, node - (i * scene.nodes_y + j) * scene.nodes_z


@ti.func
def in_use(window: ti.template(), s, w, index: ti.template()):
    """True if a node lies in the window of world w at slot s."""
    inside = True
    for d in ti.static(range(3)):
        inside = inside and window[s, w, d] <= index[d] and index[d] < window[s, w, 3 + d]
    return inside


@ti.kernel
def advance_parallel(
    state: Rows, window: Scalars, body: Rows, plan: Scalars, dts: Scalars, constants: Scalars, terrain: Rows,
    grid: Rows, n: int, stride: int, variant: ti.template(),
):  # fmt: skip
    """The n-th planned substep of all worlds at once; it writes `stride` slots further (0: in place)."""
    for w, node in ti.ndrange(state.shape[1], grid.shape[1] // (layers(variant) * state.shape[1])):
        scene = scene_constants(constants)
        if n < plan[w, 1] and in_use(window, plan[w, 0] + n * stride, w, index_of(scene, node)):
            nodes = arena(scene, w, variant)
            for k in ti.static(range(layers(variant))):
                clear_node(grid, nodes.origin + node + k * nodes.size, variant)
    for w, p in ti.ndrange(state.shape[1], state.shape[2]):
        if n < plan[w, 1]:
            scene, s = scene_constants(constants), plan[w, 0] + n * stride
            nodes = arena(scene, w, variant)
            given = contribution(state, body, nodes, scene, dts[w], s, w, p, variant)
            to_grid(state, body, grid, 0, nodes, scene, s, w, p, given, variant)
            if ti.static(variant.skin):
                if p < scene.robot:
                    push(state, body, grid, 0, nodes, scene, terrain, dts[w], s, w, p, variant)
    for w, node in ti.ndrange(state.shape[1], grid.shape[1] // (layers(variant) * state.shape[1])):
        scene = scene_constants(constants)
        i, j, k = index_of(scene, node)
        s = plan[w, 0] + n * stride
        if n < plan[w, 1] and in_use(window, s, w, (i, j, k)):
            nodes = arena(scene, w, variant)
            m = nodes.origin + node
            if ti.static(variant.two_fields):
                update_both(grid, m, m, nodes, window, s, w, (i, j, k), dts[w], scene, terrain, variant)
            else:
                update_node(grid, m, m, i, j, k, dts[w], scene, terrain, variant)
            if ti.static(variant.uses(AFLIP)):
                for field in ti.static(range(layers(variant))):
                    divide_node(grid, m + field * nodes.size)
    if ti.static(variant.law == WATER):
        for w, node in ti.ndrange(state.shape[1], grid.shape[1] // (layers(variant) * state.shape[1])):
            scene, s = scene_constants(constants), plan[w, 0] + n * stride
            index = index_of(scene, node)
            if n < plan[w, 1] and in_use(window, s, w, index):
                nodes = arena(scene, w, variant)
                m = nodes.origin + node + medium_layer(nodes, variant)
                press_node(grid, nodes, window, s, w, m, index, scene, variant.ground)
    # an empty window of the next slot, which the particles extend below
    for w, d in ti.ndrange(state.shape[1], 3):
        if n < plan[w, 1]:
            t = plan[w, 0] + (n + 1) * stride
            window[t, w, d] = grid.shape[1]
            window[t, w, 3 + d] = 0
    for w, p in ti.ndrange(state.shape[1], state.shape[2]):
        if n < plan[w, 1]:
            scene, s = scene_constants(constants), plan[w, 0] + n * stride
            t, nodes = s + stride, arena(scene, w, variant)
            at = stencil(state[s, w, p, X], scene, layer(nodes, scene, p, variant), variant.width)
            first = from_grid(state, grid, 0, nodes, at, scene, dts[w], s, t, w, p, variant)
            for d in ti.static(range(3)):
                ti.atomic_min(window[t, w, d], first[d])
                ti.atomic_max(window[t, w, 3 + d], first[d] + variant.width)


@ti.kernel
def reverse_parallel(
    state: Rows, window: Scalars, body: Rows, plan: Scalars, dts: Scalars, constants: Scalars, terrain: Rows,
    grid: Rows, grid_adjoint: Rows, adjoint: Rows, body_adjoint: Rows, n: int, variant: ti.template(),
):  # fmt: skip
    """The adjoint of the n-th planned substep of all worlds at once."""
    for w, node in ti.ndrange(state.shape[1], grid.shape[1] // (layers(variant) * state.shape[1])):
        scene = scene_constants(constants)
        if n < plan[w, 1] and in_use(window, plan[w, 0] + n, w, index_of(scene, node)):
            nodes = arena(scene, w, variant)
            for k in ti.static(range(layers(variant))):
                clear_node(grid, nodes.origin + node + k * nodes.size, variant)
                clear_node(grid_adjoint, nodes.origin + node + k * nodes.size, variant)
    for w, p in ti.ndrange(state.shape[1], state.shape[2]):
        if n < plan[w, 1]:
            scene, s = scene_constants(constants), plan[w, 0] + n
            nodes = arena(scene, w, variant)
            given = contribution(state, body, nodes, scene, dts[w], s, w, p, variant)
            to_grid(state, body, grid, 0, nodes, scene, s, w, p, given, variant)
            if ti.static(variant.skin):
                if p < scene.robot:
                    push(state, body, grid, 0, nodes, scene, terrain, dts[w], s, w, p, variant)
    for w, node in ti.ndrange(state.shape[1], grid.shape[1] // (layers(variant) * state.shape[1])):
        scene = scene_constants(constants)
        i, j, k = index_of(scene, node)
        s = plan[w, 0] + n
        if n < plan[w, 1] and in_use(window, s, w, (i, j, k)):
            nodes = arena(scene, w, variant)
            m = nodes.origin + node
            if ti.static(variant.two_fields):
                update_both(grid, m, m, nodes, window, s, w, (i, j, k), dts[w], scene, terrain, variant)
            else:
                update_node(grid, m, m, i, j, k, dts[w], scene, terrain, variant)
            if ti.static(variant.uses(AFLIP)):
                for field in ti.static(range(layers(variant))):
                    divide_node(grid, m + field * nodes.size)
    if ti.static(variant.law == WATER):
        for w, node in ti.ndrange(state.shape[1], grid.shape[1] // (layers(variant) * state.shape[1])):
            scene, s = scene_constants(constants), plan[w, 0] + n
            index = index_of(scene, node)
            if n < plan[w, 1] and in_use(window, s, w, index):
                nodes = arena(scene, w, variant)
                m = nodes.origin + node + medium_layer(nodes, variant)
                press_node(grid, nodes, window, s, w, m, index, scene, variant.ground)
    for w, p in ti.ndrange(state.shape[1], state.shape[2]):
        if n < plan[w, 1]:
            scene, s = scene_constants(constants), plan[w, 0] + n
            nodes = arena(scene, w, variant)
            from_grid_adjoint(state, adjoint, grid, grid_adjoint, 0, nodes, scene, dts[w], s, s + 1, w, p, variant)
    if ti.static(variant.law == WATER):
        for w, node in ti.ndrange(state.shape[1], grid.shape[1] // (layers(variant) * state.shape[1])):
            scene, s = scene_constants(constants), plan[w, 0] + n
            index = index_of(scene, node)
            if n < plan[w, 1] and in_use(window, s, w, index):
                nodes = arena(scene, w, variant)
                m = nodes.origin + node + medium_layer(nodes, variant)
                press_node_adjoint(
                    grid, grid_adjoint, nodes, window, s, w, m, m, index, dts[w], scene, terrain, variant
                )
    for w, node in ti.ndrange(state.shape[1], grid.shape[1] // (layers(variant) * state.shape[1])):
        scene = scene_constants(constants)
        i, j, k = index_of(scene, node)
        s = plan[w, 0] + n
        if n < plan[w, 1] and in_use(window, s, w, (i, j, k)):
            nodes = arena(scene, w, variant)
            m = nodes.origin + node
            if ti.static(variant.two_fields):
                update_both_adjoint(
                    grid, grid_adjoint, m, m, nodes, window, s, w, (i, j, k), dts[w], scene, terrain, variant
                )
            else:
                update_node_adjoint(grid, grid_adjoint, m, m, i, j, k, dts[w], scene, terrain, variant)
            if ti.static(variant.uses(AFLIP)):
                for field in ti.static(range(layers(variant))):
                    here = m + field * nodes.size
                    divide_node_adjoint(grid, here, grid_adjoint, here)
    for w, p in ti.ndrange(state.shape[1], state.shape[2]):
        if n < plan[w, 1]:
            scene, s = scene_constants(constants), plan[w, 0] + n
            nodes = arena(scene, w, variant)
            to_grid_adjoint(
                state, body, adjoint, body_adjoint, grid_adjoint, nodes, scene, dts[w], s, w, p, variant
            )  # fmt: skip
            if ti.static(variant.skin):
                if p < scene.robot:
                    push_adjoint(
                        state, body, adjoint, body_adjoint, grid_adjoint, nodes, scene, terrain, dts[w], s, w, p,
                        variant,
                    )  # fmt: skip
