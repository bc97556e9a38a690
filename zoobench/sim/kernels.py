"""The substep and its reverse for one thread.

All arrays are torch tensors, shared without copying:

    state      x, v [slots, worlds, particles, 3] and C [.., 3, 3]; F [slots, worlds, robot, 3, 3] of the robot;
               b, tau [slots, worlds, medium, 6] (xx yy zz xy xz yz) and history [slots, worlds, medium] of the medium
    window     [slots, worlds, 6] first and past-the-last grid node that any particle touches
    grid       [slabs, nx, ny, nz, 4] momentum (then velocity) and mass

The worlds are taken in turn through one slab. A launch does a whole run of substeps, because it costs as much as the
work of a thousand particles. The adds are plain ones in a fixed order, and so are bit-reproducible and six times faster
than atomic ones.
"""

import taichi as ti

from zoobench.sim.array_types import Matrices, Nodes, Scalars, Symmetric, Vectors
from zoobench.sim.materials import SMALLEST_J
from zoobench.sim.particles import (
    from_grid,
    from_grid_adjoint,
    to_grid,
    to_grid_adjoint,
    update_node,
    update_node_adjoint,
)


@ti.func
def clear_window(grid: ti.template(), window: ti.template(), s, w):
    """Zero the window of world w at slot s in the first slab."""
    for i in range(window[s, w, 0], window[s, w, 3]):
        for j in range(window[s, w, 1], window[s, w, 4]):
            for k in range(window[s, w, 2], window[s, w, 5]):
                grid[0, i, j, k] = ti.Vector([0.0, 0.0, 0.0, 0.0])


@ti.kernel
def advance(
    x: Vectors, v: Vectors, C: Matrices, F: Matrices, b: Symmetric, history: Scalars, tau: Symmetric, window: Scalars,
    mass: Scalars, volume: Scalars, stiffness: Scalars, tension: Scalars, fibre: Vectors, alive: Scalars, grid: Nodes,
    slot: int, stride: int, count: int, h: float, dt: float,
    mu: float, lam: float, m0: float, m1: float, m2: float, m3: float, m4: float,
    push_x: float, push_y: float, push_z: float, mu_ground: float,
    muscle: ti.template(), law: ti.template(), friction: ti.template(),
):  # fmt: skip
    """`count` substeps of every world alive, from `slot` on; each writes `stride` slots further (0: in place)."""
    ti.loop_config(serialize=True)
    for w in range(x.shape[1]):
        inverse_spacing = 1.0 / h
        push = ti.Vector([push_x, push_y, push_z])
        constants = ti.Vector([m0, m1, m2, m3, m4])
        for n in range(count * alive[w]):
            s = slot + n * stride
            t = s + stride
            clear_window(grid, window, s, w)
            for p in range(x.shape[2]):
                to_grid(
                    x, v, C, F, history, tau, mass, volume, stiffness, tension, fibre,
                    grid, 0, s, w, p, inverse_spacing, dt, mu, lam, constants, muscle, law,
                )  # fmt: skip
            for i in range(window[s, w, 0], window[s, w, 3]):
                for j in range(window[s, w, 1], window[s, w, 4]):
                    for k in range(window[s, w, 2], window[s, w, 5]):
                        update_node(grid, grid, 0, i, j, k, push, mu_ground, friction)
            low = ti.Vector([grid.shape[1], grid.shape[2], grid.shape[3]])
            high = ti.Vector([0, 0, 0])
            for p in range(x.shape[2]):
                base = from_grid(
                    x, v, C, F, b, history, tau, grid, 0, s, t, w, p, inverse_spacing, dt,
                    constants, law,
                )  # fmt: skip
                low = ti.min(low, base)
                high = ti.max(high, base)
            for d in ti.static(range(3)):
                window[t, w, d] = low[d]
                window[t, w, 3 + d] = high[d] + 3


