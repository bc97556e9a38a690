"""The pressure that makes a velocity on the faces free of divergence: Poisson's equation by cosine transforms.

lap q = div u with the seven-point Laplacian and walls of no flux has the eigenvectors of the discrete cosine transform
(DCT-II) along every axis: three dense products of fixed order each way, which at some tens of cells an axis cost no
more than a fast transform, are exact to round-off and their own transpose. All is in units of the grid, where div and
grad are differences between neighbours.

`modes` holds for every axis of n cells the transform and its inverse, zeros making up n to a multiple of four, by input
and four outputs a row; then the inverse eigenvalues, in the solver's order of cells: rows of four along z.
"""

import taichi as ti

from zoobench.sim.kernels.columns import zero_lanes
from zoobench.sim.kernels.water_grid.water_layout import SCALAR, SOLVE, arena, cells, node_of, only


@ti.func
def blocks(n):
    """Rows of four that hold n numbers."""
    return (n + 3) // 4


@ti.func
def transform_x(
    grid: ti.template(), modes: ti.template(), matrix, from_row, to_row, n, wide
):  # fmt: skip
    """Product with a matrix along x; `wide` rows lie between neighbours."""
    count = blocks(n)
    for block in range(count):
        for r in range(wide):
            a, b, c, d = zero_lanes(), zero_lanes(), zero_lanes(), zero_lanes()
            for i in range(n):
                share, value = modes[matrix + i * count + block], grid[SOLVE, from_row + i * wide + r]
                a += share[0] * value
                b += share[1] * value
                c += share[2] * value
                d += share[3] * value
            first = to_row + 4 * block * wide + r
            grid[SOLVE, first] = a
            grid[SOLVE, first + wide] = b
            grid[SOLVE, first + 2 * wide] = c
            grid[SOLVE, first + 3 * wide] = d


@ti.func
def transform_z(grid: ti.template(), modes: ti.template(), matrix, from_row, to_row, n, lines):
    """Product with a matrix along z, whose cells are the lanes of rows."""
    count = blocks(n)
    for line in range(lines):
        first = line * count
        for block in range(count):
            total = zero_lanes()
            for r in range(count):
                value, at = grid[SOLVE, from_row + first + r], matrix + 4 * r * count + block
                total += value[0] * modes[at] + value[1] * modes[at + count]
                total += value[2] * modes[at + 2 * count] + value[3] * modes[at + 3 * count]
            grid[SOLVE, to_row + first + block] = total


@ti.func
def solve(grid: ti.template(), modes: ti.template(), scene: ti.template()):
    """SCALAR of the cells, divergence or an adjoint of q, to the q with this Laplacian; a mean is left out."""
    nodes, n = arena(scene), cells(scene)
    bx, by, bz = blocks(n.x), blocks(n.y), blocks(n.z)
    wide_y, wide_x = bz, 4 * by * bz
    half = 4 * bx * wide_x
    for i in range(n.x):
        for j in range(n.y):
            for r in range(bz):
                row = zero_lanes()
                for lane in ti.static(range(4)):
                    if 4 * r + lane < n.z:
                        row += only(grid[SCALAR, node_of(nodes, i, j, 4 * r + lane)][0], lane)
                grid[SOLVE, (i * 4 * by + j) * bz + r] = row
    # the matrices in `modes`: (forward, inverse) of 4 b rows by b each
    at_y = 2 * 4 * bx * bx
    at_z = at_y + 2 * 4 * by * by
    at_values = at_z + 2 * 4 * bz * bz
    transform_x(grid, modes, 0, 0, half, n.x, wide_x)
    for i in range(4 * bx):
        transform_x(grid, modes, at_y, half + i * wide_x, i * wide_x, n.y, wide_y)
    transform_z(grid, modes, at_z, 0, half, n.z, 16 * bx * by)
    for r in range(half):
        grid[SOLVE, half + r] *= modes[at_values + r]
    transform_z(grid, modes, at_z + 4 * bz * bz, half, 0, n.z, 16 * bx * by)
    for i in range(4 * bx):
        transform_x(grid, modes, at_y + 4 * by * by, i * wide_x, half + i * wide_x, n.y, wide_y)
    transform_x(grid, modes, 4 * bx * bx, half, 0, n.x, wide_x)
    for i in range(n.x):
        for j in range(n.y):
            for r in range(bz):
                row = grid[SOLVE, (i * 4 * by + j) * bz + r]
                for lane in ti.static(range(4)):
                    if 4 * r + lane < n.z:
                        grid[SCALAR, node_of(nodes, i, j, 4 * r + lane)] = only(row[lane], 0)


@ti.func
def divergence(grid: ti.template(), field: ti.template(), scene: ti.template()):
    """Differences between the faces of every cell of a velocity to SCALAR."""
    nodes, n = arena(scene), cells(scene)
    for i in range(n.x):
        for j in range(n.y):
            for k in range(n.z):
                x = node_of(nodes, i, j, k)
                here = grid[field, x]
                out = grid[field, x + nodes.sx][0] + grid[field, x + nodes.sy][1] + grid[field, x + 1][2]
                grid[SCALAR, x] = only(out - here[0] - here[1] - here[2], 0)


@ti.func
def gradient(grid: ti.template(), x, i, j, k, nodes: ti.template()):
    """Differences of SCALAR between cell (i, j, k) at node x and its lower neighbours; none on the walls.

    It is the negative transpose of `divergence`.
    """
    here = grid[SCALAR, x][0]
    change = zero_lanes()
    if i > 0:
        change += only(here - grid[SCALAR, x - nodes.sx][0], 0)
    if j > 0:
        change += only(here - grid[SCALAR, x - nodes.sy][0], 1)
    if k > 0:
        change += only(here - grid[SCALAR, x - 1][0], 2)
    return change
