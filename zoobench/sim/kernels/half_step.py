"""The first half of a substep alone: the nodes' momentum before gravity and contact, for energy balances."""

import taichi as ti

from zoobench.sim.kernels.array_types import Rows, Scalars
from zoobench.sim.kernels.layout import box, scene_constants
from zoobench.sim.kernels.serial import scatter_all


@ti.kernel
def scatter_first(
    state: Rows, window: Scalars, body: Rows, constants: Scalars, grid: Rows, dt: float, variant: ti.template()
):  # fmt: skip
    """Momentum and mass of the nodes that the first world touches at slot 0."""
    ti.loop_config(serialize=True)
    for _ in range(1):
        scene = scene_constants(constants)
        nodes = box(window, 0, 0)
        scatter_all(state, body, grid, 0, nodes, scene, dt, 0, 0, variant)