@ti.kernel
def reverse(
    x: Vectors, v: Vectors, C: Matrices, F: Matrices, b: Symmetric, history: Scalars, tau: Symmetric, window: Scalars,
    mass: Scalars, volume: Scalars, stiffness: Scalars, tension: Scalars, fibre: Vectors, alive: Scalars, grid: Nodes,
    grid_velocity: Nodes, grid_adjoint: Nodes,
    x_adj: Vectors, v_adj: Vectors, C_adj: Matrices, F_adj: Matrices,
    b_adj: Symmetric, history_adj: Scalars, tau_adj: Symmetric,
    mass_adj: Scalars, volume_adj: Scalars, stiffness_adj: Scalars, tension_adj: Scalars, fibre_adj: Vectors,
    slot: int, count: int, h: float, dt: float,
    mu: float, lam: float, m0: float, m1: float, m2: float, m3: float, m4: float,
    push_x: float, push_y: float, push_z: float, mu_ground: float,
    muscle: ti.template(), law: ti.template(), friction: ti.template(),
):  # fmt: skip
    """The adjoint of `count` substeps from slot + count back to `slot`, the grid recomputed at each.

    State adjoints are updated in place (one slot); those of the parameters are added to.
    """
    ti.loop_config(serialize=True)
    for w in range(x.shape[1]):
        inverse_spacing = 1.0 / h
        push = ti.Vector([push_x, push_y, push_z])
        constants = ti.Vector([m0, m1, m2, m3, m4])
        for n in range(count * alive[w]):
            s = slot + count - 1 - n
            t = s + 1
            clear_window(grid, window, s, w)
            clear_window(grid_velocity, window, s, w)
            clear_window(grid_adjoint, window, s, w)
            for p in range(x.shape[2]):
                to_grid(
                    x, v, C, F, history, tau, mass, volume, stiffness, tension, fibre,
                    grid, 0, s, w, p, inverse_spacing, dt, mu, lam, constants, muscle, law,
                )  # fmt: skip
            for i in range(window[s, w, 0], window[s, w, 3]):
                for j in range(window[s, w, 1], window[s, w, 4]):
                    for k in range(window[s, w, 2], window[s, w, 5]):
                        update_node(grid, grid_velocity, 0, i, j, k, push, mu_ground, friction)
            for p in range(x.shape[2]):
                from_grid_adjoint(
                    x, v, C, F, b, history, grid_velocity, grid_adjoint,
                    x_adj, v_adj, C_adj, F_adj, b_adj, history_adj, tau_adj,
                    0, s, t, w, p, inverse_spacing, dt, constants, law,
                )  # fmt: skip
            for i in range(window[s, w, 0], window[s, w, 3]):
                for j in range(window[s, w, 1], window[s, w, 4]):
                    for k in range(window[s, w, 2], window[s, w, 5]):
                        update_node_adjoint(grid, grid_adjoint, 0, i, j, k, push, mu_ground, friction)
            for p in range(x.shape[2]):
                to_grid_adjoint(
                    x, v, C, F, history, tau, mass, volume, stiffness, tension, fibre, grid_adjoint,
                    x_adj, v_adj, C_adj, F_adj, history_adj, tau_adj,
                    mass_adj, volume_adj, stiffness_adj, tension_adj, fibre_adj,
                    0, s, w, p, inverse_spacing, dt, mu, lam, constants, muscle, law,
                )  # fmt: skip


@ti.kernel
def survey(
    x: Vectors, v: Vectors, C: Matrices, F: Matrices, mass: Scalars, alive: Scalars, report: Scalars, culprit: Scalars,
    slot: int, h: float, dt: float, low: float, high_x: float, high_y: float, high_z: float,
):  # fmt: skip
    """Worst values of every world: report[w] = speed dt/h, dt |C|, cells outside, smallest det F, guarded particles.

    `culprit[w]` names the particle of each of the first four. A NaN wins every comparison, and stays. Massless
    particles take no part.
    """
    for w in range(x.shape[1]):
        worst = ti.Vector([0.0, 0.0, 0.0, -1e30])
        who = ti.Vector([0, 0, 0, 0])
        guarded = 0
        for p in range(x.shape[2] * alive[w]):
            if mass[w, p] > 0.0:
                place = x[slot, w, p]
                beyond = ti.max(low - place, place - ti.Vector([high_x, high_y, high_z])) / h
                largest = ti.max(beyond[0], beyond[1], beyond[2])
                # max drops a NaN, a sum keeps it
                spread = place.sum() - place.sum()
                values = ti.Vector([v[slot, w, p].norm() * dt / h, C[slot, w, p].norm() * dt, largest + spread, -1e30])
                if p < F.shape[2]:
                    values[3] = -F[slot, w, p].determinant()
                    if -values[3] < SMALLEST_J:
                        guarded += 1
                for q in ti.static(range(4)):
                    if not (values[q] <= worst[q]) and worst[q] == worst[q]:
                        worst[q] = values[q]
                        who[q] = p
        for q in ti.static(range(4)):
            report[w, q] = worst[q]
            culprit[w, q] = who[q]
        report[w, 3] = -worst[3]
        report[w, 4] = guarded
