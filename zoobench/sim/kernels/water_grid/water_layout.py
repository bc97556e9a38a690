"""How water on a grid lies in the arrays that kernels take; `layout` has the others.

flow     [slots, worlds, cells, 4] velocity on the lower faces of the arena's cells [m/s], and pressure over density
         and grid spacing in them [m/s^2]
modes    [rows, 4] of the pressure's solver, see `pressure`
grid     [fields, nodes] fields of the nodes, below; all nodes of the arena, of one world
"""

import taichi as ti

from zoobench.sim.kernels.boundary import WALL_NODES

ROBOT, MOVED, WATER, STAR, SCALAR, SOLVE = 0, 3, 6, 7, 8, 9
"""Fields of the grid. Of the robot one for each direction: (momentum, mass, volume, volume times cover) of the faces;
after the meeting (velocity, change of the water's velocity, change of the mixture's velocity, 0). Of the water: its
velocity and pressure at the substep's beginning with mirror images, and its velocity after advection; a scalar of the
cells; and the cells in the solver's own order."""

FIELDS = 10


@ti.func
def arena(scene: ti.template()):
    """The box of all nodes: strides and first node."""
    sy = scene.nodes_z
    sx = scene.nodes_y * sy
    return ti.Struct(sx=sx, sy=sy, origin=0, size=scene.nodes_x * sx)


@ti.func
def cells(scene: ti.template()):
    """Number of cells between the walls in each direction."""
    room = ti.static(2 * WALL_NODES + 1)
    return ti.Struct(x=scene.nodes_x - room, y=scene.nodes_y - room, z=scene.nodes_z - room)


@ti.func
def node_of(nodes: ti.template(), i, j, k):
    """The node of cell (i, j, k) between the walls."""
    return (i + WALL_NODES) * nodes.sx + (j + WALL_NODES) * nodes.sy + k + WALL_NODES


@ti.func
def direction_row(d):
    """The row that is 1 in lane d and 0 elsewhere, of a direction that is known at run time.

    Directions are loops at run time where speed allows: unrolled, their bodies would be compiled three times.
    """
    return ti.Vector([ti.cast(d == n, float) for n in ti.static(range(4))])


@ti.func
def chosen(d, x, y, z):
    """The one of three numbers that belongs to direction d."""
    found = x
    if d == 1:
        found = y
    if d == 2:
        found = z
    return found


@ti.func
def only(value, lane: ti.template()):
    """A row with this value in one lane."""
    return ti.Vector([value * ti.static(int(lane == n)) for n in ti.static(range(4))])
