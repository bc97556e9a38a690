"""The substep of a robot in water on a grid and its adjoint, for one thread; for arrays see `layout`, `water_layout`.

The worlds are taken in turn through one grid. All sums are in a fixed order.
"""

import taichi as ti

from zoobench.sim.kernels.array_types import Rows, Scalars
from zoobench.sim.kernels.boundary import WALL_NODES
from zoobench.sim.kernels.columns import dot, spatial, zero_lanes
from zoobench.sim.kernels.context import Context
from zoobench.sim.kernels.layout import X, constants_of
from zoobench.sim.kernels.splines import first_node
from zoobench.sim.kernels.water_grid.advection import advect, advect_adjoint, hold_walls, load_flow
from zoobench.sim.kernels.water_grid.drag import drag_velocities, drag_velocities_adjoint
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
    direction_row,
    node_of,
    only,
)


@ti.func
def each_face(c: ti.template(), visit: ti.template()):
    """Visit the faces of the robot's window, direction by direction, with their node and the index of their cell."""
    for d in range(3):
        for i in range(c.window[c.s, c.w, 0], c.window[c.s, c.w, 3]):
            for j in range(c.window[c.s, c.w, 1], c.window[c.s, c.w, 4]):
                first = i * c.nodes.sx + j * c.nodes.sy
                for k in range(c.window[c.s, c.w, 2], c.window[c.s, c.w, 5]):
                    visit(c, d, first + k, (i - WALL_NODES, j - WALL_NODES, k - WALL_NODES))


@ti.func
def each_cell(c: ti.template(), visit: ti.template()):
    """Visit the cells between the walls with their node and their index."""
    n = cells(c.scene)
    for i in range(n.x):
        for j in range(n.y):
            for k in range(n.z):
                visit(c, node_of(c.nodes, i, j, k), (i, j, k))


@ti.func
def place_in(c: ti.template(), index: ti.template()):
    """The place of a cell in the arrays of the flow."""
    n = cells(c.scene)
    return (index[0] * n.y + index[1]) * n.z + index[2]


@ti.func
def inside(c: ti.template(), index: ti.template(), d):
    """True for a face of direction d of a cell with water on both sides."""
    n, found = cells(c.scene), index[0] >= 0 and index[1] >= 0 and index[2] >= 0
    found = found and index[0] < n.x and index[1] < n.y and index[2] < n.z
    return found and chosen(d, index[0], index[1], index[2]) > 0


@ti.func
def on_wall(c: ti.template(), index: ti.template(), d):
    """True for a face on or behind a wall with a normal along d."""
    n, (i, j, k) = cells(c.scene), index
    return chosen(d, i, j, k) <= 0 or chosen(d, i - n.x, j - n.y, k - n.z) >= 0


@ti.func
def stride(c: ti.template(), d):
    """From a node to the next in direction d."""
    return chosen(d, c.nodes.sx, c.nodes.sy, 1)


@ti.func
def clear_face(c: ti.template(), d, x, index: ti.template()):
    """Zero the robot's row of a face."""
    c.grid[ROBOT + d, x] = zero_lanes()


@ti.func
def clear_face_adjoint(c: ti.template(), d, x, index: ti.template()):
    """Zero its adjoint."""
    c.grid_adjoint[ROBOT + d, x] = zero_lanes()


@ti.func
def pull(c: ti.template(), x, d):
    """Gravity and the last substep's gradient of pressure over density along d at a face [m/s^2]."""
    gravity = chosen(d, c.scene.g_x, c.scene.g_y, c.scene.g_z)
    return gravity + c.grid[WATER, x][3] - c.grid[WATER, x - stride(c, d)][3]


@ti.func
def meet(c: ti.template(), d, x, index: ti.template()):
    """ROBOT and STAR to MOVED: the velocity of the robot, the changes of the water's and of the mixture's."""
    q, moved = c.grid[ROBOT + d, x], zero_lanes()
    if q[1] > 0.0:
        if inside(c, index, d):
            u = dot(c.grid[STAR, x], direction_row(d))
            v, after, phi = drag_velocities(q, u, pull(c, x, d), c.dt, c.scene)
            moved = ti.Vector([v, after - u, after - u + phi * (v - after), 0.0])
        elif not on_wall(c, index, d):
            moved = only(q[0] / q[1], 0)
    c.grid[MOVED + d, x] = moved


@ti.func
def add_mixture(c: ti.template(), d, x, index: ti.template()):
    """Divergence of what the robot changes in the mixture's velocity, added to SCALAR."""
    change = c.grid[MOVED + d, x][2]
    if change != 0.0:
        c.grid[SCALAR, x] += only(0.0 - change, 0)
        c.grid[SCALAR, x - stride(c, d)] += only(change, 0)


