"""The substep and its adjoint for one thread.

The worlds are taken in turn through one grid. A launch does many substeps, because it costs as much as the work on a
thousand particles. The sums are not atomic and in a fixed order, and so are bit-reproducible and six times faster than
atomic ones. While the nodes of one particle are visited, the stress of the next is computed: the processor does both at
once.

Arrays are those of `layout`. Where matter may sleep, see `sleepers`, only particles awake are visited, in their order.
"""

import taichi as ti

from zoobench.sim.kernels.array_types import Rows, Scalars
from zoobench.sim.kernels.context import Context
from zoobench.sim.kernels.flip import divide_node, divide_node_adjoint
from zoobench.sim.kernels.layout import KEPT, START, X, box, constants_of, layer, medium_layer
from zoobench.sim.kernels.skin_contact import push, push_adjoint
from zoobench.sim.kernels.sleepers import (
    active_count,
    active_particle,
    begin_launch,
    begin_launch_adjoint,
    begin_nodes,
    begin_nodes_adjoint,
    box_asleep,
    end_launch,
)
from zoobench.sim.kernels.splines import stencil
from zoobench.sim.kernels.substep import (
    clear_node,
    contribution,
    from_grid,
    no_contribution,
    press_node,
    to_grid,
    update_at,
)
from zoobench.sim.kernels.substep_adjoint import (
    from_grid_adjoint,
    press_node_adjoint,
    to_grid_adjoint,
    update_at_adjoint,
)
from zoobench.sim.kernels.transfer import AFLIP


@ti.func
def clear(grid: ti.template(), start, count, variant: ti.template()):
    """Zero the fields that particles are scattered into, at `count` nodes from `start` on."""
    for node in range(start, start + count):
        clear_node(grid, node, variant)


@ti.func
def each_node(c: ti.template(), visit: ti.template()):
    """Visit the nodes of the substep's window with their number in it and their index in the whole grid."""
    node = 0
    for i in range(c.window[c.s, c.w, 0], c.window[c.s, c.w, 3]):
        for j in range(c.window[c.s, c.w, 1], c.window[c.s, c.w, 4]):
            for k in range(c.window[c.s, c.w, 2], c.window[c.s, c.w, 5]):
                visit(c, node, (i, j, k))
                node += 1


@ti.func
def scatter_all(c: ti.template()):
    """Momenta of all particles at slot s."""
    begin_nodes(c)
    last = active_count(c) - 1
    coming = no_contribution(c.dt)
    for i in range(-1, last + 1):
        given = coming
        p = active_particle(c, ti.max(i, 0))
        coming = contribution(c, active_particle(c, ti.min(i + 1, last)))
        if i >= 0:
            to_grid(c, p, given, None)


@ti.func
def push_all(c: ti.template()):
    """Impulses of the ground's skin on all particles at slot s."""
    if ti.static(c.variant.skin):
        for p in range(c.scene.robot):
            push(c, p)


@ti.func
def press_medium(c: ti.template(), node, index: ti.template()):
    """`press_node` of the medium's layer."""
    press_node(c, medium_layer(c) + node, index)


@ti.func
def update_nodes(c: ti.template()):
    """Momenta to velocities."""
    each_node(c, update_at)
    if ti.static(c.variant.liquid):
        each_node(c, press_medium)


@ti.func
def divide_all(c: ti.template()):
    """Momenta of the motion before forces to velocities (AFLIP)."""
    if ti.static(c.variant.uses(AFLIP)):
        for node in range(c.start, c.start + c.variant.layers * c.nodes.size):
            divide_node(c.grid, node)


@ti.func
def press_medium_adjoint(c: ti.template(), node, index: ti.template()):
    """Adjoint of `press_medium`."""
    medium = medium_layer(c) + node
    press_node_adjoint(c, c.start + medium, medium, index)


@ti.func
def update_nodes_adjoint(c: ti.template()):
    """Adjoint of `update_nodes`."""
    if ti.static(c.variant.liquid):
        each_node(c, press_medium_adjoint)
    each_node(c, update_at_adjoint)
    if ti.static(c.variant.uses(AFLIP)):
        for m in range(c.variant.layers * c.nodes.size):
            divide_node_adjoint(c.grid, c.start + m, c.grid_adjoint, m)


