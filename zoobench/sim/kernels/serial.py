"""The substep and its adjoint for one thread.

The worlds are taken in turn through one grid. A launch does many substeps, because it costs as much as the work on a
thousand particles. The sums are not atomic and in a fixed order, and so are bit-reproducible and six times faster than
atomic ones. While the nodes of one particle are visited, the stress of the next is computed: the processor does both at
once.

Arrays are those of `layout`. Where matter may sleep, see `sleepers`, only particles awake are visited, in their order.
"""

import taichi as ti

from zoobench.sim.kernels.array_types import Rows, Scalars
from zoobench.sim.kernels.flip import divide_node, divide_node_adjoint
from zoobench.sim.kernels.layout import KEPT, START, X, box, scene_constants
from zoobench.sim.kernels.skin_contact import push, push_adjoint
from zoobench.sim.kernels.sleepers import (
    awake,
    begin_nodes,
    begin_nodes_adjoint,
    box_asleep,
    lie_down,
    lie_down_adjoint,
    listed,
    rise,
)
from zoobench.sim.kernels.splines import stencil
from zoobench.sim.kernels.substep import (
    clear_node,
    contribution,
    from_grid,
    no_contribution,
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
def clear(grid: ti.template(), start, count, variant: ti.template()):
    """Zero the fields that particles are scattered into, at `count` nodes from `start` on."""
    for node in range(start, start + count):
        clear_node(grid, node, variant)


@ti.func
def scatter_all(
    state: ti.template(), window: ti.template(), body: ti.template(), plan: ti.template(), order: ti.template(),
    grid: ti.template(), start, nodes: ti.template(), scene: ti.template(), dt, s, w, variant: ti.template(),
):  # fmt: skip
    """Momenta of all particles of a world at slot s, from node `start` on."""
    begin_nodes(grid, window, start, nodes, scene, s, w, variant)
    last = awake(state, plan, w, variant) - 1
    coming = no_contribution(dt)
    for i in range(-1, last + 1):
        given = coming
        p = listed(order, w, ti.max(i, 0), variant)
        after = listed(order, w, ti.min(i + 1, last), variant)
        coming = contribution(state, body, nodes, scene, dt, s, w, after, variant)
        if i >= 0:
            to_grid(state, body, grid, start, nodes, scene, s, w, p, given, variant)


@ti.func
def push_all(
    state: ti.template(), body: ti.template(), grid: ti.template(), start, nodes: ti.template(), scene: ti.template(),
    terrain: ti.template(), dt, s, w, variant: ti.template(),
):  # fmt: skip
    """Impulses of the ground's skin on all particles of a world at slot s, from node `start` on."""
    if ti.static(variant.skin):
        for p in range(scene.robot):
            push(state, body, grid, start, nodes, scene, terrain, dt, s, w, p, variant)


@ti.func
def update_nodes(
    grid: ti.template(), window: ti.template(), start, nodes: ti.template(), scene: ti.template(), dt, s, w,
    terrain: ti.template(), variant: ti.template(),
):  # fmt: skip
    """Momenta from node `start` on to velocities from the grid's beginning on."""
    node = 0
    for i in range(window[s, w, 0], window[s, w, 3]):
        for j in range(window[s, w, 1], window[s, w, 4]):
            for k in range(window[s, w, 2], window[s, w, 5]):
                if ti.static(variant.two_fields):
                    update_both(grid, start + node, node, nodes, window, s, w, (i, j, k), dt, scene, terrain, variant)
                else:
                    update_node(grid, start + node, node, i, j, k, dt, scene, terrain, variant)
                node += 1
    if ti.static(variant.liquid):
        node = medium_layer(nodes, variant)
        for i in range(window[s, w, 0], window[s, w, 3]):
            for j in range(window[s, w, 1], window[s, w, 4]):
                for k in range(window[s, w, 2], window[s, w, 5]):
                    press_node(grid, nodes, window, s, w, node, (i, j, k), scene, variant.ground)
                    node += 1


@ti.func
def divide_all(grid: ti.template(), start, count, variant: ti.template()):
    """Momenta of the motion before forces to velocities (AFLIP)."""
    if ti.static(variant.uses(AFLIP)):
        for node in range(start, start + count):
            divide_node(grid, node)


@ti.kernel
def advance(
    state: Rows, window: Scalars, body: Rows, plan: Scalars, dts: Scalars, constants: Scalars, terrain: Rows,
    grid: Rows, order: Scalars, stride: int, keep: int, variant: ti.template(),
):  # fmt: skip
    """The planned substeps of every world; each writes `stride` slots further (0: in place).

    Momenta are kept for the reverse as long as they fit into `keep` nodes of a world, behind those of the whole arena.
    """
    ti.loop_config(serialize=True)  # the outermost loop would become parallel, its sums atomic
    for w in range(state.shape[1]):
        scene = scene_constants(constants, variant.law)
        dt = dts[w]
        first = layers(variant) * scene.nodes_x * scene.nodes_y * scene.nodes_z + w * keep
        lie_down(state, window, body, plan, order, grid, scene, dt, w, variant)
        for n in range(plan[w, 1]):
            s = plan[w, 0] + n * stride
            t = s + stride
            nodes = box(window, s, w)
            size = layers(variant) * nodes.size
            start, after = 0, window[s, w, START]
            if first <= after and after + size <= first + keep:
                start = after
                after = start + size
            scatter_all(state, window, body, plan, order, grid, start, nodes, scene, dt, s, w, variant)
            push_all(state, body, grid, start, nodes, scene, terrain, dt, s, w, variant)
            divide_all(grid, start, size, variant)
            update_nodes(grid, window, start, nodes, scene, dt, s, w, terrain, variant)
            # the window of the next substep, as the grid is cleared only where particles are
            low_x, low_y, low_z = scene.nodes_x, scene.nodes_y, scene.nodes_z
            high_x, high_y, high_z = 0, 0, 0
            last = awake(state, plan, w, variant) - 1
            at_first = listed(order, w, 0, variant)
            coming = stencil(state[s, w, at_first, X], scene, layer(nodes, scene, at_first, variant), variant.width)
            for i in range(last + 1):
                at = coming
                p = listed(order, w, i, variant)
                following = listed(order, w, ti.min(i + 1, last), variant)
                own = layer(nodes, scene, following, variant)
                coming = stencil(state[s, w, following, X], scene, own, variant.width)
                x, y, z = from_grid(state, grid, start, nodes, at, scene, dt, s, t, w, p, variant)
                low_x, low_y, low_z = ti.min(low_x, x), ti.min(low_y, y), ti.min(low_z, z)
                high_x, high_y, high_z = ti.max(high_x, x), ti.max(high_y, y), ti.max(high_z, z)
            window[s, w, KEPT] = ti.cast(start > 0, ti.i32)
            window[t, w, START] = after
            window[t, w, 0], window[t, w, 1], window[t, w, 2] = low_x, low_y, low_z
            window[t, w, 3] = high_x + variant.width
            window[t, w, 4] = high_y + variant.width
            window[t, w, 5] = high_z + variant.width
        rise(state, window, plan, order, grid, scene, stride, w, variant)


@ti.kernel
def reverse(
    state: Rows, window: Scalars, body: Rows, plan: Scalars, dts: Scalars, constants: Scalars, terrain: Rows,
    grid: Rows, grid_adjoint: Rows, adjoint: Rows, body_adjoint: Rows, order: Scalars, variant: ti.template(),
):  # fmt: skip
    """The adjoint of the planned substeps, from the slot past the last back to the first.

    Momenta that were not kept are computed again. State adjoints are updated in place (one slot); those of the
    parameters are added to.
    """
    ti.loop_config(serialize=True)
    for w in range(state.shape[1]):
        scene = scene_constants(constants, variant.law)
        dt = dts[w]
        count = awake(state, plan, w, variant)
        asleep = box_asleep(state, plan, order, scene, w, variant)
        lie_down(state, window, body, plan, order, grid, scene, dt, w, variant)
        for n in range(plan[w, 1]):
            s = plan[w, 0] + plan[w, 1] - 1 - n
            t = s + 1
            nodes = box(window, s, w)
            size = layers(variant) * nodes.size
            start = 0
            if window[s, w, KEPT] != 0:
                start = window[s, w, START]
            else:
                scatter_all(state, window, body, plan, order, grid, start, nodes, scene, dt, s, w, variant)
                push_all(state, body, grid, start, nodes, scene, terrain, dt, s, w, variant)
                divide_all(grid, start, size, variant)
            clear(grid_adjoint, 0, size, variant)
            update_nodes(grid, window, start, nodes, scene, dt, s, w, terrain, variant)
            for i in range(count):
                p = listed(order, w, i, variant)
                from_grid_adjoint(
                    state, adjoint, grid, grid_adjoint, None, start, nodes, scene, dt, s, t, w, p, variant
                )
            node = medium_layer(nodes, variant)
            if ti.static(variant.liquid):
                for i in range(window[s, w, 0], window[s, w, 3]):
                    for j in range(window[s, w, 1], window[s, w, 4]):
                        for k in range(window[s, w, 2], window[s, w, 5]):
                            press_node_adjoint(
                                grid, grid_adjoint, nodes, window, s, w, start + node, node, (i, j, k), dt, scene,
                                terrain, variant,
                            )  # fmt: skip
                            node += 1
            node = 0
            for i in range(window[s, w, 0], window[s, w, 3]):
                for j in range(window[s, w, 1], window[s, w, 4]):
                    for k in range(window[s, w, 2], window[s, w, 5]):
                        if ti.static(variant.two_fields):
                            update_both_adjoint(
                                grid, grid_adjoint, start + node, node, nodes, window, s, w, (i, j, k), dt, scene,
                                terrain, variant,
                            )  # fmt: skip
                        else:
                            update_node_adjoint(
                                grid, grid_adjoint, start + node, node, i, j, k, dt, scene, terrain, variant
                            )
                        node += 1
            if ti.static(variant.uses(AFLIP)):
                for m in range(size):
                    divide_node_adjoint(grid, start + m, grid_adjoint, m)
            begin_nodes_adjoint(grid_adjoint, window, nodes, asleep, scene, s, w, variant)
            for i in range(count):
                p = listed(order, w, i, variant)
                to_grid_adjoint(state, body, adjoint, body_adjoint, grid_adjoint, nodes, scene, dt, s, w, p, variant)
            if ti.static(variant.skin):
                for p in range(scene.robot):
                    push_adjoint(
                        state, body, adjoint, body_adjoint, grid_adjoint, nodes, scene, terrain, dt, s, w, p, variant
                    )
        lie_down_adjoint(
            state, body, plan, order, grid, grid_adjoint, adjoint, body_adjoint, asleep, scene, dt, w, variant
        )
