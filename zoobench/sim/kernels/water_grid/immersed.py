"""The substep of a robot in water on a grid and its adjoint, for one thread; for arrays see `layout`, `water_layout`.

The worlds are taken in turn through one grid. All sums are in a fixed order.
"""

import taichi as ti

from zoobench.sim.kernels.array_types import Rows, Scalars
from zoobench.sim.kernels.boundary import WALL_NODES
from zoobench.sim.kernels.columns import dot, spatial, zero_lanes
from zoobench.sim.kernels.layout import X, scene_constants
from zoobench.sim.kernels.splines import first_node
from zoobench.sim.kernels.water_grid.advection import advect, advect_adjoint, hold_walls, load_flow
from zoobench.sim.kernels.water_grid.drag import meeting, meeting_adjoint
from zoobench.sim.kernels.water_grid.faces import from_faces, from_faces_adjoint, to_faces, to_faces_adjoint
from zoobench.sim.kernels.water_grid.pressure import divergence, gradient, solve
from zoobench.sim.kernels.water_grid.water_layout import (
    MOVED,
    ROBOT,
    SCALAR,
    STAR,
    WATER,
    arena,
    cells,
    chosen,
    node_of,
    only,
    unit,
)
from zoobench.sim.model.grid_water import GridWater


@ti.func
def inside(i, j, k, n: ti.template(), d):
    """True for a face of direction d of cell (i, j, k) with water on both sides."""
    found = i >= 0 and j >= 0 and k >= 0 and i < n.x and j < n.y and k < n.z
    return found and chosen(d, i, j, k) > 0


@ti.func
def on_wall(i, j, k, n: ti.template(), d):
    """True for a face on or behind a wall with a normal along d."""
    return chosen(d, i, j, k) <= 0 or chosen(d, i - n.x, j - n.y, k - n.z) >= 0


@ti.func
def clear_faces(grid: ti.template(), window: ti.template(), nodes: ti.template(), s, w):
    """Zero the robot's faces in the window."""
    for d in range(3):
        for i in range(window[s, w, 0], window[s, w, 3]):
            for j in range(window[s, w, 1], window[s, w, 4]):
                first = i * nodes.sx + j * nodes.sy
                for x in range(first + window[s, w, 2], first + window[s, w, 5]):
                    grid[ROBOT + d, x] = zero_lanes()


@ti.func
def pull(grid: ti.template(), x, scene: ti.template(), nodes: ti.template(), d):
    """Gravity and the last substep's gradient of pressure over density along d at a face [m/s^2]."""
    step = chosen(d, nodes.sx, nodes.sy, 1)
    return chosen(d, scene.g_x, scene.g_y, scene.g_z) + grid[WATER, x][3] - grid[WATER, x - step][3]


@ti.func
def meet_all(
    grid: ti.template(), window: ti.template(), nodes: ti.template(), scene: ti.template(), dt, s, w,
):  # fmt: skip
    """ROBOT and STAR to MOVED: the velocity of the robot, the changes of the water's and of the mixture's."""
    n = cells(scene)
    for d in range(3):
        for i in range(window[s, w, 0], window[s, w, 3]):
            for j in range(window[s, w, 1], window[s, w, 4]):
                for k in range(window[s, w, 2], window[s, w, 5]):
                    x = i * nodes.sx + j * nodes.sy + k
                    q, moved = grid[ROBOT + d, x], zero_lanes()
                    a, b, c = i - WALL_NODES, j - WALL_NODES, k - WALL_NODES
                    if q[1] > 0.0:
                        if inside(a, b, c, n, d):
                            u = dot(grid[STAR, x], unit(d))
                            v, after, phi = meeting(q, u, pull(grid, x, scene, nodes, d), dt, scene)
                            moved = ti.Vector([v, after - u, after - u + phi * (v - after), 0.0])
                        elif not on_wall(a, b, c, n, d):
                            moved = only(q[0] / q[1], 0)
                    grid[MOVED + d, x] = moved


