"""The substep and its adjoint for one thread.

All arrays are torch tensors, shared without copying:

    state      x, v [slots, worlds, particles, 3] and C [.., 3, 3]; F [slots, worlds, robot, 3, 3] of the robot;
               b, tau [slots, worlds, medium, 6] (xx yy zz xy xz yz) and history [slots, worlds, medium] of the medium
    window     [slots, worlds, 6] first and past-the-last grid node that any particle touches
    plan       [worlds, 2] first slot and number of substeps, with dt [worlds]: every world takes its own steps
    terrain    [nx, nz, 4] height of the ground above the grid's first node [cells] and its normal; empty for a plane
    grid       [slabs, nx, ny, nz, 4] momentum (then velocity) and mass
    before     the same of the motion before forces, for AFLIP; empty with other transfers
    ratios     [slabs, nx, ny, nz, 2] mass times J, and mass, of water; empty without

The worlds are taken in turn through one slab. A launch does many substeps, because it costs as much as the work on a
thousand particles. The sums are not atomic and in a fixed order, and so are bit-reproducible and six times faster than
atomic ones.
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
def clear_window(grid: ti.template(), window: ti.template(), s, w):
    """Zero the window of world w at slot s in the first slab."""
    for i in range(window[s, w, 0], window[s, w, 3]):
        for j in range(window[s, w, 1], window[s, w, 4]):
            for k in range(window[s, w, 2], window[s, w, 5]):
                grid[0, i, j, k] = ti.Vector([0.0, 0.0, 0.0, 0.0])


@ti.func
def clear_ratios(ratios: ti.template(), window: ti.template(), s, w):
    """`clear_window` for the water's volume ratios."""
    for i in range(window[s, w, 0], window[s, w, 3]):
        for j in range(window[s, w, 1], window[s, w, 4]):
            for k in range(window[s, w, 2], window[s, w, 5]):
                ratios[0, i, j, k] = ti.Vector([0.0, 0.0])


@ti.kernel
def advance(
    x: Vectors, v: Vectors, C: Matrices, F: Matrices, b: Symmetric, history: Scalars, tau: Symmetric, window: Scalars,
    mass: Scalars, volume: Scalars, stiffness: Scalars, tension: Scalars, fibre: Vectors,
    plan: Scalars, dts: Scalars, terrain: Nodes, grid: Nodes, before: Nodes, ratios: Pairs,
    stride: int, h: float,
    mu: float, lam: float, eta: float, m0: float, m1: float, m2: float, m3: float, m4: float,
    g_x: float, g_y: float, g_z: float, mu_ground: float,
    muscle: ti.template(), damping: ti.template(), law: ti.template(), ground: ti.template(),
    width: ti.template(), transfer: ti.template(),
):  # fmt: skip
    """The planned substeps of every world; each writes `stride` slots further (0: in place)."""
    ti.loop_config(serialize=True)  # the outermost loop would become parallel, its sums atomic
    for w in range(x.shape[1]):
        inverse_spacing = 1.0 / h
        dt = dts[w]
        dt_g = dt * ti.Vector([g_x, g_y, g_z])
        constants = ti.Vector([m0, m1, m2, m3, m4])
        for n in range(plan[w, 1]):
            s = plan[w, 0] + n * stride
            t = s + stride
            clear_window(grid, window, s, w)
            if ti.static(transfer == AFLIP):
                clear_window(before, window, s, w)
            if ti.static(law == WATER):
                clear_ratios(ratios, window, s, w)
            for p in range(x.shape[2]):
                to_grid(
                    x, v, C, F, history, tau, mass, volume, stiffness, tension, fibre,
                    grid, before, ratios, 0, s, w, p, inverse_spacing, dt, mu, lam, eta, constants,
                    muscle, damping, law, width, transfer,
                )  # fmt: skip
            for i in range(window[s, w, 0], window[s, w, 3]):
                for j in range(window[s, w, 1], window[s, w, 4]):
                    for k in range(window[s, w, 2], window[s, w, 5]):
                        update_node(grid, grid, 0, i, j, k, dt_g, mu_ground, terrain, ground, law)
                        if ti.static(transfer == AFLIP):
                            divide_node(before, before, 0, i, j, k)
            if ti.static(law == WATER):
                for i in range(window[s, w, 0], window[s, w, 3]):
                    for j in range(window[s, w, 1], window[s, w, 4]):
                        for k in range(window[s, w, 2], window[s, w, 5]):
                            press_node(grid, 0, i, j, k, ground)
            # the window of the next substep, as the grid is cleared only where particles are
            low = ti.Vector([grid.shape[1], grid.shape[2], grid.shape[3]])
            high = ti.Vector([0, 0, 0])
            for p in range(x.shape[2]):
                base = from_grid(
                    x, v, C, F, b, history, tau, grid, before, ratios, 0, s, t, w, p, inverse_spacing, dt,
                    constants, law, width, transfer,
                )  # fmt: skip
                low = ti.min(low, base)
                high = ti.max(high, base)
            for d in ti.static(range(3)):
                window[t, w, d] = low[d]
                window[t, w, 3 + d] = high[d] + width


