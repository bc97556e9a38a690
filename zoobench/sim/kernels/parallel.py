"""The substep and its adjoint for many threads (CUDA): one substep of all worlds at once, each in its slab of the grid.

Arrays are those of `serial`. The sums are atomic, so that results differ in the last bits from run to run.
"""

import taichi as ti

from zoobench.sim.kernels.array_types import Matrices, Nodes, Pairs, Scalars, Symmetric, Vectors
from zoobench.sim.kernels.flip import divide_node, divide_node_adjoint
from zoobench.sim.kernels.media import WATER
from zoobench.sim.kernels.substep import (
    from_grid,
    from_grid_adjoint,
    press_node,
    press_node_adjoint,
    to_grid,
    to_grid_adjoint,
    update_node,
    update_node_adjoint,
)
from zoobench.sim.kernels.transfer import AFLIP


@ti.func
def in_use(window: ti.template(), plan: ti.template(), ahead, w, i, j, k):
    """True if a node lies in the window of world w, `ahead` slots after its first."""
    s = plan[w, 0] + ahead
    inside = window[s, w, 0] <= i and i < window[s, w, 3]
    inside = inside and window[s, w, 1] <= j and j < window[s, w, 4]
    return inside and window[s, w, 2] <= k and k < window[s, w, 5]


@ti.kernel
def advance_parallel(
    x: Vectors, v: Vectors, C: Matrices, F: Matrices, b: Symmetric, history: Scalars, tau: Symmetric, window: Scalars,
    mass: Scalars, volume: Scalars, stiffness: Scalars, tension: Scalars, fibre: Vectors,
    plan: Scalars, dts: Scalars, terrain: Nodes, grid: Nodes, before: Nodes, ratios: Pairs,
    n: int, stride: int, h: float,
    mu: float, lam: float, eta: float, m0: float, m1: float, m2: float, m3: float, m4: float,
    g_x: float, g_y: float, g_z: float, mu_ground: float,
    muscle: ti.template(), damping: ti.template(), law: ti.template(), ground: ti.template(),
    width: ti.template(), transfer: ti.template(),
):  # fmt: skip
    """The n-th planned substep of all worlds at once; it writes `stride` slots further (0: in place)."""
    for w, i, j, k in ti.ndrange(grid.shape[0], grid.shape[1], grid.shape[2], grid.shape[3]):
        if n < plan[w, 1] and in_use(window, plan, n * stride, w, i, j, k):
            grid[w, i, j, k] = ti.Vector([0.0, 0.0, 0.0, 0.0])
            if ti.static(transfer == AFLIP):
                before[w, i, j, k] = ti.Vector([0.0, 0.0, 0.0, 0.0])
            if ti.static(law == WATER):
                ratios[w, i, j, k] = ti.Vector([0.0, 0.0])
    for w, p in ti.ndrange(x.shape[1], x.shape[2]):
        if n < plan[w, 1]:
            s = plan[w, 0] + n * stride
            to_grid(
                x, v, C, F, history, tau, mass, volume, stiffness, tension, fibre,
                grid, before, ratios, w, s, w, p, 1.0 / h, dts[w], mu, lam, eta, ti.Vector([m0, m1, m2, m3, m4]),
                muscle, damping, law, width, transfer,
            )  # fmt: skip
    for w, i, j, k in ti.ndrange(grid.shape[0], grid.shape[1], grid.shape[2], grid.shape[3]):
        if n < plan[w, 1] and in_use(window, plan, n * stride, w, i, j, k):
            dt_g = dts[w] * ti.Vector([g_x, g_y, g_z])
            update_node(grid, grid, w, i, j, k, dt_g, mu_ground, terrain, ground, law)
            if ti.static(transfer == AFLIP):
                divide_node(before, before, w, i, j, k)
    if ti.static(law == WATER):
        for w, i, j, k in ti.ndrange(grid.shape[0], grid.shape[1], grid.shape[2], grid.shape[3]):
            if n < plan[w, 1] and in_use(window, plan, n * stride, w, i, j, k):
                press_node(grid, w, i, j, k, ground)
    # an empty window of the next slot, which the particles extend below
    for w, d in ti.ndrange(x.shape[1], 3):
        if n < plan[w, 1]:
            t = plan[w, 0] + (n + 1) * stride
            window[t, w, d] = grid.shape[1] + grid.shape[2] + grid.shape[3]
            window[t, w, 3 + d] = 0
    for w, p in ti.ndrange(x.shape[1], x.shape[2]):
        if n < plan[w, 1]:
            s = plan[w, 0] + n * stride
            t = s + stride
            base = from_grid(
                x, v, C, F, b, history, tau, grid, before, ratios, w, s, t, w, p, 1.0 / h, dts[w],
                ti.Vector([m0, m1, m2, m3, m4]), law, width, transfer,
            )  # fmt: skip
            for d in ti.static(range(3)):
                ti.atomic_min(window[t, w, d], base[d])
                ti.atomic_max(window[t, w, 3 + d], base[d] + width)


