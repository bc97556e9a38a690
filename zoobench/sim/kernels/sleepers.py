"""Matter asleep, in the substeps of one launch on one thread.

Particles asleep keep place, velocity and stress through a launch, and so what they add to the nodes, too. It is
scattered once, into a slab of the whole arena behind all other nodes of the grid, and the momenta of every substep
begin with it in place of zero. What awake particles feel of them is therefore exact; what the nodes give back to them
is not taken, as if the ground held them. Substeps visit particles and nodes of those awake alone.

Backward the adjoints of the momenta are summed over all launches of a frame in a slab of their own grid, one for every
world, and each particle asleep takes its part once, beside the adjoint of its unchanged state: into how many launches a
frame is divided changes no bit.

Arrays are those of `layout`. The slabs are zero between launches, and those of the adjoints between frames.
"""

import taichi as ti

from zoobench.sim.kernels.columns import zero_lanes
from zoobench.sim.kernels.layout import BEFORE, MOMENTUM, PUSH, RATIO, STRESS, C, V, X
from zoobench.sim.kernels.splines import first_node
from zoobench.sim.kernels.substep import clear_node, contribution, to_grid
from zoobench.sim.kernels.substep_adjoint import to_grid_adjoint
from zoobench.sim.kernels.transfer import AFLIP
from zoobench.sim.kernels.two_fields import layers

_CARRIED = (V, C, C + 1, C + 2, STRESS, STRESS + 1)
"""Rows whose adjoints `to_grid_adjoint` sets; it adds to the others."""


@ti.func
def awake(state: ti.template(), plan: ti.template(), w, variant: ti.template()):
    """Number of particles of a world that substeps visit."""
    count = state.shape[2]
    if ti.static(variant.sleep):
        count = plan[w, 2]
    return count


@ti.func
def listed(order: ti.template(), w, i, variant: ti.template()):
    """The particle at place i of the order."""
    p = i
    if ti.static(variant.sleep):
        p = order[w, i]
    return p


@ti.func
def slab(grid: ti.template(), scene: ti.template(), variant: ti.template()):
    """The box of the whole arena behind all other nodes of the grid, with two fields those of the robot."""
    sy = scene.nodes_z
    sx = scene.nodes_y * sy
    size = scene.nodes_x * sx
    return ti.Struct(sx=sx, sy=sy, origin=grid.shape[1] - layers(variant) * size, size=size)


@ti.func
def adjoint_slab(grid_adjoint: ti.template(), scene: ti.template(), worlds, w, variant: ti.template()):
    """The same for the adjoints of a world, behind all other nodes of theirs."""
    nodes = slab(grid_adjoint, scene, variant)
    origin = nodes.origin - (worlds - 1 - w) * layers(variant) * nodes.size
    return ti.Struct(sx=nodes.sx, sy=nodes.sy, origin=origin, size=nodes.size)


@ti.func
def touched(
    state: ti.template(), order: ti.template(), first, last, scene: ti.template(), s, w, width: ti.template()
):  # fmt: skip
    """First and past-the-last node that the particles at places `first` to `last` of the order touch at slot s."""
    low_x, low_y, low_z = scene.nodes_x, scene.nodes_y, scene.nodes_z
    high_x, high_y, high_z = 0, 0, 0
    for i in range(first, last):
        cells = state[s, w, order[w, i], X] * scene.inverse
        x = first_node(cells[0], scene.nodes_x, width)
        y = first_node(cells[1], scene.nodes_y, width)
        z = first_node(cells[2], scene.nodes_z, width)
        low_x, low_y, low_z = ti.min(low_x, x), ti.min(low_y, y), ti.min(low_z, z)
        high_x, high_y, high_z = ti.max(high_x, x + width), ti.max(high_y, y + width), ti.max(high_z, z + width)
    return ti.Struct(x0=low_x, y0=low_y, z0=low_z, x1=high_x, y1=high_y, z1=high_z)


