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
from zoobench.sim.kernels.layout import BEFORE, MOMENTUM, PUSH, RATIO, STRESS, SURFACE, C, V, X
from zoobench.sim.kernels.splines import first_node
from zoobench.sim.kernels.substep import clear_node, contribution, to_grid
from zoobench.sim.kernels.substep_adjoint import to_grid_adjoint
from zoobench.sim.kernels.transfer import AFLIP

_CARRIED = (V, C, C + 1, C + 2, STRESS, STRESS + 1)
"""Rows whose adjoints `to_grid_adjoint` sets; it adds to the others."""


@ti.func
def active_count(c: ti.template()):
    """Number of particles of a world that substeps visit."""
    count = c.state.shape[2]
    if ti.static(c.variant.sleep):
        count = c.plan[c.w, 2]
    return count


@ti.func
def active_particle(c: ti.template(), i):
    """The particle at place i of the order."""
    p = i
    if ti.static(c.variant.sleep):
        p = c.order[c.w, i]
    return p


@ti.func
def arena_slab(c: ti.template()):
    """The box of the whole arena behind all other nodes of the grid, with two fields those of the robot."""
    sy = c.scene.nodes_z
    sx = c.scene.nodes_y * sy
    size = c.scene.nodes_x * sx
    return ti.Struct(sx=sx, sy=sy, origin=c.grid.shape[1] - c.variant.layers * size, size=size)


@ti.func
def adjoint_slab(c: ti.template()):
    """The same for the adjoints of a world, behind all other nodes of theirs."""
    nodes = arena_slab(c)
    origin = nodes.origin - c.grid.shape[1] + c.grid_adjoint.shape[1]
    origin -= (c.state.shape[1] - 1 - c.w) * c.variant.layers * nodes.size
    return ti.Struct(sx=nodes.sx, sy=nodes.sy, origin=origin, size=nodes.size)


@ti.func
def nodes_reached(c: ti.template(), first, last, s):
    """First and past-the-last node that the particles at places `first` to `last` of the order touch at slot s."""
    width = ti.static(c.variant.width)
    low_x, low_y, low_z = c.scene.nodes_x, c.scene.nodes_y, c.scene.nodes_z
    high_x, high_y, high_z = 0, 0, 0
    for i in range(first, last):
        cells = c.state[s, c.w, c.order[c.w, i], X] * c.scene.inverse
        x = first_node(cells[0], c.scene.nodes_x, width)
        y = first_node(cells[1], c.scene.nodes_y, width)
        z = first_node(cells[2], c.scene.nodes_z, width)
        low_x, low_y, low_z = ti.min(low_x, x), ti.min(low_y, y), ti.min(low_z, z)
        high_x, high_y, high_z = ti.max(high_x, x + width), ti.max(high_y, y + width), ti.max(high_z, z + width)
    return ti.Struct(x0=low_x, y0=low_y, z0=low_z, x1=high_x, y1=high_y, z1=high_z)


@ti.func
def begin_launch(c: ti.template()):
    """The beginning of a launch: the window of the particles awake, and the momenta of those asleep."""
    if ti.static(c.variant.sleep):
        s, count, nodes = c.plan[c.w, 0], c.plan[c.w, 2], arena_slab(c)
        if c.plan[c.w, 1] > 0:
            box = nodes_reached(c, 0, count, s)
            c.window[s, c.w, 0], c.window[s, c.w, 1], c.window[s, c.w, 2] = box.x0, box.y0, box.z0
            c.window[s, c.w, 3], c.window[s, c.w, 4], c.window[s, c.w, 5] = box.x1, box.y1, box.z1
            asleep = c.but(variant=c.variant.of_medium, s=s, nodes=nodes, start=0)
            for i in range(count, c.state.shape[2]):
                given = contribution(asleep, c.order[c.w, i])
                to_grid(asleep, c.order[c.w, i], given, None)


@ti.func
def clear_slab(grid: ti.template(), nodes: ti.template(), box: ti.template(), variant: ti.template()):
    """Zero the nodes of a box in a slab."""
    for k in ti.static(range(variant.layers)):
        for i in range(box.x0, box.x1):
            for j in range(box.y0, box.y1):
                first = nodes.origin + k * nodes.size + i * nodes.sx + j * nodes.sy
                for node in range(first + box.z0, first + box.z1):
                    clear_node(grid, node, variant)


@ti.func
def end_launch(c: ti.template(), stride):
    """The end of a launch: the state of particles asleep at the last slot, and a window there that holds them, too."""
    if ti.static(c.variant.sleep):
        s, count = c.plan[c.w, 0], c.plan[c.w, 2]
        t = s + c.plan[c.w, 1] * stride
        if c.plan[c.w, 1] > 0:
            box = nodes_reached(c, count, c.state.shape[2], s)
            clear_slab(c.grid, arena_slab(c), box, c.variant)
            c.window[t, c.w, 0] = ti.min(c.window[t, c.w, 0], box.x0)
            c.window[t, c.w, 1] = ti.min(c.window[t, c.w, 1], box.y0)
            c.window[t, c.w, 2] = ti.min(c.window[t, c.w, 2], box.z0)
            c.window[t, c.w, 3] = ti.max(c.window[t, c.w, 3], box.x1)
            c.window[t, c.w, 4] = ti.max(c.window[t, c.w, 4], box.y1)
            c.window[t, c.w, 5] = ti.max(c.window[t, c.w, 5], box.z1)
            if t > s:
                for i in range(count, c.state.shape[2]):
                    for row in range(c.state.shape[3]):
                        c.state[t, c.w, c.order[c.w, i], row] = c.state[s, c.w, c.order[c.w, i], row]