@ti.kernel
def reverse_parallel(
    x: Vectors, v: Vectors, C: Matrices, F: Matrices, b: Symmetric, history: Scalars, tau: Symmetric, window: Scalars,
    mass: Scalars, volume: Scalars, stiffness: Scalars, tension: Scalars, fibre: Vectors,
    plan: Scalars, dts: Scalars, terrain: Nodes, grid: Nodes, before: Nodes, ratios: Pairs,
    grid_velocity: Nodes, grid_adjoint: Nodes, before_adjoint: Nodes, ratios_adjoint: Pairs,
    x_adj: Vectors, v_adj: Vectors, C_adj: Matrices, F_adj: Matrices,
    b_adj: Symmetric, history_adj: Scalars, tau_adj: Symmetric,
    mass_adj: Scalars, volume_adj: Scalars, stiffness_adj: Scalars, tension_adj: Scalars, fibre_adj: Vectors,
    n: int, h: float,
    mu: float, lam: float, eta: float, m0: float, m1: float, m2: float, m3: float, m4: float,
    g_x: float, g_y: float, g_z: float, mu_ground: float,
    muscle: ti.template(), damping: ti.template(), law: ti.template(), ground: ti.template(),
    width: ti.template(), transfer: ti.template(),
):  # fmt: skip
    """The adjoint of the n-th planned substep of all worlds at once."""
    for w, i, j, k in ti.ndrange(grid.shape[0], grid.shape[1], grid.shape[2], grid.shape[3]):
        if n < plan[w, 1] and in_use(window, plan, n, w, i, j, k):
            grid[w, i, j, k] = ti.Vector([0.0, 0.0, 0.0, 0.0])
            grid_velocity[w, i, j, k] = ti.Vector([0.0, 0.0, 0.0, 0.0])
            grid_adjoint[w, i, j, k] = ti.Vector([0.0, 0.0, 0.0, 0.0])
            if ti.static(transfer == AFLIP):
                before[w, i, j, k] = ti.Vector([0.0, 0.0, 0.0, 0.0])
                before_adjoint[w, i, j, k] = ti.Vector([0.0, 0.0, 0.0, 0.0])
            if ti.static(law == WATER):
                ratios[w, i, j, k] = ti.Vector([0.0, 0.0])
                ratios_adjoint[w, i, j, k] = ti.Vector([0.0, 0.0])
    for w, p in ti.ndrange(x.shape[1], x.shape[2]):
        if n < plan[w, 1]:
            s = plan[w, 0] + n
            to_grid(
                x, v, C, F, history, tau, mass, volume, stiffness, tension, fibre,
                grid, before, ratios, w, s, w, p, 1.0 / h, dts[w], mu, lam, eta, ti.Vector([m0, m1, m2, m3, m4]),
                muscle, damping, law, width, transfer,
            )  # fmt: skip
    for w, i, j, k in ti.ndrange(grid.shape[0], grid.shape[1], grid.shape[2], grid.shape[3]):
        if n < plan[w, 1] and in_use(window, plan, n, w, i, j, k):
            dt_g = dts[w] * ti.Vector([g_x, g_y, g_z])
            update_node(grid, grid_velocity, w, i, j, k, dt_g, mu_ground, terrain, ground, law)
            if ti.static(transfer == AFLIP):
                divide_node(before, before, w, i, j, k)
    if ti.static(law == WATER):
        for w, i, j, k in ti.ndrange(grid.shape[0], grid.shape[1], grid.shape[2], grid.shape[3]):
            if n < plan[w, 1] and in_use(window, plan, n, w, i, j, k):
                press_node(grid_velocity, w, i, j, k, ground)
    for w, p in ti.ndrange(x.shape[1], x.shape[2]):
        if n < plan[w, 1]:
            s = plan[w, 0] + n
            from_grid_adjoint(
                x, v, C, F, b, history, grid_velocity, before, ratios, grid_adjoint, before_adjoint, ratios_adjoint,
                x_adj, v_adj, C_adj, F_adj, b_adj, history_adj, tau_adj,
                w, s, s + 1, w, p, 1.0 / h, dts[w], ti.Vector([m0, m1, m2, m3, m4]), law, width, transfer,
            )  # fmt: skip
    if ti.static(law == WATER):
        for w, i, j, k in ti.ndrange(grid.shape[0], grid.shape[1], grid.shape[2], grid.shape[3]):
            if n < plan[w, 1] and in_use(window, plan, n, w, i, j, k):
                press_node_adjoint(
                    grid, grid_velocity, grid_adjoint, w, i, j, k, dts[w] * ti.Vector([g_x, g_y, g_z]), ground
                )
    for w, i, j, k in ti.ndrange(grid.shape[0], grid.shape[1], grid.shape[2], grid.shape[3]):
        if n < plan[w, 1] and in_use(window, plan, n, w, i, j, k):
            dt_g = dts[w] * ti.Vector([g_x, g_y, g_z])
            update_node_adjoint(grid, grid_adjoint, w, i, j, k, dt_g, mu_ground, terrain, ground, law)
            if ti.static(transfer == AFLIP):
                divide_node_adjoint(before, before_adjoint, w, i, j, k)
    for w, p in ti.ndrange(x.shape[1], x.shape[2]):
        if n < plan[w, 1]:
            s = plan[w, 0] + n
            to_grid_adjoint(
                x, v, C, F, history, tau, mass, volume, stiffness, tension, fibre,
                grid_adjoint, before_adjoint, ratios_adjoint,
                x_adj, v_adj, C_adj, F_adj, history_adj, tau_adj,
                mass_adj, volume_adj, stiffness_adj, tension_adj, fibre_adj,
                w, s, w, p, 1.0 / h, dts[w], mu, lam, eta, ti.Vector([m0, m1, m2, m3, m4]),
                muscle, damping, law, width, transfer,
            )  # fmt: skip
