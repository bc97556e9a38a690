"""Forces and motion of a robot in its rest frame (total Lagrangian); `rest_frame_substeps` drives them.

Nodes of the body's own grid (`model.rest_cells`) carry place and velocity. With the constant gradients g of their
weights, the deformation gradient at a particle is F = sum x g and its rate R = sum v g. With H = F^-T and L = R F^-1
its first Piola-Kirchhoff stress is that of `elastic`,

    P = mu F + (lambda log J - mu) H + eta (L + L^T) H + T (F d) d^T,

and a particle of volume V acts on a node with the force -V P g. Nothing is advected: weights, masses and neighbours
stay. The ground's skin is that of `skin_contact`: it pushes on particles, and rubs at nodes.

Particles are taken by cells, see `cell_lanes`.
"""

import taichi as ti

from zoobench.sim.kernels.cell_lanes import (
    FORCE,
    LAYER_FORCE,
    OF_FIBRE,
    OF_LAM,
    OF_MU,
    OF_TENSION,
    OF_VOLUME,
    add_at,
    add_to_nodes,
    place_of,
    slope,
)
from zoobench.sim.kernels.columns import matrix, zero_lanes
from zoobench.sim.kernels.elastic import SMALLEST_J
from zoobench.sim.kernels.layout import (
    C,
    F,
    V,
    X,
    put_columns,
)
from zoobench.sim.kernels.skin_contact import coulomb_friction, ground_below, layer_force
from zoobench.sim.model.rest_cells import LANES

_LOG_TERMS = 20