@ti.func
def begin_nodes(c: ti.template()):
    """Momenta before particles are scattered: of those asleep, zero elsewhere."""
    if ti.static(c.variant.sleep):
        arena = arena_slab(c)
        node = c.start
        for m in ti.static(range(c.variant.layers)):
            for i in range(c.window[c.s, c.w, 0], c.window[c.s, c.w, 3]):
                for j in range(c.window[c.s, c.w, 1], c.window[c.s, c.w, 4]):
                    first = arena.origin + m * arena.size + i * arena.sx + j * arena.sy
                    for k in range(c.window[c.s, c.w, 2], c.window[c.s, c.w, 5]):
                        c.grid[MOMENTUM, node] = c.grid[MOMENTUM, first + k]
                        if ti.static(c.variant.uses(AFLIP)):
                            c.grid[BEFORE, node] = c.grid[BEFORE, first + k]
                        if ti.static(c.variant.fbar and m == c.variant.layers - 1):
                            c.grid[RATIO, node] = c.grid[RATIO, first + k]
                        if ti.static(c.variant.skin):
                            c.grid[PUSH, node] = zero_lanes()  # the robot never sleeps
                        if ti.static(c.variant.rolling_aslant):
                            c.grid[SURFACE, node] = zero_lanes()
                        node += 1
    else:
        for node in range(c.start, c.start + c.variant.layers * c.nodes.size):
            clear_node(c.grid, node, c.variant)


@ti.func
def box_asleep(c: ti.template()):
    """First and past-the-last node that the particles asleep in a launch touch."""
    box = ti.Struct(x0=0, y0=0, z0=0, x1=0, y1=0, z1=0)
    if ti.static(c.variant.sleep):
        box = nodes_reached(c, c.plan[c.w, 2], c.state.shape[2], c.plan[c.w, 0])
    return box


@ti.func
def begin_nodes_adjoint(c: ti.template(), asleep: ti.template()):
    """Adjoint of `begin_nodes`: adds to that of the momenta of particles asleep, at the nodes that those touch."""
    if ti.static(c.variant.sleep):
        arena = adjoint_slab(c)
        grid_adjoint = ti.static(c.grid_adjoint)
        low_x, low_y, low_z = c.window[c.s, c.w, 0], c.window[c.s, c.w, 1], c.window[c.s, c.w, 2]
        x0, x1 = ti.max(low_x, asleep.x0), ti.min(c.window[c.s, c.w, 3], asleep.x1)
        y0, y1 = ti.max(low_y, asleep.y0), ti.min(c.window[c.s, c.w, 4], asleep.y1)
        z0, z1 = ti.max(low_z, asleep.z0), ti.min(c.window[c.s, c.w, 5], asleep.z1)
        for m in ti.static(range(c.variant.layers)):
            for i in range(x0, x1):
                for j in range(y0, y1):
                    first = arena.origin + m * arena.size + i * arena.sx + j * arena.sy
                    near = m * c.nodes.size + (i - low_x) * c.nodes.sx + (j - low_y) * c.nodes.sy
                    for k in range(z0, z1):
                        node = near + k - low_z
                        grid_adjoint[MOMENTUM, first + k] += grid_adjoint[MOMENTUM, node]
                        if ti.static(c.variant.uses(AFLIP)):
                            grid_adjoint[BEFORE, first + k] += grid_adjoint[BEFORE, node]
                        if ti.static(c.variant.fbar and m == c.variant.layers - 1):
                            grid_adjoint[RATIO, first + k] += grid_adjoint[RATIO, node]


@ti.func
def begin_launch_adjoint(c: ti.template(), asleep: ti.template()):
    """Adjoint of `begin_launch`, after those of all substeps of the frame: adds to the adjoints of particles asleep."""
    if ti.static(c.variant.sleep):
        s, count = c.plan[c.w, 0], c.plan[c.w, 2]
        nodes = adjoint_slab(c)
        if c.plan[c.w, 1] > 0:
            clear_slab(c.grid, arena_slab(c), asleep, c.variant)
        if c.plan[c.w, 1] > 0 and c.plan[c.w, 3] != 0:
            own = c.but(variant=c.variant.of_medium, s=s, nodes=nodes)
            for i in range(count, c.state.shape[2]):
                p = c.order[c.w, i]
                held = [c.adjoint[0, c.w, p, row] for row in ti.static(_CARRIED)]
                for row in ti.static(_CARRIED):
                    c.adjoint[0, c.w, p, row] = zero_lanes()
                to_grid_adjoint(own, p)
                for n in ti.static(range(len(_CARRIED))):
                    c.adjoint[0, c.w, p, ti.static(_CARRIED[n])] += held[n]
            clear_slab(c.grid_adjoint, nodes, asleep, c.variant)
