"""Advection of the water's velocity by itself, with viscosity, and the adjoint.

Finite volumes about the faces: u* = u - dt div(a u) + dt nu lap u, explicit. The flux through a side of a volume takes
the velocity a of the sides' own direction as the mean of the two faces beside it, and what it carries from four values
by the third-order upwind-biased interpolation: a (7 (c + m) - mm - p) / 12 + |a| (p - 3 c + 3 m - mm) / 12
(Hundsdorfer et al. 1995). Its error is a fourth derivative in proportion to |a|: what is slow is hardly damped. That is
why it was chosen over the particles' transfers, whose viscosity does not vanish with the speed. Walls are smooth:
beyond them is the mirror image, with the normal velocity turned.

All three directions of velocity are lanes of one row: the sides of the volumes of all three about node x towards its
lower neighbour along e lie alike, and have the speeds (u_e(x) + u_e(x - e_d)) / 2, d their lane.
"""

import taichi as ti

from zoobench.sim.kernels.columns import zero_lanes
from zoobench.sim.kernels.water_grid.water_layout import (
    STAR,
    WATER,
    arena,
    cells,
    chosen,
    direction_row,
    node_of,
    only,
)

UPWIND = 1.0
"""Share of the upwind term: 1 is third-order upwind-biased, 0 central of fourth order, which damps nothing."""


@ti.func
def along_wall(row, normal):
    """The row without the velocity along a wall's normal."""
    return row - row * normal


@ti.func
def load_flow(flow: ti.template(), grid: ti.template(), scene: ti.template(), s, w):
    """The water at slot s into WATER, with the mirror images that `advect` needs."""
    nodes, n = arena(scene), cells(scene)
    for i in range(n.x):
        for j in range(n.y):
            for k in range(n.z):
                grid[WATER, node_of(nodes, i, j, k)] = flow[s, w, (i * n.y + j) * n.z + k]
    for e in range(3):
        normal, step, count = direction_row(e), chosen(e, nodes.sx, nodes.sy, 1), chosen(e, n.x, n.y, n.z)
        n_x, n_y, n_z = chosen(e, 1, n.x, n.x), chosen(e, n.y, 1, n.y), chosen(e, n.z, n.z, 1)
        for i in range(n_x):
            for j in range(n_y):
                for k in range(n_z):
                    low = node_of(nodes, i, j, k)
                    high = low + (count - 1) * step
                    first, last, before = grid[WATER, low], grid[WATER, high], grid[WATER, high - step]
                    # a normal velocity is mirrored by the face on the wall, others by the wall between two cells
                    grid[WATER, low - step] = along_wall(first, normal) - grid[WATER, low + step] * normal
                    grid[WATER, high + step] = along_wall(last, normal)
                    grid[WATER, high + 2 * step] = along_wall(before, normal) - last * normal


@ti.func
def load_flow_adjoint(grid_adjoint: ti.template(), scene: ti.template()):
    """Adjoint of the mirror images of `load_flow`: added to what they are images of."""
    nodes, n = arena(scene), cells(scene)
    for e in range(3):
        normal, step, count = direction_row(e), chosen(e, nodes.sx, nodes.sy, 1), chosen(e, n.x, n.y, n.z)
        n_x, n_y, n_z = chosen(e, 1, n.x, n.x), chosen(e, n.y, 1, n.y), chosen(e, n.z, n.z, 1)
        for i in range(n_x):
            for j in range(n_y):
                for k in range(n_z):
                    low = node_of(nodes, i, j, k)
                    high = low + (count - 1) * step
                    below, wall = grid_adjoint[WATER, low - step], grid_adjoint[WATER, high + step]
                    above = grid_adjoint[WATER, high + 2 * step]
                    grid_adjoint[WATER, low] += along_wall(below, normal)
                    grid_adjoint[WATER, low + step] += -1.0 * below * normal
                    grid_adjoint[WATER, high] += along_wall(wall, normal) - above * normal
                    grid_adjoint[WATER, high - step] += along_wall(above, normal)


@ti.func
def magnitude(a):
    """|a|, lane by lane."""
    return ti.Vector([ti.abs(a[d]) for d in ti.static(range(4))])


@ti.func
def speeds(grid: ti.template(), x, nodes: ti.template(), e: ti.template()):
    """Speeds along e through the lower sides of the volumes of all directions about node x."""
    own = grid[WATER, x][e]
    return ti.Vector(
        [
            0.5 * (own + grid[WATER, x - nodes.sx][e]),
            0.5 * (own + grid[WATER, x - nodes.sy][e]),
            0.5 * (own + grid[WATER, x - 1][e]),
            0.0,
        ]
    )