@ti.func
def add_mixture(grid: ti.template(), window: ti.template(), nodes: ti.template(), s, w):
    """Divergence of what the robot changes in the mixture's velocity, added to SCALAR."""
    for d in range(3):
        step = chosen(d, nodes.sx, nodes.sy, 1)
        for i in range(window[s, w, 0], window[s, w, 3]):
            for j in range(window[s, w, 1], window[s, w, 4]):
                first = i * nodes.sx + j * nodes.sy
                for x in range(first + window[s, w, 2], first + window[s, w, 5]):
                    change = grid[MOVED + d, x][2]
                    if change != 0.0:
                        grid[SCALAR, x] += only(0.0 - change, 0)
                        grid[SCALAR, x - step] += only(change, 0)


@ti.func
def press_robot(
    grid: ti.template(), window: ti.template(), nodes: ti.template(), scene: ti.template(), s, w, water: ti.template()
):  # fmt: skip
    """The robot's velocities in MOVED without the gradient of SCALAR; with `water` its change of velocity into STAR."""
    n = cells(scene)
    for d in range(3):
        step = chosen(d, nodes.sx, nodes.sy, 1)
        for i in range(window[s, w, 0], window[s, w, 3]):
            for j in range(window[s, w, 1], window[s, w, 4]):
                for k in range(window[s, w, 2], window[s, w, 5]):
                    x = i * nodes.sx + j * nodes.sy + k
                    if grid[ROBOT + d, x][1] > 0.0 and inside(i - WALL_NODES, j - WALL_NODES, k - WALL_NODES, n, d):
                        if ti.static(water):
                            grid[STAR, x] += grid[MOVED + d, x][1] * unit(d)
                        grid[MOVED + d, x] += only(grid[SCALAR, x - step][0] - grid[SCALAR, x][0], 0)


@ti.func
def store_flow(flow: ti.template(), grid: ti.template(), nodes: ti.template(), scene: ti.template(), dt, t, w):
    """STAR without the gradient of SCALAR to slot t, and the pressure."""
    n = cells(scene)
    for i in range(n.x):
        for j in range(n.y):
            for k in range(n.z):
                x = node_of(nodes, i, j, k)
                after = spatial(grid[STAR, x] - gradient(grid, x, i, j, k, nodes))
                flow[t, w, (i * n.y + j) * n.z + k] = after + only(grid[SCALAR, x][0] / dt, 3)


@ti.func
def find_window(
    state: ti.template(), window: ti.template(), scene: ti.template(), t, w, width: ti.template()
):  # fmt: skip
    """The window of the faces that the particles touch at slot t."""
    for d in range(3):
        count = chosen(d, scene.nodes_x, scene.nodes_y, scene.nodes_z)
        low, high = count, 0
        for p in range(state.shape[2]):
            place = dot(state[t, w, p, X], unit(d)) * scene.inverse
            # faces of direction d lie half a cell beside those of the others
            low = ti.min(low, first_node(place - 0.5, count, width))
            high = ti.max(high, first_node(place, count, width) + width)
        window[t, w, d], window[t, w, 3 + d] = low, high


@ti.func
def meet_robot(
    state: ti.template(), window: ti.template(), body: ti.template(), grid: ti.template(), nodes: ti.template(),
    scene: ti.template(), dt, s, w, variant: ti.template(),
):  # fmt: skip
    """The robot at slot s to the faces, where it meets the water in STAR."""
    clear_faces(grid, window, nodes, s, w)
    for p in range(state.shape[2]):
        to_faces(state, body, grid, nodes, scene, dt, s, w, p, variant)
    meet_all(grid, window, nodes, scene, dt, s, w)


@ti.kernel
def advance_immersed(
    state: Rows, window: Scalars, flow: Rows, body: Rows, plan: Scalars, dts: Scalars, constants: Scalars, modes: Rows,
    grid: Rows, stride: int, variant: ti.template(),
):  # fmt: skip
    """The planned substeps of every world; each writes `stride` slots further (0: in place)."""
    ti.loop_config(serialize=True)
    for w in range(state.shape[1]):
        scene = scene_constants(constants, GridWater)
        nodes, dt = arena(scene), dts[w]
        for n in range(plan[w, 1]):
            s = plan[w, 0] + n * stride
            t = s + stride
            load_flow(flow, grid, scene, s, w)
            advect(grid, scene, dt)
            meet_robot(state, window, body, grid, nodes, scene, dt, s, w, variant)
            divergence(grid, STAR, scene)
            add_mixture(grid, window, nodes, s, w)
            solve(grid, modes, scene)
            press_robot(grid, window, nodes, scene, s, w, True)
            for p in range(state.shape[2]):
                from_faces(state, grid, nodes, scene, dt, s, t, w, p, variant)
            store_flow(flow, grid, nodes, scene, dt, t, w)
            find_window(state, window, scene, t, w, variant.width)