@ti.func
def lie_down(
    state: ti.template(), window: ti.template(), body: ti.template(), plan: ti.template(), order: ti.template(),
    grid: ti.template(), scene: ti.template(), dt, w, variant: ti.template(),
):  # fmt: skip
    """The beginning of a launch: the window of the particles awake, and the momenta of those asleep."""
    if ti.static(variant.sleep):
        s, count, nodes = plan[w, 0], plan[w, 2], slab(grid, scene, variant)
        if plan[w, 1] > 0:
            box = touched(state, order, 0, count, scene, s, w, variant.width)
            window[s, w, 0], window[s, w, 1], window[s, w, 2] = box.x0, box.y0, box.z0
            window[s, w, 3], window[s, w, 4], window[s, w, 5] = box.x1, box.y1, box.z1
            for i in range(count, state.shape[2]):
                given = contribution(state, body, nodes, scene, dt, s, w, order[w, i], variant.of_medium)
                to_grid(state, body, grid, 0, nodes, scene, s, w, order[w, i], given, variant.of_medium)


@ti.func
def clear_slab(grid: ti.template(), nodes: ti.template(), box: ti.template(), variant: ti.template()):
    """Zero the nodes of a box in a slab."""
    for k in ti.static(range(layers(variant))):
        for i in range(box.x0, box.x1):
            for j in range(box.y0, box.y1):
                first = nodes.origin + k * nodes.size + i * nodes.sx + j * nodes.sy
                for node in range(first + box.z0, first + box.z1):
                    clear_node(grid, node, variant)


@ti.func
def rise(
    state: ti.template(), window: ti.template(), plan: ti.template(), order: ti.template(), grid: ti.template(),
    scene: ti.template(), stride, w, variant: ti.template(),
):  # fmt: skip
    """The end of a launch: the state of particles asleep at the last slot, and a window there that holds them, too."""
    if ti.static(variant.sleep):
        s, count = plan[w, 0], plan[w, 2]
        t = s + plan[w, 1] * stride
        if plan[w, 1] > 0:
            box = touched(state, order, count, state.shape[2], scene, s, w, variant.width)
            clear_slab(grid, slab(grid, scene, variant), box, variant)
            window[t, w, 0] = ti.min(window[t, w, 0], box.x0)
            window[t, w, 1] = ti.min(window[t, w, 1], box.y0)
            window[t, w, 2] = ti.min(window[t, w, 2], box.z0)
            window[t, w, 3] = ti.max(window[t, w, 3], box.x1)
            window[t, w, 4] = ti.max(window[t, w, 4], box.y1)
            window[t, w, 5] = ti.max(window[t, w, 5], box.z1)
            if t > s:
                for i in range(count, state.shape[2]):
                    for row in range(state.shape[3]):
                        state[t, w, order[w, i], row] = state[s, w, order[w, i], row]


@ti.func
def begin_nodes(
    grid: ti.template(), window: ti.template(), start, nodes: ti.template(), scene: ti.template(), s, w,
    variant: ti.template(),
):  # fmt: skip
    """Momenta from node `start` on before particles are scattered: of those asleep, zero elsewhere."""
    if ti.static(variant.sleep):
        arena = slab(grid, scene, variant)
        node = start
        for m in ti.static(range(layers(variant))):
            for i in range(window[s, w, 0], window[s, w, 3]):
                for j in range(window[s, w, 1], window[s, w, 4]):
                    first = arena.origin + m * arena.size + i * arena.sx + j * arena.sy
                    for k in range(window[s, w, 2], window[s, w, 5]):
                        grid[MOMENTUM, node] = grid[MOMENTUM, first + k]
                        if ti.static(variant.uses(AFLIP)):
                            grid[BEFORE, node] = grid[BEFORE, first + k]
                        if ti.static(variant.fbar and m == layers(variant) - 1):
                            grid[RATIO, node] = grid[RATIO, first + k]
                        if ti.static(variant.skin):
                            grid[PUSH, node] = zero_lanes()  # the robot never sleeps
                        node += 1
    else:
        for node in range(start, start + layers(variant) * nodes.size):
            clear_node(grid, node, variant)


