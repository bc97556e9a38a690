"""The adjoint of the substep of a robot in water by forces on its surface, see `panel_forces`.

nodes_adjoint       [1, worlds, nodes, 6] adjoints of X and V of the nodes; those of FORCE and ADDED within a substep
displaced_adjoint   [nodes] of the displaced volumes of a world
"""

import taichi as ti

from zoobench.sim.kernels.array_types import Rows, Scalars, Wide
from zoobench.sim.kernels.columns import dot, zero_lanes
from zoobench.sim.kernels.context import Context
from zoobench.sim.kernels.layout import V, X, scene_constants
from zoobench.sim.kernels.panel_forces import (
    ADDED,
    ADDED_SHEAR,
    OF_AHEAD,
    OF_GROWTH,
    OF_SHARE,
    Panels,
    along_pairs,
    applied,
    flow_past,
    gained,
    gravity_of,
    load_displaced,
    panel_value,
    resistance,
    scalar,
    summed,
    times,
    transposed_times,
)
from zoobench.sim.kernels.rest_frame import FORCE, LAYER_FORCE, Cells, lanes_of, load_cells
from zoobench.sim.kernels.rest_frame_adjoint import give_particles, stress_adjoint, take_particles
from zoobench.sim.model.rest_cells import LANES
from zoobench.sim.model.surface_water import SurfaceWater


@ti.func
def gained_adjoint(c: ti.template()):
    """Adjoint of `panel_forces.gained` and of the step of the places, of all nodes of mass: K (v' - v) = dt force."""
    for n in range(c.cells.inverse.shape[0]):
        for row in ti.static((FORCE, LAYER_FORCE, ADDED, ADDED_SHEAR)):
            c.nodes_adjoint[0, c.w, n, row] = zero_lanes()
        if c.cells.inverse[n] > 0.0:
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
            mass = 1.0 / c.cells.inverse[n]
            c.inverse_adjoint[n] += (0.0 - by_mass) * mass * mass
            c.displaced_adjoint[n] += (0.0 - c.scene.medium.density) * by_weight


@ti.func
def wet_panels_adjoint(c: ti.template(), g):
    """Adjoint of `panel_forces.wet_panels`."""
    flow = flow_past(c, g)
    row = ti.static(c.panels.given)
    by_force = panel_value(c.nodes_adjoint, c, 0, g, FORCE)
    by_diagonal = panel_value(c.nodes_adjoint, c, 0, g, ADDED)
    by_shear = panel_value(c.nodes_adjoint, c, 0, g, ADDED_SHEAR)
    # heavy n n^T, whose elements off the diagonal are kept once
    pushed = [
        2.0 * by_diagonal[0] * flow.n[0] + by_shear[2] * flow.n[1] + by_shear[1] * flow.n[2],
        by_shear[2] * flow.n[0] + 2.0 * by_diagonal[1] * flow.n[1] + by_shear[0] * flow.n[2],
        by_shear[1] * flow.n[0] + by_shear[0] * flow.n[1] + 2.0 * by_diagonal[2] * flow.n[2],
    ]
    by_heavy = 0.5 * scalar(pushed, flow.n)
    heavy = flow.mass + c.dt * (flow.drag + flow.lift)
    normal = 0.0 - (flow.drag * flow.across + flow.lift * flow.sideways + flow.mass * scalar(flow.n, flow.bent))
    # force = normal n - rubbing speed u
    by_normal, rubbed = scalar(by_force, flow.n), scalar(by_force, flow.u)
    by_drag = c.dt * by_heavy - by_normal * flow.across
    by_lift = c.dt * by_heavy - by_normal * flow.sideways
    by_sideways = 0.0 - by_normal * flow.lift
    by_bent = 0.0 - by_normal * flow.mass
    by_across = by_sideways - by_normal * flow.drag
    by_n = [normal * by_force[r] + heavy * pushed[r] + by_bent * flow.bent[r] for r in ti.static(range(3))]
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
    by_ahead = 0.0 - by_sideways * row[g, OF_AHEAD] - by_onto * row[g, OF_GROWTH]  # of the first component of F^-1 v
    by_v = [
        by_u[r] + by_across * flow.n[r] + by_speed * flow.v[r] / flow.speed + by_ahead * flow.h[r][0]
        for r in ti.static(range(3))
    ]
    for r in ti.static(range(3)):
        by_n[r] += by_across * flow.v[r] - flow.across * by_u[r]
    # the area vector cof(F) A_0 = area n
    upright = scalar(by_n, flow.n)
    by_vector = [(by_n[r] - upright * flow.n[r]) / flow.area + by_area * flow.n[r] for r in ti.static(range(3))]
    vector = [flow.area * flow.n[r] for r in ti.static(range(3))]
    inner, back = scalar(by_vector, vector), transposed_times(flow.h, by_vector)
    by_f = [[inner * flow.h[r][k] - vector[r] * back[k] - onto_u[r] * flow.w[k] for k in ti.static(range(3))]
            for r in ti.static(range(3))]  # fmt: skip
    back_v = transposed_times(flow.h, flow.v)
    for r in ti.static(range(3)):
        for k in ti.static(range(3)):
            by_f[r][k] += 0.0 - by_ahead * flow.h[r][0] * back_v[k]
    by_rate = [[by_turned[r] * flow.w[k] for k in ti.static(range(3))] for r in ti.static(range(3))]
    spread_panels(c, g, by_f, by_rate, by_v)


