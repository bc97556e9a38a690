"""The first half of a substep alone: the nodes' momentum before gravity and contact, for energy balances."""

import taichi as ti

from zoobench.sim.kernels.array_types import Matrices, Nodes, Pairs, Scalars, Symmetric, Vectors
from zoobench.sim.kernels.media import WATER
from zoobench.sim.kernels.serial import clear_ratios, clear_window
from zoobench.sim.kernels.substep import to_grid
from zoobench.sim.kernels.transfer import AFLIP


@ti.kernel
def scatter_all(
    x: Vectors, v: Vectors, C: Matrices, F: Matrices, b: Symmetric, history: Scalars, tau: Symmetric, window: Scalars,
    mass: Scalars, volume: Scalars, stiffness: Scalars, tension: Scalars, fibre: Vectors,
    grid: Nodes, before: Nodes, ratios: Pairs, dt: float, h: float,
    mu: float, lam: float, eta: float, m0: float, m1: float, m2: float, m3: float, m4: float,
    muscle: ti.template(), damping: ti.template(), law: ti.template(), width: ti.template(), transfer: ti.template(),
):  # fmt: skip
    """Momentum and mass of the nodes that the first world touches at slot 0, in the first slab."""
    ti.loop_config(serialize=True)
    for _ in range(1):
        clear_window(grid, window, 0, 0)
        if ti.static(transfer == AFLIP):
            clear_window(before, window, 0, 0)
        if ti.static(law == WATER):
            clear_ratios(ratios, window, 0, 0)
        constants = ti.Vector([m0, m1, m2, m3, m4])
        for p in range(x.shape[2]):
            to_grid(
                x, v, C, F, history, tau, mass, volume, stiffness, tension, fibre,
                grid, before, ratios, 0, 0, 0, p, 1.0 / h, dt, mu, lam, eta, constants,
                muscle, damping, law, width, transfer,
            )  # fmt: skip
