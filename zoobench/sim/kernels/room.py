"""How much of a node's cell lies in the arena, above the ground.

A share of a node's volume is a share of the part that walls leave of it.
"""

import taichi as ti

from zoobench.sim.kernels.boundary import TERRAIN, WALL_NODES

LEAST_FREE_VOLUME = 0.02
"""Least share of a cell that counts as lying before a wall: that of the first node behind it has 1/48."""


@ti.func
def part_before(distance):
    """Share of a quadratic spline that lies before a wall `distance` cells behind the node."""
    a = ti.max(-1.5, ti.min(1.5, distance))
    b = 1.5 - ti.abs(a)
    tail, middle = b * b * b / 6.0, 0.5 - 0.75 * ti.abs(a) + ti.abs(a) * a * a / 3.0
    share = ti.select(ti.abs(a) < 0.5, middle, tail)  # of what lies beyond
    return ti.select(a > 0.0, 1.0 - share, share)


@ti.func
def ground_height(terrain: ti.template(), index: ti.template(), ground: ti.template()):
    """Height of the ground in a node's column above the grid's first node [cells]."""
    height = ti.cast(WALL_NODES, float)
    if ti.static(ground == TERRAIN):
        height = terrain[index[0], index[2]][0]
    return height


@ti.func
def free_volume_along(place, low, count):
    """Share of a node's cell that lies between the walls of one direction, at least `LEAST_FREE_VOLUME`."""
    at = ti.cast(place, float)
    return ti.max(LEAST_FREE_VOLUME, part_before(at - low) * part_before(count - 1.0 - WALL_NODES - at))


@ti.func
def free_volumes(c: ti.template(), index: ti.template()):
    """`free_volume_along` each direction at a node; their product is what lies in the arena, above the ground."""
    low = ti.cast(WALL_NODES, float)
    return ti.Vector([
        free_volume_along(index[0], low, c.scene.nodes_x),
        free_volume_along(index[1], ground_height(c.terrain, index, c.variant.ground), c.scene.nodes_y),
        free_volume_along(index[2], low, c.scene.nodes_z),
    ])  # fmt: skip


@ti.func
def free_volume_beside(c: ti.template(), index: ti.template(), rooms, d: ti.template(), step: ti.template()):
    """Room of the next node (`step` 1) or the last one (-1) along direction d, from the `rooms` at a node."""
    there = [index[e] + ti.static(step * int(d == e)) for e in ti.static(range(3))]
    x, y, z = rooms[0], rooms[1], rooms[2]
    if ti.static(d == 0):
        x = free_volume_along(there[0], ti.cast(WALL_NODES, float), c.scene.nodes_x)
    if ti.static(d == 1 or c.variant.ground == TERRAIN):
        y = free_volume_along(there[1], ground_height(c.terrain, there, c.variant.ground), c.scene.nodes_y)
    if ti.static(d == 2):
        z = free_volume_along(there[2], ti.cast(WALL_NODES, float), c.scene.nodes_z)
    return x * y * z