@ti.func
def spread_panels(c: ti.template(), g, by_f: ti.template(), by_rate: ti.template(), by_v: ti.template()):
    """Add the adjoints of F, its rate and the velocity at the panels of a group to those of its nodes."""
    for i in ti.static(range(8)):
        place, motion = [0.0 * by_v[0] for _ in ti.static(range(3))], [0.0 * by_v[0] for _ in ti.static(range(3))]
        for r in ti.static(range(3)):
            motion[r] += c.panels.weights[g, i] * by_v[r]
            for k in ti.static(range(3)):
                place[r] += c.panels.slopes[g, 3 * i + k] * by_f[r][k]
                motion[r] += c.panels.slopes[g, 3 * i + k] * by_rate[r][k]
        node, one = c.cells.node[c.panels.cell[g], i], 0.0 * by_v[0] + 1.0
        c.nodes_adjoint[0, c.w, node, X] += summed(one, place[0], place[1], place[2])
        c.nodes_adjoint[0, c.w, node, V] += summed(one, motion[0], motion[1], motion[2])


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
            found += c.displaced_adjoint[c.cells.node[cell, i]] * c.cells.masses[c.cells.shape[cell], i]
        for lane in ti.static(range(LANES)):
            p = c.cells.particle[cell, lane]
            if p >= 0:
                c.body_adjoint[c.w, p, 0] += ti.Vector([0.0, found[lane], 0.0, 0.0])


@ti.kernel
def reverse_swimmer(
    state: Rows, nodes: Rows, body: Rows, plan: Scalars, dts: Scalars, constants: Scalars, terrain: Rows, node: Scalars,
    particle: Scalars,
    shape: Scalars, slopes: Wide, turned: Wide, masses: Wide, weights: Wide, law: Wide, inverse: Scalars,
    displaced: Scalars, cell: Scalars, around: Scalars, panel_weights: Wide, panel_slopes: Wide, given: Wide,
    bend: Rows, inverse_adjoint: Scalars, sums: Wide, displaced_adjoint: Scalars, adjoint: Rows, nodes_adjoint: Rows,
    body_adjoint: Rows, variant: ti.template(),
):  # fmt: skip
    """As `rest_frame_adjoint.reverse_rest_frame`, in water."""
    ti.loop_config(serialize=True)
    for w in range(nodes.shape[1]):
        scene = scene_constants(constants, SurfaceWater)
        cells = Cells(node, particle, shape, slopes, turned, masses, weights, law, inverse)
        panels = Panels(cell, around, panel_weights, panel_slopes, given, bend)
        if plan[w, 1] > 0:
            load_cells(body, cells, scene, w)
            take_particles(adjoint, nodes_adjoint, cells, w)
            every = Context(
                variant, own_nodes=nodes, cells=cells, panels=panels, displaced=displaced, scene=scene, w=w,
                nodes_adjoint=nodes_adjoint, inverse_adjoint=inverse_adjoint, displaced_adjoint=displaced_adjoint,
                body_adjoint=body_adjoint, sums=sums,
            )  # fmt: skip
            load_displaced(body, every)
            for n in range(inverse.shape[0]):
                inverse_adjoint[n] = 0.0 * scene.spacing
                displaced_adjoint[n] = 0.0 * scene.spacing
            for k in range(node.shape[0]):
                for row in ti.static(range(6)):
                    sums[k, row] = lanes_of(0.0 * scene.spacing)
            for m in range(plan[w, 1]):
                c = every.but(dt=dts[w], s=plan[w, 0] + plan[w, 1] - 1 - m)
                gained_adjoint(c)
                for g in range(cell.shape[0]):
                    wet_panels_adjoint(c, g)
                for k in range(node.shape[0]):
                    stress_adjoint(c, k)
            give_displaced(every)
            give_particles(body_adjoint, cells, inverse_adjoint, sums, w)
