"""The substeps of a robot in its rest frame (`rest_frame`), whose limbs may meet (`limb_contact`), and their adjoint.

In water by forces on its surface (`panel_forces`) it has panels, elsewhere none.
"""

import taichi as ti

from zoobench.sim.kernels.array_types import Rows, Scalars, Wide
from zoobench.sim.kernels.cell_lanes import Cells, lanes_of, load_cells
from zoobench.sim.kernels.context import Context
from zoobench.sim.kernels.layout import V, X, constants_of
from zoobench.sim.kernels.limb_contact import (
    Limbs,
    for_cells_that_meet,
    forget_meetings,
    note_motion,
    push_cells,
    push_cells_adjoint,
    renew_meetings,
)
from zoobench.sim.kernels.panel_forces import Panels, find_water_forces, gained, load_displaced
from zoobench.sim.kernels.panel_forces_adjoint import gained_adjoint, give_displaced, wet_panels_adjoint
from zoobench.sim.kernels.rest_frame import find_forces, moved, write_particles
from zoobench.sim.kernels.rest_frame_adjoint import (
    give_particles,
    moved_adjoint,
    push_cell_adjoint,
    stress_adjoint,
    take_particles,
)


@ti.func
def move_nodes(c: ti.template(), t):
    """Places and velocities of all nodes of a world at slot t; one without mass stays."""
    for n in range(c.cells.inverse.shape[1]):
        x, v = c.own_nodes[c.s, c.w, n, X], c.own_nodes[c.s, c.w, n, V]
        if c.cells.inverse[c.w, n] > 0.0:
            if ti.static(c.variant.has_panels):
                v += gained(c, n)
            else:
                _before, v, _a = moved(c, n)
            x += c.dt * v
        c.own_nodes[t, c.w, n, X] = x
        c.own_nodes[t, c.w, n, V] = v


@ti.kernel
def advance_rest_frame(
    state: Rows, nodes: Rows, body: Rows, plan: Scalars, dts: Scalars, constants: Scalars, terrain: Rows, node: Scalars,
    particle: Scalars, shape: Scalars, slopes: Wide, turned: Wide, masses: Wide, weights: Wide, law: Wide,
    inverse: Scalars, members: Scalars, first: Scalars, apart: Scalars, share: Wide, boxes: Rows, meeting: Scalars,
    displaced: Scalars, cell: Scalars, around: Scalars, panel_weights: Wide, given: Wide, bend: Rows, stride: int,
    variant: ti.template(),
):  # fmt: skip
    """The planned substeps of every world, each result `stride` slots further (0: in place). Particles are written in
    the last slot alone."""
    ti.loop_config(serialize=not variant.at_once)
    for w in range(state.shape[1]):
        scene = constants_of(constants, variant)
        cells = Cells(node, particle, shape, slopes, turned, masses, weights, law, inverse)
        limbs = Limbs(members, first, apart, share, boxes, meeting)
        panels = Panels(cell, around, panel_weights, given, bend)
        if plan[w, 1] > 0:
            load_cells(body, cells, scene, w)
            every = Context(
                variant, own_nodes=nodes, cells=cells, limbs=limbs, panels=panels, displaced=displaced, scene=scene,
                terrain=terrain, dt=dts[w], w=w, s=plan[w, 0],
            )  # fmt: skip
            if ti.static(variant.has_panels):
                load_displaced(body, every)
            forget_meetings(every)
            for m in range(plan[w, 1]):
                s = plan[w, 0] + m * stride
                c = every.but(s=s)
                renew_meetings(c)
                find_forces(c)
                if ti.static(variant.has_panels):
                    find_water_forces(c)
                for_cells_that_meet(c, push_cells)
                move_nodes(c, s + stride)
                note_motion(c, s + stride)
            write_particles(state, nodes, cells, plan[w, 0] + plan[w, 1] * stride, w)


@ti.kernel
def reverse_rest_frame(
    state: Rows, nodes: Rows, body: Rows, plan: Scalars, dts: Scalars, constants: Scalars, terrain: Rows, node: Scalars,
    particle: Scalars, shape: Scalars, slopes: Wide, turned: Wide, masses: Wide, weights: Wide, law: Wide,
    inverse: Scalars, members: Scalars, first: Scalars, apart: Scalars, share: Wide, boxes: Rows, meeting: Scalars,
    displaced: Scalars, cell: Scalars, around: Scalars, panel_weights: Wide, given: Wide, bend: Rows,
    inverse_adjoint: Scalars, sums: Wide, displaced_adjoint: Scalars, adjoint: Rows, nodes_adjoint: Rows,
    body_adjoint: Rows, variant: ti.template(),
):  # fmt: skip
    """The adjoint of the planned substeps, from the slot past the last back to the first.

    The adjoints of the state are updated in place (one slot); those of the parameters are added to.
    """
    ti.loop_config(serialize=not variant.at_once)
    for w in range(state.shape[1]):
        scene = constants_of(constants, variant)
        cells = Cells(node, particle, shape, slopes, turned, masses, weights, law, inverse)
        limbs = Limbs(members, first, apart, share, boxes, meeting)
        panels = Panels(cell, around, panel_weights, given, bend)
        if plan[w, 1] > 0:
            load_cells(body, cells, scene, w)
            take_particles(adjoint, nodes_adjoint, cells, w)
            every = Context(
                variant, own_nodes=nodes, cells=cells, limbs=limbs, panels=panels, displaced=displaced, scene=scene,
                terrain=terrain, dt=dts[w], w=w, s=plan[w, 0],
                nodes_adjoint=nodes_adjoint, inverse_adjoint=inverse_adjoint, displaced_adjoint=displaced_adjoint,
                body_adjoint=body_adjoint, sums=sums,
            )  # fmt: skip
            if ti.static(variant.has_panels):
                load_displaced(body, every)
            forget_meetings(every)
            for n in range(inverse.shape[1]):
                inverse_adjoint[w, n] = 0.0 * scene.spacing
                if ti.static(variant.has_panels):
                    displaced_adjoint[w, n] = 0.0 * scene.spacing
            for k in range(node.shape[0]):
                for row in ti.static(range(6)):
                    sums[w, k, row] = lanes_of(0.0 * scene.spacing)
            for m in range(plan[w, 1]):
                s = plan[w, 0] + plan[w, 1] - 1 - m
                c = every.but(s=s)
                renew_meetings(c)
                if ti.static(variant.has_panels):
                    gained_adjoint(c)
                    for g in range(cell.shape[0]):
                        wet_panels_adjoint(c, g)
                else:
                    moved_adjoint(c)
                for k in range(node.shape[0]):
                    stress_adjoint(c, k)
                    if ti.static(variant.skin):
                        push_cell_adjoint(c, k)
                for_cells_that_meet(c, push_cells_adjoint)
                note_motion(c, s)
            if ti.static(variant.has_panels):
                give_displaced(every)
            give_particles(body_adjoint, cells, inverse_adjoint, sums, w)