@ti.kernel
def reverse(
    x: Vectors, v: Vectors, C: Matrices, F: Matrices, b: Symmetric, history: Scalars, tau: Symmetric, window: Scalars,
    mass: Scalars, volume: Scalars, stiffness: Scalars, tension: Scalars, fibre: Vectors,
    plan: Scalars, dts: Scalars, terrain: Nodes, grid: Nodes, before: Nodes, ratios: Pairs,
    grid_velocity: Nodes, grid_adjoint: Nodes, before_adjoint: Nodes, ratios_adjoint: Pairs,
    x_adj: Vectors, v_adj: Vectors, C_adj: Matrices, F_adj: Matrices,
    b_adj: Symmetric, history_adj: Scalars, tau_adj: Symmetric,
    mass_adj: Scalars, volume_adj: Scalars, stiffness_adj: Scalars, tension_adj: Scalars, fibre_adj: Vectors,
    h: float,
    mu: float, lam: float, eta: float, m0: float, m1: float, m2: float, m3: float, m4: float,
    g_x: float, g_y: float, g_z: float, mu_ground: float,
    muscle: ti.template(), damping: ti.template(), law: ti.template(), ground: ti.template(),
    width: ti.template(), transfer: ti.template(),
):  # fmt: skip
    """The adjoint of the planned substeps, from the slot past the last back to the first, the grid recomputed at each.

    State adjoints are updated in place (one slot); those of the parameters are added to.
    """
    ti.loop_config(serialize=True)
    for w in range(x.shape[1]):
        inverse_spacing = 1.0 / h
        dt = dts[w]
        dt_g = dt * ti.Vector([g_x, g_y, g_z])
        constants = ti.Vector([m0, m1, m2, m3, m4])
        for n in range(plan[w, 1]):
            s = plan[w, 0] + plan[w, 1] - 1 - n
            t = s + 1
            clear_window(grid, window, s, w)
            clear_window(grid_velocity, window, s, w)
            clear_window(grid_adjoint, window, s, w)
            if ti.static(transfer == AFLIP):
                clear_window(before, window, s, w)
                clear_window(before_adjoint, window, s, w)
            if ti.static(law == WATER):
                clear_ratios(ratios, window, s, w)
                clear_ratios(ratios_adjoint, window, s, w)
            for p in range(x.shape[2]):
                to_grid(
                    x, v, C, F, history, tau, mass, volume, stiffness, tension, fibre,
                    grid, before, ratios, 0, s, w, p, inverse_spacing, dt, mu, lam, eta, constants,
                    muscle, damping, law, width, transfer,
                )  # fmt: skip
            for i in range(window[s, w, 0], window[s, w, 3]):
                for j in range(window[s, w, 1], window[s, w, 4]):
                    for k in range(window[s, w, 2], window[s, w, 5]):
                        update_node(grid, grid_velocity, 0, i, j, k, dt_g, mu_ground, terrain, ground, law)
                        if ti.static(transfer == AFLIP):
                            divide_node(before, before, 0, i, j, k)
            if ti.static(law == WATER):
                for i in range(window[s, w, 0], window[s, w, 3]):
                    for j in range(window[s, w, 1], window[s, w, 4]):
                        for k in range(window[s, w, 2], window[s, w, 5]):
                            press_node(grid_velocity, 0, i, j, k, ground)
            for p in range(x.shape[2]):
                from_grid_adjoint(
                    x, v, C, F, b, history, grid_velocity, before, ratios, grid_adjoint, before_adjoint, ratios_adjoint,
                    x_adj, v_adj, C_adj, F_adj, b_adj, history_adj, tau_adj,
                    0, s, t, w, p, inverse_spacing, dt, constants, law, width, transfer,
                )  # fmt: skip
            if ti.static(law == WATER):
                for i in range(window[s, w, 0], window[s, w, 3]):
                    for j in range(window[s, w, 1], window[s, w, 4]):
                        for k in range(window[s, w, 2], window[s, w, 5]):
                            press_node_adjoint(grid, grid_velocity, grid_adjoint, 0, i, j, k, dt_g, ground)
            for i in range(window[s, w, 0], window[s, w, 3]):
                for j in range(window[s, w, 1], window[s, w, 4]):
                    for k in range(window[s, w, 2], window[s, w, 5]):
                        update_node_adjoint(grid, grid_adjoint, 0, i, j, k, dt_g, mu_ground, terrain, ground, law)
                        if ti.static(transfer == AFLIP):
                            divide_node_adjoint(before, before_adjoint, 0, i, j, k)
            for p in range(x.shape[2]):
                to_grid_adjoint(
                    x, v, C, F, history, tau, mass, volume, stiffness, tension, fibre,
                    grid_adjoint, before_adjoint, ratios_adjoint,
                    x_adj, v_adj, C_adj, F_adj, history_adj, tau_adj,
                    mass_adj, volume_adj, stiffness_adj, tension_adj, fibre_adj,
                    0, s, w, p, inverse_spacing, dt, mu, lam, eta, constants,
                    muscle, damping, law, width, transfer,
                )  # fmt: skip
