"""The adjoint of the substep of a robot in its rest frame, see `rest_frame`.

adjoint        [1, worlds, particles] rows of the particles, of which X and V pass on to the nodes
nodes_adjoint  [1, worlds, nodes, 4] adjoints of X and V of the nodes; those of FORCE and LAYER_FORCE within a substep
inverse_adjoint  [worlds, nodes] of the inverse masses
"""

import taichi as ti

from zoobench.sim.kernels.cell_lanes import (
    BY_FIBRE,
    BY_STIFFNESS,
    BY_TENSION,
    BY_VOLUME,
    FORCE,
    LAYER_FORCE,
    OF_FIBRE,
    OF_LAM,
    OF_MU,
    OF_TENSION,
    OF_VOLUME,
    WEAK,
    WEAKNESS,
    add_at,
    add_to_nodes,
    lanes_of,
    place_of,
    slope,
)
from zoobench.sim.kernels.columns import dot, zero_lanes
from zoobench.sim.kernels.elastic import SMALLEST_J
from zoobench.sim.kernels.layout import V, X
from zoobench.sim.kernels.rest_frame import (
    along_fibre,
    inverse_transposed,
    is_near,
    log_lanes,
    moved,
    product,
    product_transposed,
    spherical,
    viscous_stress,
)
from zoobench.sim.kernels.skin_contact import coulomb_friction_adjoint, ground_below, layer_force
from zoobench.sim.model.rest_cells import LANES


@ti.func
def take_particles(adjoint: ti.template(), nodes_adjoint: ti.template(), cells: ti.template(), w):
    """Pass the adjoints of place and velocity of the particles on to their nodes."""
    for c in range(cells.node.shape[0]):
        for lane in ti.static(range(LANES)):
            p = cells.particle[c, lane]
            if p >= 0:
                for i in ti.static(range(8)):
                    share = cells.weights[c, i][lane]
                    nodes_adjoint[0, w, cells.node[c, i], X] += share * adjoint[0, w, p, X]
                    nodes_adjoint[0, w, cells.node[c, i], V] += share * adjoint[0, w, p, V]
                adjoint[0, w, p, X] = zero_lanes()
                adjoint[0, w, p, V] = zero_lanes()


@ti.func
def moved_adjoint(c: ti.template()):
    """Adjoint of `rest_frame.moved` and of the step of the places, of all nodes of mass."""
    for n in range(c.cells.inverse.shape[1]):
        inverse = c.cells.inverse[c.w, n]
        if inverse > 0.0:
            before, _v, a = moved(c, n)
            given = c.nodes_adjoint[0, c.w, n, V] + c.dt * c.nodes_adjoint[0, c.w, n, X]
            by_before, by_a = coulomb_friction_adjoint(before, a, given, c.scene.friction)
            pushed = by_a + by_before
            c.nodes_adjoint[0, c.w, n, V] = by_before
            c.nodes_adjoint[0, c.w, n, FORCE] = c.dt * inverse * by_before
            c.nodes_adjoint[0, c.w, n, LAYER_FORCE] = c.dt * inverse * pushed
            force, push = c.own_nodes[c.s, c.w, n, FORCE], c.own_nodes[c.s, c.w, n, LAYER_FORCE]
            c.inverse_adjoint[c.w, n] += c.dt * (dot(force, by_before) + dot(push, pushed))
        else:
            c.nodes_adjoint[0, c.w, n, FORCE] = zero_lanes()
            c.nodes_adjoint[0, c.w, n, LAYER_FORCE] = zero_lanes()