@ti.func
def press_robot(c: ti.template(), d, x, index: ti.template()):
    """The robot's velocity in MOVED without the gradient of SCALAR."""
    if c.grid[ROBOT + d, x][1] > 0.0 and inside(c, index, d):
        c.grid[MOVED + d, x] += only(c.grid[SCALAR, x - stride(c, d)][0] - c.grid[SCALAR, x][0], 0)


@ti.func
def press_both(c: ti.template(), d, x, index: ti.template()):
    """The same, and the change of the water's velocity into STAR."""
    if c.grid[ROBOT + d, x][1] > 0.0 and inside(c, index, d):
        c.grid[STAR, x] += c.grid[MOVED + d, x][1] * direction_row(d)
    press_robot(c, d, x, index)


@ti.func
def store_flow(c: ti.template(), x, index: ti.template()):
    """STAR without the gradient of SCALAR to slot t, and the pressure."""
    after = spatial(c.grid[STAR, x] - gradient(c.grid, x, index[0], index[1], index[2], c.nodes))
    c.flow[c.t, c.w, place_in(c, index)] = after + only(c.grid[SCALAR, x][0] / c.dt, 3)


@ti.func
def find_window(c: ti.template()):
    """The window of the faces that the particles touch at slot t."""
    width = ti.static(c.variant.width)
    for d in range(3):
        count = chosen(d, c.scene.nodes_x, c.scene.nodes_y, c.scene.nodes_z)
        low, high = count, 0
        for p in range(c.state.shape[2]):
            place = dot(c.state[c.t, c.w, p, X], direction_row(d)) * c.scene.inverse
            # faces of direction d lie half a cell beside those of the others
            low = ti.min(low, first_node(place - 0.5, count, width))
            high = ti.max(high, first_node(place, count, width) + width)
        c.window[c.t, c.w, d], c.window[c.t, c.w, 3 + d] = low, high


@ti.func
def meet_robot(c: ti.template()):
    """The robot at slot s to the faces, where it meets the water in STAR."""
    each_face(c, clear_face)
    for p in range(c.state.shape[2]):
        to_faces(c, p)
    each_face(c, meet)


@ti.kernel
def advance_immersed(
    state: Rows, window: Scalars, flow: Rows, body: Rows, plan: Scalars, dts: Scalars, constants: Scalars, modes: Rows,
    grid: Rows, stride: int, variant: ti.template(),
):  # fmt: skip
    """The planned substeps of every world; each writes `stride` slots further (0: in place)."""
    ti.loop_config(serialize=True)
    for w in range(state.shape[1]):
        scene = constants_of(constants, variant)
        nodes, dt = arena(scene), dts[w]
        for n in range(plan[w, 1]):
            s = plan[w, 0] + n * stride
            t = s + stride
            c = Context(
                variant, state=state, window=window, flow=flow, body=body, grid=grid, scene=scene, nodes=nodes, dt=dt,
                w=w, s=s, t=t,
            )  # fmt: skip
            load_flow(flow, grid, scene, s, w)
            advect(grid, scene, dt)
            meet_robot(c)
            divergence(grid, STAR, scene)
            each_face(c, add_mixture)
            solve(grid, modes, scene)
            each_face(c, press_both)
            for p in range(state.shape[2]):
                from_faces(c, p)
            each_cell(c, store_flow)
            find_window(c)


@ti.func
def load_pressure(c: ti.template(), x, index: ti.template()):
    """The pressure at slot t, which the substep to it found, to SCALAR."""
    c.grid[SCALAR, x] = only(c.dt * c.flow[c.t, c.w, place_in(c, index)][3], 0)


@ti.func
def add_pressure_adjoint(c: ti.template(), x, index: ti.template()):
    """Adjoint of the gradient of SCALAR by the pressure, to SCALAR."""
    pressure = c.flow_adjoint[0, c.w, place_in(c, index)][3]
    c.grid[SCALAR, x] = c.grid_adjoint[SCALAR, x] + only(pressure / c.dt, 0)


@ti.func
def press_robot_adjoint(c: ti.template(), d, x, index: ti.template()):
    """Adjoint of `press_robot` by SCALAR."""
    if c.grid[ROBOT + d, x][1] > 0.0 and inside(c, index, d):
        push = c.grid_adjoint[ROBOT + d, x][0]
        c.grid[SCALAR, x] += only(0.0 - push, 0)
        c.grid[SCALAR, x - stride(c, d)] += only(push, 0)


