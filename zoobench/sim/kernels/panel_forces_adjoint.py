"""The adjoint of the substep of a robot in water by forces on its surface, see `panel_forces`.

nodes_adjoint       [1, worlds, nodes, 6] adjoints of X and V of the nodes; those of FORCE and ADDED within a substep
displaced_adjoint   [worlds, nodes] of the displaced volumes
"""

import taichi as ti

from zoobench.sim.kernels.cell_lanes import FORCE, LAYER_FORCE, lanes_of, summed
from zoobench.sim.kernels.columns import dot, zero_lanes
from zoobench.sim.kernels.layout import V, X
from zoobench.sim.kernels.panel_forces import (
    ADDED,
    ADDED_SHEAR,
    OF_AHEAD,
    OF_GROWTH,
    OF_SHARE,
    SIDES,
    SLOW,
    along_pairs,
    applied,
    flow_past,
    gained,
    gravity_of,
    panel_value,
    resistance,
    scalar,
    times,
    transposed_times,
)
from zoobench.sim.model.rest_cells import LANES


@ti.func
def gained_adjoint(c: ti.template()):
    """Adjoint of `panel_forces.gained` and of the step of the places, of all nodes of mass: K (v' - v) = dt force."""
    for n in range(c.cells.inverse.shape[1]):
        for row in ti.static((FORCE, LAYER_FORCE, ADDED, ADDED_SHEAR)):
            c.nodes_adjoint[0, c.w, n, row] = zero_lanes()
        if c.cells.inverse[c.w, n] > 0.0:
            given = c.nodes_adjoint[0, c.w, n, V] + c.dt * c.nodes_adjoint[0, c.w, n, X]
            gain, held = gained(c, n), applied(resistance(c, n), given)
            c.nodes_adjoint[0, c.w, n, V] = given
            c.nodes_adjoint[0, c.w, n, FORCE] = c.dt * held
            c.nodes_adjoint[0, c.w, n, ADDED] = ti.Vector(
                [0.0 - held[0] * gain[0], 0.0 - held[1] * gain[1], 0.0 - held[2] * gain[2], 0.0]
            )
            c.nodes_adjoint[0, c.w, n, ADDED_SHEAR] = ti.Vector(
                [
                    0.0 - held[1] * gain[2] - held[2] * gain[1],
                    0.0 - held[0] * gain[2] - held[2] * gain[0],
                    0.0 - held[0] * gain[1] - held[1] * gain[0],
                    0.0,
                ]
            )
            by_weight = c.dt * dot(gravity_of(c), held)
            by_mass = by_weight - dot(held, gain)
            mass = 1.0 / c.cells.inverse[c.w, n]
            c.inverse_adjoint[c.w, n] += (0.0 - by_mass) * mass * mass
            c.displaced_adjoint[c.w, n] += (0.0 - c.scene.medium.density) * by_weight


@ti.func
def both_sides(diagonal: ti.template(), shear: ti.template(), x: ti.template()):
    """(B + B^T) x of a matrix B whose elements off the diagonal are summed in `shear`."""
    return [
        2.0 * diagonal[0] * x[0] + shear[2] * x[1] + shear[1] * x[2],
        shear[2] * x[0] + 2.0 * diagonal[1] * x[1] + shear[0] * x[2],
        shear[1] * x[0] + shear[0] * x[1] + 2.0 * diagonal[2] * x[2],
    ]