@ti.func
def box_asleep(
    state: ti.template(), plan: ti.template(), order: ti.template(), scene: ti.template(), w, variant: ti.template()
):  # fmt: skip
    """First and past-the-last node that the particles asleep in a launch touch."""
    box = ti.Struct(x0=0, y0=0, z0=0, x1=0, y1=0, z1=0)
    if ti.static(variant.sleep):
        box = touched(state, order, plan[w, 2], state.shape[2], scene, plan[w, 0], w, variant.width)
    return box


@ti.func
def begin_nodes_adjoint(
    grid_adjoint: ti.template(), window: ti.template(), nodes: ti.template(), asleep: ti.template(),
    scene: ti.template(), s, w, variant: ti.template(),
):  # fmt: skip
    """Adjoint of `begin_nodes`: adds to that of the momenta of particles asleep, at the nodes that those touch."""
    if ti.static(variant.sleep):
        arena = adjoint_slab(grid_adjoint, scene, window.shape[1], w, variant)
        x0, x1 = ti.max(window[s, w, 0], asleep.x0), ti.min(window[s, w, 3], asleep.x1)
        y0, y1 = ti.max(window[s, w, 1], asleep.y0), ti.min(window[s, w, 4], asleep.y1)
        z0, z1 = ti.max(window[s, w, 2], asleep.z0), ti.min(window[s, w, 5], asleep.z1)
        for m in ti.static(range(layers(variant))):
            for i in range(x0, x1):
                for j in range(y0, y1):
                    first = arena.origin + m * arena.size + i * arena.sx + j * arena.sy
                    near = m * nodes.size + (i - window[s, w, 0]) * nodes.sx + (j - window[s, w, 1]) * nodes.sy
                    for k in range(z0, z1):
                        node = near + k - window[s, w, 2]
                        grid_adjoint[MOMENTUM, first + k] += grid_adjoint[MOMENTUM, node]
                        if ti.static(variant.uses(AFLIP)):
                            grid_adjoint[BEFORE, first + k] += grid_adjoint[BEFORE, node]
                        if ti.static(variant.fbar and m == layers(variant) - 1):
                            grid_adjoint[RATIO, first + k] += grid_adjoint[RATIO, node]


@ti.func
def lie_down_adjoint(
    state: ti.template(), body: ti.template(), plan: ti.template(), order: ti.template(), grid: ti.template(),
    grid_adjoint: ti.template(), adjoint: ti.template(), body_adjoint: ti.template(), asleep: ti.template(),
    scene: ti.template(), dt, w, variant: ti.template(),
):  # fmt: skip
    """Adjoint of `lie_down`, after those of all substeps of the frame: adds to the adjoints of particles asleep."""
    if ti.static(variant.sleep):
        s, count = plan[w, 0], plan[w, 2]
        nodes = adjoint_slab(grid_adjoint, scene, state.shape[1], w, variant)
        if plan[w, 1] > 0:
            clear_slab(grid, slab(grid, scene, variant), asleep, variant)
        if plan[w, 1] > 0 and plan[w, 3] != 0:
            for i in range(count, state.shape[2]):
                p = order[w, i]
                held = [adjoint[0, w, p, row] for row in ti.static(_CARRIED)]
                for row in ti.static(_CARRIED):
                    adjoint[0, w, p, row] = zero_lanes()
                to_grid_adjoint(
                    state, body, adjoint, body_adjoint, grid_adjoint, nodes, scene, dt, s, w, p, variant.of_medium
                )  # fmt: skip
                for n in ti.static(range(len(_CARRIED))):
                    adjoint[0, w, p, ti.static(_CARRIED[n])] += held[n]
            clear_slab(grid_adjoint, nodes, asleep, variant)