@ti.func
def pressure_adjoint(c: ti.template()):
    """Adjoint of the gradients of SCALAR, to SCALAR: by the water's and the robot's velocity, and by the pressure.

    The adjoint of the water's new velocity also becomes that of STAR, zero on the walls.
    """
    n = cells(c.scene)
    for i in range(n.x + 1):
        for j in range(n.y + 1):
            for k in range(n.z + 1):
                x, given = node_of(c.nodes, i, j, k), zero_lanes()
                if i < n.x and j < n.y and k < n.z:
                    given = c.flow_adjoint[0, c.w, (i * n.y + j) * n.z + k]
                c.grid_adjoint[STAR, x] = spatial(given)
                c.grid_adjoint[SCALAR, x] = only(given[3], 0)
    hold_walls(c.grid_adjoint, STAR, c.scene)
    # div is the negative transpose of grad
    divergence(c.grid_adjoint, STAR, c.scene)
    each_cell(c, add_pressure_adjoint)
    each_face(c, press_robot_adjoint)


@ti.func
def mixture_adjoint(c: ti.template(), x, index: ti.template()):
    """Adjoint of the divergence in SCALAR by the mixture's velocity, added to that of STAR."""
    c.grid_adjoint[STAR, x] += -1.0 * gradient(c.grid, x, index[0], index[1], index[2], c.nodes)


@ti.func
def clear_scalar_adjoint(c: ti.template(), x, index: ti.template()):
    """Zero the adjoint of SCALAR."""
    c.grid_adjoint[SCALAR, x] = zero_lanes()


@ti.func
def meet_adjoint(c: ti.template(), d, x, index: ti.template()):
    """Adjoint of `meet`: those of the robot's rows in ROBOT, of the water's velocity in STAR and of the pressure of the
    last substep in SCALAR, which begins at zero."""
    q, row = c.grid[ROBOT + d, x], zero_lanes()
    if q[1] > 0.0:
        v_adjoint = c.grid_adjoint[ROBOT + d, x][0]
        if inside(c, index, d):
            before = x - stride(c, d)
            mixture = c.grid[SCALAR, before][0] - c.grid[SCALAR, x][0]
            # STAR holds the sum of the adjoints of the water's and of the mixture's velocity
            whole, u = dot(c.grid_adjoint[STAR, x], direction_row(d)), dot(c.grid[STAR, x], direction_row(d))
            row, star, lift = drag_velocities_adjoint(c, q, u, pull(c, x, d), v_adjoint, whole - mixture, mixture)
            c.grid_adjoint[STAR, x] += (star - whole) * direction_row(d)
            c.grid_adjoint[SCALAR, x] += only(lift, 0)
            c.grid_adjoint[SCALAR, before] += only(0.0 - lift, 0)
        elif not on_wall(c, index, d):
            # divided twice, as the square of a mass below 1e-23 kg is 0 in float32
            row = ti.Vector([v_adjoint / q[1], (0.0 - v_adjoint) * q[0] / q[1] / q[1], 0.0, 0.0])
    c.grid_adjoint[ROBOT + d, x] = row


@ti.func
def store_flow_adjoint(c: ti.template(), x, index: ti.template()):
    """The adjoint of the water at slot s."""
    total = spatial(c.grid_adjoint[WATER, x]) + only(c.grid_adjoint[SCALAR, x][0], 3)
    c.flow_adjoint[0, c.w, place_in(c, index)] = total


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
        scene = constants_of(constants, variant)
        nodes, dt = arena(scene), dts[w]
        for back in range(plan[w, 1]):
            s = plan[w, 0] + plan[w, 1] - 1 - back
            t = s + 1
            c = Context(
                variant, state=state, window=window, flow=flow, body=body, grid=grid, scene=scene, nodes=nodes, dt=dt,
                w=w, s=s, t=t, grid_adjoint=grid_adjoint, adjoint=adjoint, flow_adjoint=flow_adjoint,
                body_adjoint=body_adjoint,
            )  # fmt: skip
            load_flow(flow, grid, scene, s, w)
            advect(grid, scene, dt)
            meet_robot(c)
            # from here on STAR stays as advection left it: the meeting is taken back from there
            each_cell(c, load_pressure)
            each_face(c, press_robot)
            each_face(c, clear_face_adjoint)
            for p in range(state.shape[2]):
                from_faces_adjoint(c, p)
            pressure_adjoint(c)
            solve(grid, modes, scene)
            each_cell(c, mixture_adjoint)
            each_cell(c, clear_scalar_adjoint)
            each_face(c, meet_adjoint)
            for p in range(state.shape[2]):
                to_faces_adjoint(c, p)
            advect_adjoint(grid, grid_adjoint, scene, dt)
            each_cell(c, store_flow_adjoint)