@ti.func
def load_pressure(flow: ti.template(), grid: ti.template(), nodes: ti.template(), scene: ti.template(), dt, t, w):
    """The pressure at slot t, which the substep to it found, to SCALAR."""
    n = cells(scene)
    for i in range(n.x):
        for j in range(n.y):
            for k in range(n.z):
                pressure = dt * flow[t, w, (i * n.y + j) * n.z + k][3]
                grid[SCALAR, node_of(nodes, i, j, k)] = only(pressure, 0)


@ti.func
def press_adjoint(
    grid: ti.template(), grid_adjoint: ti.template(), window: ti.template(), flow_adjoint: ti.template(),
    nodes: ti.template(), scene: ti.template(), dt, s, w,
):  # fmt: skip
    """Adjoint of the gradients of SCALAR, to SCALAR: by the water's and the robot's velocity, and by the pressure.

    The adjoint of the water's new velocity also becomes that of STAR, zero on the walls.
    """
    n = cells(scene)
    for i in range(n.x + 1):
        for j in range(n.y + 1):
            for k in range(n.z + 1):
                x, given = node_of(nodes, i, j, k), zero_lanes()
                if i < n.x and j < n.y and k < n.z:
                    given = flow_adjoint[0, w, (i * n.y + j) * n.z + k]
                grid_adjoint[STAR, x] = spatial(given)
                grid_adjoint[SCALAR, x] = only(given[3], 0)
    hold_walls(grid_adjoint, STAR, scene)
    # div is the negative transpose of grad
    divergence(grid_adjoint, STAR, scene)
    for i in range(n.x):
        for j in range(n.y):
            for k in range(n.z):
                x = node_of(nodes, i, j, k)
                pressure = flow_adjoint[0, w, (i * n.y + j) * n.z + k][3]
                grid[SCALAR, x] = grid_adjoint[SCALAR, x] + only(pressure / dt, 0)
    for d in range(3):
        step = chosen(d, nodes.sx, nodes.sy, 1)
        for i in range(window[s, w, 0], window[s, w, 3]):
            for j in range(window[s, w, 1], window[s, w, 4]):
                for k in range(window[s, w, 2], window[s, w, 5]):
                    x = i * nodes.sx + j * nodes.sy + k
                    if grid[ROBOT + d, x][1] > 0.0 and inside(i - WALL_NODES, j - WALL_NODES, k - WALL_NODES, n, d):
                        push = grid_adjoint[ROBOT + d, x][0]
                        grid[SCALAR, x] += only(0.0 - push, 0)
                        grid[SCALAR, x - step] += only(push, 0)


@ti.func
def mixture_adjoint(grid: ti.template(), grid_adjoint: ti.template(), nodes: ti.template(), scene: ti.template()):
    """Adjoint of the divergence in SCALAR by the mixture's velocity, added to that of STAR."""
    n = cells(scene)
    for i in range(n.x):
        for j in range(n.y):
            for k in range(n.z):
                x = node_of(nodes, i, j, k)
                grid_adjoint[STAR, x] += -1.0 * gradient(grid, x, i, j, k, nodes)