@ti.func
def wet_panels_adjoint(c: ti.template(), g):
    """Adjoint of `panel_forces.wet_panels`."""
    flow = flow_past(c, g)
    row = ti.static(c.panels.given)
    by_force = panel_value(c.nodes_adjoint, c, 0, g, FORCE)
    by_diagonal = panel_value(c.nodes_adjoint, c, 0, g, ADDED)
    by_shear = panel_value(c.nodes_adjoint, c, 0, g, ADDED_SHEAR)
    # heavy n n^T + held q q^T
    pushed, pulled = both_sides(by_diagonal, by_shear, flow.n), both_sides(by_diagonal, by_shear, flow.q)
    heavy = flow.mass + c.dt * flow.drag
    normal = 0.0 - (flow.drag * flow.across + flow.mass * scalar(flow.n, flow.bent))
    # force = normal n - rubbing speed u - lift sideways q + suction F^-T e_x
    first = [flow.h[r][0] for r in ti.static(range(3))]
    by_normal, rubbed, lifted = scalar(by_force, flow.n), scalar(by_force, flow.u), scalar(by_force, flow.q)
    by_drag = (0.5 * c.dt) * scalar(pushed, flow.n) - by_normal * flow.across
    by_lift = (0.5 * c.dt) * scalar(pulled, flow.q) - lifted * flow.sideways
    # suction = -wetted growth (1 + onto / grows) sideways^2 / 4
    by_front = (0.0 - 0.25) * scalar(by_force, first) * flow.wetted * row[g, OF_GROWTH] * flow.sideways
    by_sideways = 2.0 * by_front * (1.0 + flow.onto / flow.grows) - lifted * flow.lift
    by_bent = 0.0 - by_normal * flow.mass
    by_across = 0.0 - by_normal * flow.drag
    by_q = [flow.lift * (c.dt * pulled[r] - flow.sideways * by_force[r]) + by_sideways * flow.v[r]
            for r in ti.static(range(3))]  # fmt: skip
    by_n = [normal * by_force[r] + heavy * pushed[r] + by_bent * flow.bent[r] + by_q[r] for r in ti.static(range(3))]
    by_u = [0.0 - flow.rubbing * flow.speed * by_force[r] for r in ti.static(range(3))]
    by_speed = 0.0 - flow.rubbing * rubbed
    by_area = (0.0 - flow.speed * rubbed) * (0.5 * c.scene.medium.density * c.scene.medium.friction)
    by_area = by_area * row[g, OF_SHARE]
    # drag = C area swift^2 / speed, lift = wetted (onto + grows) / 2
    factor = 0.25 * c.scene.medium.density * c.scene.medium.normal_drag / flow.speed
    by_area += by_drag * factor * flow.swift * flow.swift
    by_across += by_drag * factor * flow.area * 2.0 * flow.across
    by_speed += 0.0 - by_drag * flow.drag / flow.speed
    by_onto = by_lift * (0.5 * flow.wetted) * (1.0 + flow.onto / flow.grows)
    by_onto += by_front * flow.sideways * (SLOW * SLOW) / (flow.grows * flow.grows * flow.grows)
    # bent = grad F [w, w] - 2 rate w
    by_curved = [by_bent * flow.n[r] for r in ti.static(range(3))]
    by_turned = [-2.0 * by_curved[r] for r in ti.static(range(3))]
    by_w = transposed_times(flow.rate, by_turned)
    by_pair = [0.0 * by_bent for _ in ti.static(range(6))]
    for d in ti.static(range(6)):
        for r in ti.static(range(3)):
            by_pair[d] += flow.bending[d][r] * by_curved[r]
    by_w[0] += 2.0 * (by_pair[0] * flow.w[0] + by_pair[5] * flow.w[1] + by_pair[4] * flow.w[2])
    by_w[1] += 2.0 * (by_pair[5] * flow.w[0] + by_pair[1] * flow.w[1] + by_pair[3] * flow.w[2])
    by_w[2] += 2.0 * (by_pair[4] * flow.w[0] + by_pair[3] * flow.w[1] + by_pair[2] * flow.w[2])
    bend_adjoint(c, g, by_curved, along_pairs(flow.w))
    # w = F^-1 u, u = v - across n, across = v . n
    onto_u = times(flow.h, by_w)
    for r in ti.static(range(3)):
        by_u[r] += onto_u[r]
    by_across += 0.0 - scalar(by_u, flow.n)
    by_ahead = 0.0 - by_onto * row[g, OF_GROWTH]  # of the first component of F^-1 v
    by_v = [
        by_u[r] + by_across * flow.n[r] + by_speed * flow.v[r] / flow.speed + by_ahead * first[r]
        + by_sideways * flow.q[r] for r in ti.static(range(3))
    ]  # fmt: skip
    for r in ti.static(range(3)):
        by_n[r] += by_across * flow.v[r] - flow.across * by_u[r]
    # the area vector cof(F) A_0 = area n
    upright = scalar(by_n, flow.n)
    by_vector = [(by_n[r] - upright * flow.n[r]) / flow.area + by_area * flow.n[r] for r in ti.static(range(3))]
    vector = [flow.area * flow.n[r] for r in ti.static(range(3))]
    inner, back = scalar(by_vector, vector), transposed_times(flow.h, by_vector)
    by_f = [[inner * flow.h[r][k] - vector[r] * back[k] - onto_u[r] * flow.w[k] for k in ti.static(range(3))]
            for r in ti.static(range(3))]  # fmt: skip
    # F^-T e_x
    by_first = [
        by_ahead * flow.v[r] - row[g, OF_AHEAD] * by_q[r] + flow.suction * by_force[r] for r in ti.static(range(3))
    ]
    back_first = transposed_times(flow.h, by_first)
    for r in ti.static(range(3)):
        for k in ti.static(range(3)):
            by_f[r][k] += 0.0 - first[r] * back_first[k]
    by_rate = [[by_turned[r] * flow.w[k] for k in ti.static(range(3))] for r in ti.static(range(3))]
    spread_panels(c, g, by_f, by_rate, by_v)