@ti.func
def move_all(c: ti.template()):
    """Gather, move and deform all particles; the window of slot t is that of their new stencils."""
    # the window of the next substep, as the grid is cleared only where particles are
    low_x, low_y, low_z = c.scene.nodes_x, c.scene.nodes_y, c.scene.nodes_z
    high_x, high_y, high_z = 0, 0, 0
    width = ti.static(c.variant.width)
    last = active_count(c) - 1
    at_first = active_particle(c, 0)
    coming = stencil(c.state[c.s, c.w, at_first, X], c.scene, layer(c, at_first), width)
    for i in range(last + 1):
        at = coming
        p = active_particle(c, i)
        following = active_particle(c, ti.min(i + 1, last))
        coming = stencil(c.state[c.s, c.w, following, X], c.scene, layer(c, following), width)
        x, y, z = from_grid(c, p, at)
        low_x, low_y, low_z = ti.min(low_x, x), ti.min(low_y, y), ti.min(low_z, z)
        high_x, high_y, high_z = ti.max(high_x, x), ti.max(high_y, y), ti.max(high_z, z)
    c.window[c.t, c.w, 0], c.window[c.t, c.w, 1], c.window[c.t, c.w, 2] = low_x, low_y, low_z
    c.window[c.t, c.w, 3] = high_x + width
    c.window[c.t, c.w, 4] = high_y + width
    c.window[c.t, c.w, 5] = high_z + width


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
        scene = constants_of(constants, variant)
        dt = dts[w]
        launch = Context(
            variant, state=state, window=window, body=body, plan=plan, order=order, grid=grid, terrain=terrain,
            scene=scene, dt=dt, w=w,
        )  # fmt: skip
        first = variant.layers * scene.nodes_x * scene.nodes_y * scene.nodes_z + w * keep
        begin_launch(launch)
        for n in range(plan[w, 1]):
            s = plan[w, 0] + n * stride
            t = s + stride
            nodes = box(window, s, w)
            size = variant.layers * nodes.size
            start, after = 0, window[s, w, START]
            if first <= after and after + size <= first + keep:
                start = after
                after = start + size
            c = launch.but(s=s, t=t, window_slot=s, nodes=nodes, start=start)
            scatter_all(c)
            push_all(c)
            divide_all(c)
            update_nodes(c)
            move_all(c)
            window[s, w, KEPT] = ti.cast(start > 0, ti.i32)
            window[t, w, START] = after
        end_launch(launch, stride)


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
        scene = constants_of(constants, variant)
        dt = dts[w]
        launch = Context(
            variant, state=state, window=window, body=body, plan=plan, order=order, grid=grid, terrain=terrain,
            scene=scene, dt=dt, w=w, grid_adjoint=grid_adjoint, adjoint=adjoint, body_adjoint=body_adjoint,
        )  # fmt: skip
        count = active_count(launch)
        asleep = box_asleep(launch)
        begin_launch(launch)
        for n in range(plan[w, 1]):
            s = plan[w, 0] + plan[w, 1] - 1 - n
            t = s + 1
            nodes = box(window, s, w)
            start = 0
            if window[s, w, KEPT] != 0:
                start = window[s, w, START]
            c = launch.but(s=s, t=t, window_slot=s, nodes=nodes, start=start)
            if window[s, w, KEPT] == 0:
                scatter_all(c)
                push_all(c)
                divide_all(c)
            clear(grid_adjoint, 0, variant.layers * nodes.size, variant)
            update_nodes(c)
            for i in range(count):
                from_grid_adjoint(c, active_particle(c, i))
            update_nodes_adjoint(c)
            begin_nodes_adjoint(c, asleep)
            for i in range(count):
                to_grid_adjoint(c, active_particle(c, i))
            if ti.static(variant.skin):
                for p in range(scene.robot):
                    push_adjoint(c, p)
        begin_launch_adjoint(launch, asleep)
