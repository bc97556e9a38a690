"""The first half of a substep alone: the nodes' momentum before gravity and contact, for energy balances."""

import taichi as ti

from zoobench.sim.kernels.array_types import Rows, Scalars
from zoobench.sim.kernels.context import Context
from zoobench.sim.kernels.layout import box, constants_of
from zoobench.sim.kernels.serial import clear
from zoobench.sim.kernels.substep import contribution, to_grid


@ti.kernel
def scatter_first(
    state: Rows, window: Scalars, body: Rows, constants: Scalars, grid: Rows, dt: float, variant: ti.template()
):  # fmt: skip
    """Momentum and mass of the nodes that the first world touches at slot 0."""
    ti.loop_config(serialize=True)
    for _ in range(1):
        scene = constants_of(constants, variant)
        nodes = box(window, 0, 0)
        clear(grid, 0, variant.layers * nodes.size, variant)
        c = Context(variant, state=state, body=body, grid=grid, scene=scene, dt=dt, w=0, s=0, nodes=nodes, start=0)
        for p in range(state.shape[2]):
            given = contribution(c, p)
            to_grid(c, p, given, None)