@ti.func
def stress_adjoint(c: ti.template(), cell):
    """Adjoint of the internal force of a cell: P = mu F + S H + T (F d) d^T, with S spherical and viscous, H = F^-T and
    dH = -H dF^T H."""
    law = ti.static(c.cells.law)
    deformation = slope(c.own_nodes, c.cells, c.s, c.w, cell, X)
    h, j = inverse_transposed(deformation)
    iso, log_j = spherical(law, c.w, cell, j), log_lanes(ti.max(j, SMALLEST_J))
    # of P: the nodes take -V P g
    by_p = slope(c.nodes_adjoint, c.cells, 0, c.w, cell, FORCE)
    stress = [[iso * h[r][k] + law[c.w, cell, OF_MU] * deformation[r][k] for k in ti.static(range(3))]
              for r in ti.static(range(3))]  # fmt: skip
    by_stiffness, by_volume, by_tension = 0.0 * iso, 0.0 * iso, 0.0 * iso
    scaled = [[-1.0 * law[c.w, cell, OF_VOLUME] * by_p[r][k] for k in ti.static(range(3))] for r in ti.static(range(3))]
    for r in ti.static(range(3)):
        for k in ti.static(range(3)):
            unit = c.scene.mu * deformation[r][k] + (c.scene.lam * log_j - c.scene.mu) * h[r][k]
            by_stiffness += scaled[r][k] * unit
    by_inner = product_transposed(scaled, h)
    by_h = [[iso * scaled[r][k] for k in ti.static(range(3))] for r in ti.static(range(3))]
    if ti.static(c.variant.damping):
        rate = slope(c.own_nodes, c.cells, c.s, c.w, cell, V)
        damping = viscous_stress(rate, h, c.scene.eta)
        inner, turned = product(damping, h), product(damping, scaled)
        by_flow = [[c.scene.eta * (by_inner[r][k] + by_inner[k][r]) for k in ti.static(range(3))]
                   for r in ti.static(range(3))]  # fmt: skip
        by_rate, more = product(by_flow, h), product(by_flow, rate)
        for r in ti.static(range(3)):
            for k in ti.static(range(3)):
                stress[r][k] += inner[r][k]
                by_h[r][k] += turned[r][k] + more[r][k]
        add_to_nodes(c.nodes_adjoint, 0, c.w, V, c.cells, cell, by_rate)
    by_log = law[c.w, cell, OF_LAM] * (by_inner[0][0] + by_inner[1][1] + by_inner[2][2])
    folded = [[by_h[0][r] * h[0][k] + by_h[1][r] * h[1][k] + by_h[2][r] * h[2][k] for k in ti.static(range(3))]
              for r in ti.static(range(3))]  # fmt: skip
    back = product(h, folded)
    mu = law[c.w, cell, OF_MU]
    by_deformation = [[mu * scaled[r][k] + by_log * h[r][k] - back[r][k] for k in ti.static(range(3))]
                      for r in ti.static(range(3))]  # fmt: skip
    if ti.static(c.variant.muscle):
        stretched, pulled = along_fibre(deformation, law, c.w, cell), along_fibre(scaled, law, c.w, cell)
        by_fibre = [0.0 * iso for _ in ti.static(range(3))]
        for r in ti.static(range(3)):
            by_tension += stretched[r] * pulled[r]
            for k in ti.static(range(3)):
                stress[r][k] += law[c.w, cell, OF_TENSION] * stretched[r] * law[c.w, cell, OF_FIBRE + k]
                by_deformation[r][k] += law[c.w, cell, OF_TENSION] * pulled[r] * law[c.w, cell, OF_FIBRE + k]
                by_fibre[k] += law[c.w, cell, OF_TENSION] * (
                    deformation[r][k] * pulled[r] + scaled[r][k] * stretched[r]
                )
        for k in ti.static(range(3)):
            c.sums[c.w, cell, BY_FIBRE + k] += by_fibre[k]
        c.sums[c.w, cell, BY_TENSION] += by_tension
    for r in ti.static(range(3)):
        for k in ti.static(range(3)):
            by_volume += -1.0 * stress[r][k] * by_p[r][k]
    c.sums[c.w, cell, BY_VOLUME] += by_volume
    c.sums[c.w, cell, BY_STIFFNESS] += by_stiffness
    add_to_nodes(c.nodes_adjoint, 0, c.w, X, c.cells, cell, by_deformation)


@ti.func
def push_cell_adjoint(c: ti.template(), cell):
    """Adjoint of `rest_frame.push_cell`."""
    if is_near(c, cell):
        by_volume = lanes_of(0.0 * c.scene.spacing)
        for lane in ti.static(range(LANES)):
            if c.cells.particle[cell, lane] >= 0:
                below = ground_below(c, place_of(c.own_nodes, c.cells, c.s, c.w, cell, lane, X))
                if below.gap < c.scene.skin_thickness + 0.5 * c.scene.edge:
                    force, rate = layer_force(below.gap, c.scene.edge, c.scene)
                    held = place_of(c.nodes_adjoint, c.cells, 0, c.w, cell, lane, LAYER_FORCE)
                    volume = c.cells.law[c.w, cell, OF_VOLUME][lane]
                    along = dot(below.normal, held)
                    by_normal = ti.Vector([dot(below.by_x, held), 0.0, dot(below.by_z, held), 0.0])
                    by_place = (volume * rate * along) * below.slope + (volume * force) * by_normal
                    by_volume[lane] = force * along
                    add_at(c, c.nodes_adjoint, 0, X, cell, lane, by_place)
        c.sums[c.w, cell, BY_VOLUME] += by_volume


@ti.func
def give_particles(
    body_adjoint: ti.template(), cells: ti.template(), inverse_adjoint: ti.template(), sums: ti.template(), w
):
    """Add what was summed over the substeps to the adjoints of the particles' parameters."""
    for c in range(cells.node.shape[0]):
        shape = cells.shape[c]
        by_mass = 0.0 * sums[w, c, BY_VOLUME]
        for i in ti.static(range(8)):
            n = cells.node[c, i]
            by_mass += (0.0 - inverse_adjoint[w, n] * cells.inverse[w, n] * cells.inverse[w, n]) * cells.masses[
                shape, i
            ]
        for lane in ti.static(range(LANES)):
            p = cells.particle[c, lane]
            if p <= WEAK:
                body_adjoint[w, WEAK - p, 0] += ti.Vector(
                    [0.0 * by_mass[lane], WEAKNESS * sums[w, c, BY_VOLUME][lane], sums[w, c, BY_STIFFNESS][lane], 0.0]
                )
            if p >= 0:
                body_adjoint[w, p, 0] += ti.Vector(
                    [
                        by_mass[lane],
                        sums[w, c, BY_VOLUME][lane],
                        sums[w, c, BY_STIFFNESS][lane],
                        sums[w, c, BY_TENSION][lane],
                    ]
                )
                body_adjoint[w, p, 1] += ti.Vector(
                    [sums[w, c, BY_FIBRE][lane], sums[w, c, BY_FIBRE + 1][lane], sums[w, c, BY_FIBRE + 2][lane], 0.0]
                )