@ti.func
def spread_panels(c: ti.template(), g, by_f: ti.template(), by_rate: ti.template(), by_v: ti.template()):
    """Add the adjoints of F, its rate and the velocity at the panels of a group to those of its nodes."""
    share = lanes_of(0.25 / c.scene.spacing)
    place = [summed(share, by_f[0][k], by_f[1][k], by_f[2][k]) for k in ti.static(range(3))]
    motion = [summed(share, by_rate[0][k], by_rate[1][k], by_rate[2][k]) for k in ti.static(range(3))]
    for i in ti.static(range(8)):
        node, side = c.cells.node[c.panels.cell[g], i], ti.static(SIDES[i])
        c.nodes_adjoint[0, c.w, node, X] += side[0] * place[0] + side[1] * place[1] + side[2] * place[2]
        moved = summed(c.panels.weights[g, i], by_v[0], by_v[1], by_v[2])
        c.nodes_adjoint[0, c.w, node, V] += moved + side[0] * motion[0] + side[1] * motion[1] + side[2] * motion[2]


@ti.func
def bend_adjoint(c: ti.template(), g, by_curved: ti.template(), pairs: ti.template()):
    """Adjoint of `panel_forces.second_gradient`, of which each panel takes its `pairs`."""
    sums = [summed(pairs[d], by_curved[0], by_curved[1], by_curved[2]) for d in ti.static(range(6))]
    for k in range(c.panels.around.shape[1]):
        first, second = c.panels.bend[g, 2 * k], c.panels.bend[g, 2 * k + 1]
        found = zero_lanes()
        for d in ti.static(range(3)):
            found += first[d] * sums[d] + second[d] * sums[3 + d]
        c.nodes_adjoint[0, c.w, c.panels.around[g, k], X] += found


@ti.func
def give_displaced(c: ti.template()):
    """Add what was summed over the substeps of the displaced volumes to that of the particles' volumes."""
    for cell in range(c.cells.node.shape[0]):
        found = lanes_of(0.0 * c.scene.spacing)
        for i in ti.static(range(8)):
            found += c.displaced_adjoint[c.w, c.cells.node[cell, i]] * c.cells.masses[c.cells.shape[cell], i]
        for lane in ti.static(range(LANES)):
            p = c.cells.particle[cell, lane]
            if p >= 0:
                c.body_adjoint[c.w, p, 0] += ti.Vector([0.0, found[lane], 0.0, 0.0])