@ti.func
def log_lanes(a):
    """Logarithm of the lanes, which are between `SMALLEST_J` and its inverse: log a = 8 artanh((b - 1) / (b + 1)) with
    b = a^(1/4), a series of odd powers that is exact to rounding there. It takes a fifth of the time of the logarithms
    of eight numbers, in four parts that do not wait for each other."""
    b = ti.sqrt(ti.sqrt(a))
    u = (b - 1.0) / (b + 1.0)
    square = u * u
    fourth = square * square
    eighth = fourth * fourth
    parts = [0.0 * u + 1.0 / (2 * (_LOG_TERMS - 4 + k) + 1) for k in ti.static(range(4))]
    for j in ti.static(range(_LOG_TERMS // 4 - 1)):
        for k in ti.static(range(4)):
            parts[k] = parts[k] * eighth + 1.0 / (2 * (_LOG_TERMS - 8 - 4 * j + k) + 1)
    return 8.0 * u * ((parts[0] + square * parts[1]) + fourth * (parts[2] + square * parts[3]))


@ti.func
def inverse_transposed(a: ti.template()):
    """a^-T, of which J is held above `SMALLEST_J`, and J."""
    h = [[a[(r + 1) % 3][(k + 1) % 3] * a[(r + 2) % 3][(k + 2) % 3]
          - a[(r + 1) % 3][(k + 2) % 3] * a[(r + 2) % 3][(k + 1) % 3] for k in ti.static(range(3))]
         for r in ti.static(range(3))]  # fmt: skip
    j = a[0][0] * h[0][0] + a[0][1] * h[0][1] + a[0][2] * h[0][2]
    inverse = 1.0 / ti.max(j, SMALLEST_J)
    for r in ti.static(range(3)):
        for k in ti.static(range(3)):
            h[r][k] *= inverse
    return h, j


@ti.func
def spherical(law: ti.template(), w, c, j):
    """(lambda log J - mu), the spherical stress."""
    return law[w, c, OF_LAM] * log_lanes(ti.max(j, SMALLEST_J)) - law[w, c, OF_MU]


@ti.func
def viscous_stress(rate: ti.template(), h: ti.template(), eta):
    """eta (L + L^T) with L = rate h^T."""
    flow = product_transposed(rate, h)
    return [[eta * (flow[r][k] + flow[k][r]) for k in ti.static(range(3))] for r in ti.static(range(3))]


@ti.func
def product(a: ti.template(), b: ti.template()):
    """a b."""
    return [[a[r][0] * b[0][k] + a[r][1] * b[1][k] + a[r][2] * b[2][k] for k in ti.static(range(3))]
            for r in ti.static(range(3))]  # fmt: skip


@ti.func
def product_transposed(a: ti.template(), b: ti.template()):
    """a b^T."""
    return [[a[r][0] * b[k][0] + a[r][1] * b[k][1] + a[r][2] * b[k][2] for k in ti.static(range(3))]
            for r in ti.static(range(3))]  # fmt: skip


@ti.func
def along_fibre(a: ti.template(), law: ti.template(), w, c):
    """a d, of the fibres d."""
    return [
        a[r][0] * law[w, c, OF_FIBRE] + a[r][1] * law[w, c, OF_FIBRE + 1] + a[r][2] * law[w, c, OF_FIBRE + 2]
        for r in ti.static(range(3))
    ]


@ti.func
def is_near(c: ti.template(), cell):
    """Whether a cell may touch the ground's skin: its nodes are the hull of its particles at their sites, and those
    lie within half a cube of them."""
    low = 1e30 + 0.0 * c.scene.spacing
    for i in ti.static(range(8)):
        low = ti.min(low, ground_below(c, c.own_nodes[c.s, c.w, c.cells.node[cell, i], X]).gap)
    return low < c.scene.skin_thickness + 2.0 * c.scene.edge


@ti.func
def push_cell(c: ti.template(), cell):
    """Add the force of the ground's skin on the particles of a cell to its nodes."""
    if is_near(c, cell):
        for lane in ti.static(range(LANES)):
            if c.cells.particle[cell, lane] >= 0:
                below = ground_below(c, place_of(c.own_nodes, c.cells, c.s, c.w, cell, lane, X))
                if below.gap < c.scene.skin_thickness + 0.5 * c.scene.edge:
                    force, _rate = layer_force(below.gap, c.scene.edge, c.scene)
                    given = (c.cells.law[c.w, cell, OF_VOLUME][lane] * force) * below.normal
                    add_at(c, c.own_nodes, c.s, LAYER_FORCE, cell, lane, given)


@ti.func
def find_forces(c: ti.template()):
    """FORCE and LAYER_FORCE of all nodes of a world at slot s."""
    for n in range(c.cells.inverse.shape[1]):
        c.own_nodes[c.s, c.w, n, FORCE] = zero_lanes()
        c.own_nodes[c.s, c.w, n, LAYER_FORCE] = zero_lanes()
    for cell in range(c.cells.node.shape[0]):
        deformation = slope(c.own_nodes, c.cells, c.s, c.w, cell, X)
        h, j = inverse_transposed(deformation)
        iso = spherical(c.cells.law, c.w, cell, j)
        p = [[iso * h[r][k] + c.cells.law[c.w, cell, OF_MU] * deformation[r][k] for k in ti.static(range(3))]
             for r in ti.static(range(3))]  # fmt: skip
        if ti.static(c.variant.damping):
            more = product(viscous_stress(slope(c.own_nodes, c.cells, c.s, c.w, cell, V), h, c.scene.eta), h)
            for r in ti.static(range(3)):
                for k in ti.static(range(3)):
                    p[r][k] += more[r][k]
        if ti.static(c.variant.muscle):
            stretched = along_fibre(deformation, c.cells.law, c.w, cell)
            for r in ti.static(range(3)):
                for k in ti.static(range(3)):
                    p[r][k] += c.cells.law[c.w, cell, OF_TENSION] * stretched[r] * c.cells.law[c.w, cell, OF_FIBRE + k]
        for r in ti.static(range(3)):
            for k in ti.static(range(3)):
                p[r][k] *= -1.0 * c.cells.law[c.w, cell, OF_VOLUME]
        add_to_nodes(c.own_nodes, c.s, c.w, FORCE, c.cells, cell, p)
        if ti.static(c.variant.skin):
            push_cell(c, cell)


@ti.func
def moved(c: ti.template(), n):
    """A node's velocity after the forces, before and after friction, and the change by the ground's skin."""
    inverse = c.cells.inverse[c.w, n]
    a = c.dt * inverse * c.own_nodes[c.s, c.w, n, LAYER_FORCE]
    gravity = ti.Vector([c.scene.g_x, c.scene.g_y, c.scene.g_z, 0.0])
    before = c.own_nodes[c.s, c.w, n, V] + c.dt * inverse * c.own_nodes[c.s, c.w, n, FORCE] + c.dt * gravity + a
    return before, coulomb_friction(before, a, c.scene.friction), a


@ti.func
def write_particles(state: ti.template(), nodes: ti.template(), cells: ti.template(), s, w):
    """Place, velocity and deformation gradient of the particles of a world at slot s."""
    for c in range(cells.node.shape[0]):
        deformation = slope(nodes, cells, s, w, c, X)
        for lane in ti.static(range(LANES)):
            p = cells.particle[c, lane]
            if p >= 0:
                state[s, w, p, X] = place_of(nodes, cells, s, w, c, lane, X)
                state[s, w, p, V] = place_of(nodes, cells, s, w, c, lane, V)
                zero = 0.0 * deformation[0][0][lane]
                still = ti.Vector([zero, zero, zero, zero])
                put_columns(state, s, w, p, C, matrix(still, still, still))
                put_columns(state, s, w, p, F, matrix(
                    ti.Vector([deformation[0][0][lane], deformation[1][0][lane], deformation[2][0][lane], zero]),
                    ti.Vector([deformation[0][1][lane], deformation[1][1][lane], deformation[2][1][lane], zero]),
                    ti.Vector([deformation[0][2][lane], deformation[1][2][lane], deformation[2][2][lane], zero]),
                ))  # fmt: skip