@ti.func
def meet_all_adjoint(
    grid: ti.template(), grid_adjoint: ti.template(), window: ti.template(), flow_adjoint: ti.template(),
    nodes: ti.template(), scene: ti.template(), dt, s, w,
):  # fmt: skip
    """Adjoint of `meet_all`: those of the robot's rows in ROBOT, of the water's velocity in STAR and of the pressure of
    the last substep in SCALAR, which begins at zero."""
    n = cells(scene)
    for d in range(3):
        step = chosen(d, nodes.sx, nodes.sy, 1)
        for i in range(window[s, w, 0], window[s, w, 3]):
            for j in range(window[s, w, 1], window[s, w, 4]):
                for k in range(window[s, w, 2], window[s, w, 5]):
                    x = i * nodes.sx + j * nodes.sy + k
                    q, row = grid[ROBOT + d, x], zero_lanes()
                    a, b, c = i - WALL_NODES, j - WALL_NODES, k - WALL_NODES
                    if q[1] > 0.0:
                        v_adjoint = grid_adjoint[ROBOT + d, x][0]
                        if inside(a, b, c, n, d):
                            mixture = grid[SCALAR, x - step][0] - grid[SCALAR, x][0]
                            # STAR holds the sum of the adjoints of the water's and of the mixture's velocity
                            whole = dot(grid_adjoint[STAR, x], unit(d))
                            row, star, lift = meeting_adjoint(
                                q, dot(grid[STAR, x], unit(d)), pull(grid, x, scene, nodes, d), dt, v_adjoint,
                                whole - mixture, mixture, scene,
                            )  # fmt: skip
                            grid_adjoint[STAR, x] += (star - whole) * unit(d)
                            grid_adjoint[SCALAR, x] += only(lift, 0)
                            grid_adjoint[SCALAR, x - step] += only(0.0 - lift, 0)
                        elif not on_wall(a, b, c, n, d):
                            # divided twice, as the square of a mass below 1e-23 kg is 0 in float32
                            row = ti.Vector([v_adjoint / q[1], (0.0 - v_adjoint) * q[0] / q[1] / q[1], 0.0, 0.0])
                    grid_adjoint[ROBOT + d, x] = row


@ti.kernel
def reverse_immersed(
    state: Rows, window: Scalars, flow: Rows, body: Rows, plan: Scalars, dts: Scalars, constants: Scalars, modes: Rows,
    grid: Rows, grid_adjoint: Rows, adjoint: Rows, flow_adjoint: Rows, body_adjoint: Rows, variant: ti.template(),
):  # fmt: skip
    """The adjoint of the planned substeps, from the slot past the last back to the first.

    What happened on the grid is computed again, but for the pressure, which the slots hold.
    """
    ti.loop_config(serialize=True)
    for w in range(state.shape[1]):
        scene = scene_constants(constants, GridWater)
        nodes, dt, n = arena(scene), dts[w], cells(scene)
        for back in range(plan[w, 1]):
            s = plan[w, 0] + plan[w, 1] - 1 - back
            t = s + 1
            load_flow(flow, grid, scene, s, w)
            advect(grid, scene, dt)
            meet_robot(state, window, body, grid, nodes, scene, dt, s, w, variant)
            # from here on STAR stays as advection left it: the meeting is taken back from there
            load_pressure(flow, grid, nodes, scene, dt, t, w)
            press_robot(grid, window, nodes, scene, s, w, False)
            clear_faces(grid_adjoint, window, nodes, s, w)
            for p in range(state.shape[2]):
                from_faces_adjoint(state, adjoint, grid, grid_adjoint, nodes, scene, dt, s, t, w, p, variant)
            press_adjoint(grid, grid_adjoint, window, flow_adjoint, nodes, scene, dt, s, w)
            solve(grid, modes, scene)
            mixture_adjoint(grid, grid_adjoint, nodes, scene)
            for i in range(n.x):
                for j in range(n.y):
                    for k in range(n.z):
                        grid_adjoint[SCALAR, node_of(nodes, i, j, k)] = zero_lanes()
            meet_all_adjoint(grid, grid_adjoint, window, flow_adjoint, nodes, scene, dt, s, w)
            for p in range(state.shape[2]):
                to_faces_adjoint(state, body, adjoint, body_adjoint, grid_adjoint, nodes, scene, dt, s, w, p, variant)
            advect_adjoint(grid, grid_adjoint, scene, dt)
            for i in range(n.x):
                for j in range(n.y):
                    for k in range(n.z):
                        x = node_of(nodes, i, j, k)
                        total = spatial(grid_adjoint[WATER, x]) + only(grid_adjoint[SCALAR, x][0], 3)
                        flow_adjoint[0, w, (i * n.y + j) * n.z + k] = total