@ti.func
def advect(grid: ti.template(), scene: ti.template(), dt):
    """WATER, with its mirror images, to STAR after advection and viscosity; zero on the walls."""
    nodes, n = arena(scene), cells(scene)
    courant, spread = dt * scene.inverse, dt * scene.medium.viscosity * scene.inverse * scene.inverse
    for i in range(n.x + 1):
        for j in range(n.y + 1):
            for k in range(n.z + 1):
                x = node_of(nodes, i, j, k)
                grid[STAR, x] = grid[WATER, x]
    for e in ti.static(range(3)):
        step = (nodes.sx, nodes.sy, 1)[e]
        for i in range(ti.static(int(e == 0)), n.x + ti.static(int(e == 0))):
            for j in range(ti.static(int(e == 1)), n.y + ti.static(int(e == 1))):
                for k in range(ti.static(int(e == 2)), n.z + ti.static(int(e == 2))):
                    x = node_of(nodes, i, j, k)
                    mm, m = grid[WATER, x - 2 * step], grid[WATER, x - step]
                    c, p = grid[WATER, x], grid[WATER, x + step]
                    a = speeds(grid, x, nodes, e)
                    flux = a * (7.0 * (m + c) - mm - p) + UPWIND * magnitude(a) * (p + 3.0 * (m - c) - mm)
                    passed = (courant / 12.0) * flux + spread * (m - c)
                    grid[STAR, x] += passed
                    grid[STAR, x - step] += -1.0 * passed
    hold_walls(grid, STAR, scene)


@ti.func
def hold_walls(grid: ti.template(), field: ti.template(), scene: ti.template()):
    """No velocity through the walls."""
    nodes, n = arena(scene), cells(scene)
    for e in range(3):
        normal, step, count = direction_row(e), chosen(e, nodes.sx, nodes.sy, 1), chosen(e, n.x, n.y, n.z)
        n_x, n_y, n_z = chosen(e, 1, n.x, n.x), chosen(e, n.y, 1, n.y), chosen(e, n.z, n.z, 1)
        for i in range(n_x):
            for j in range(n_y):
                for k in range(n_z):
                    x = node_of(nodes, i, j, k)
                    grid[field, x] = along_wall(grid[field, x], normal)
                    grid[field, x + count * step] = zero_lanes()


@ti.func
def advect_adjoint(grid: ti.template(), grid_adjoint: ti.template(), scene: ti.template(), dt):
    """Adjoint of `advect`: from that of STAR, zero on the walls, to that of WATER with its mirror images."""
    nodes, n = arena(scene), cells(scene)
    courant, spread = dt * scene.inverse, dt * scene.medium.viscosity * scene.inverse * scene.inverse
    edge = ti.static(2)
    for i in range(-edge, n.x + edge):
        for j in range(-edge, n.y + edge):
            for k in range(-edge, n.z + edge):
                x = node_of(nodes, i, j, k)
                grid_adjoint[WATER, x] = zero_lanes()
                if ti.min(i, j, k) >= 0 and i < n.x and j < n.y and k < n.z:
                    grid_adjoint[WATER, x] = grid_adjoint[STAR, x]
    for e in ti.static(range(3)):
        step = (nodes.sx, nodes.sy, 1)[e]
        for i in range(ti.static(int(e == 0)), n.x + ti.static(int(e == 0))):
            for j in range(ti.static(int(e == 1)), n.y + ti.static(int(e == 1))):
                for k in range(ti.static(int(e == 2)), n.z + ti.static(int(e == 2))):
                    x = node_of(nodes, i, j, k)
                    mm, m = grid[WATER, x - 2 * step], grid[WATER, x - step]
                    c, p = grid[WATER, x], grid[WATER, x + step]
                    a = speeds(grid, x, nodes, e)
                    size = UPWIND * magnitude(a)
                    passed = grid_adjoint[STAR, x] - grid_adjoint[STAR, x - step]
                    flux = (courant / 12.0) * passed
                    grid_adjoint[WATER, x - 2 * step] += (0.0 - flux) * (a + size)
                    grid_adjoint[WATER, x - step] += flux * (7.0 * a + 3.0 * size) + spread * passed
                    grid_adjoint[WATER, x] += flux * (7.0 * a - 3.0 * size) - spread * passed
                    grid_adjoint[WATER, x + step] += flux * (size - a)
                    carried, upwind = 7.0 * (m + c) - mm - p, UPWIND * (p + 3.0 * (m - c) - mm)
                    by = [0.5 * flux[d] * (carried[d] + ti.math.sign(a[d]) * upwind[d]) for d in ti.static(range(3))]
                    grid_adjoint[WATER, x] += only(by[0] + by[1] + by[2], e)
                    grid_adjoint[WATER, x - nodes.sx] += only(by[0], e)
                    grid_adjoint[WATER, x - nodes.sy] += only(by[1], e)
                    grid_adjoint[WATER, x - 1] += only(by[2], e)
    load_flow_adjoint(grid_adjoint, scene)
