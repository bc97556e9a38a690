"""Which particles of a medium may sleep: those that nothing moving is near.

Arrays are those of `layout`; `cells` is `[2, nodes]`, all zero, `asleep` `[worlds, particles]`.
"""

import taichi as ti

from zoobench.sim.kernels.array_types import Rows, Scalars
from zoobench.sim.kernels.columns import dot
from zoobench.sim.kernels.layout import MASS, V, X, scene_constants

_MOVING, _NEAR = 0, 1


@ti.func
def cell_of(place, scene: ti.template()):
    """Index of the cell of a place [m] in each direction; of one outside the arena or of no number, some cell in it."""
    cells = place * scene.inverse
    return (
        ti.max(0, ti.min(ti.cast(cells[0], ti.i32), scene.nodes_x - 1)),
        ti.max(0, ti.min(ti.cast(cells[1], ti.i32), scene.nodes_y - 1)),
        ti.max(0, ti.min(ti.cast(cells[2], ti.i32), scene.nodes_z - 1)),
    )


@ti.kernel
def find_sleepers(
    state: Rows, body: Rows, constants: Scalars, cells: Scalars, asleep: Scalars, speed: float, reach: int
):  # fmt: skip
    """Set `asleep` of the medium's particles at slot 0.

    It is 1 where neither the robot nor a particle of the medium of at least `speed` [m/s] is within `reach` cells in
    every direction; but 0 of a particle whose velocity is zero, which has been stopped and may be out of balance.
    """
    ti.loop_config(serialize=True)
    for w in range(state.shape[1]):
        scene = scene_constants(constants)
        for p in range(state.shape[2]):
            v = state[0, w, p, V]
            # a velocity that is no number is not below the speed
            if body[w, p, 0][MASS] > 0.0 and (p < scene.robot or not dot(v, v) < speed * speed):
                x, y, z = cell_of(state[0, w, p, X], scene)
                cells[_MOVING, (x * scene.nodes_y + y) * scene.nodes_z + z] = 1
        for x in range(scene.nodes_x):
            for y in range(scene.nodes_y):
                for z in range(scene.nodes_z):
                    cell = (x * scene.nodes_y + y) * scene.nodes_z + z
                    if cells[_MOVING, cell] != 0:
                        cells[_MOVING, cell] = 0
                        for i in range(ti.max(0, x - reach), ti.min(x + reach + 1, scene.nodes_x)):
                            for j in range(ti.max(0, y - reach), ti.min(y + reach + 1, scene.nodes_y)):
                                for k in range(ti.max(0, z - reach), ti.min(z + reach + 1, scene.nodes_z)):
                                    cells[_NEAR, (i * scene.nodes_y + j) * scene.nodes_z + k] = 1
        for p in range(scene.robot, state.shape[2]):
            x, y, z = cell_of(state[0, w, p, X], scene)
            v, asleep[w, p] = state[0, w, p, V], 0
            if dot(v, v) > 0.0:
                asleep[w, p] = 1 - cells[_NEAR, (x * scene.nodes_y + y) * scene.nodes_z + z]
        for cell in range(cells.shape[1]):
            cells[_NEAR, cell] = 0
