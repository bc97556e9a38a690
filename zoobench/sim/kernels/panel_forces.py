"""Water by forces on the surface of a robot in its rest frame, see `model.surface_water`: the forces.

The surface is in panels, each in a cell of the body (`model.surface_panels`); eight panels of a cell are the lanes of a
vector. With the panel's velocity v in water at rest, its unit normal n and area A by Nanson's formula, u_n = v . n, the
velocity u along the surface, W = F^-1 u, and the rate L of the body's motion,

    drag      f = -(C_n rho A u_n^2 / (4 |v|)) u_n n - (C_f rho A |v| / 2) u
    reaction  f = -m n (n . a - 2 n . L u + n . grad F [W, W])
    lift      f = -l (v . q) q,  l = C_l rho A_0 max(0, -V_x g)
    suction   f = l (v . q)^2 / (2 V_x) F^-T e_x

with V = F^-1 v along x, the body's axis at rest, by which N is the normal there and g how the body widens ahead, and
q = n - N_x F^-T e_x. The drag falls with the sine of the angle between panel and flow, as pressure recovers along what
closes gently. The lift is that of what is slender along its axis, and has no part in what its thickness pushes aside.
Half of the work that it takes comes back at the front edges that make it, as suction along the axis (Jones 1946):
with the lift alone a wave's thrust is less than Lighthill's by half of the integral of m' w^2. m = rho A_0 phi is the
panel's added mass. The reaction is Lighthill's (d/dt - u d/ds)^2 y (1960), n . a that of the nodes: their mass becomes
a matrix, K = M + sum w ((m + dt b) n n^T + dt l q q^T), which holds drag and lift by their coefficients b and l, too.

F and L are those of the middle of the panel's cell: at a corner they are those of a single node, however light it is.

    nodes    rows of `rest_frame`, and the matrix less M, ADDED and ADDED_SHEAR
    given    [groups, 8] of the lanes of a group of panels, rows below
    bend     [groups, 2 K] rows (xx yy zz 0) and (yz xz xy 0) by which the K nodes `around` make grad F
"""

import taichi as ti

from zoobench.sim.kernels.cell_lanes import FORCE, lanes_of, rows_at, summed
from zoobench.sim.kernels.columns import zero_lanes
from zoobench.sim.kernels.elastic import SMALLEST_J
from zoobench.sim.kernels.layout import VOLUME, V, X, while_compiling
from zoobench.sim.kernels.rest_frame import inverse_transposed
from zoobench.sim.model.rest_cells import LANES

ADDED, ADDED_SHEAR = 4, 5
"""Rows of a node: (xx yy zz 0) and (yz xz xy 0) of its added mass and implicit drag [kg]."""

OF_AREA, OF_SHARE, OF_WETTED, OF_MASS, OF_GROWTH, OF_AHEAD = 0, 3, 4, 5, 6, 7
"""Rows of `given`: area vector [m^2], the area of the panel's triangles relative to it [-] and by itself [m^2], added
mass [kg], how the body widens ahead [-], and component of the normal along x [-]."""

SIDES = tuple((2 * (i // 4) - 1, 2 * (i // 2 % 2) - 1, 2 * (i % 2) - 1) for i in range(8))
"""On which side of its cell's middle each node is, by axis."""

_PAIRS = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
TINY = 1e-30
"""Square of an area [m^4] that lanes without a panel have, which have no normal."""

SLOW = 1e-4
"""Speed [m/s] below which |u| and max(0, u) are smooth."""


@while_compiling
@ti.data_oriented
class Panels:
    """The arrays of a surface's panels as one argument: those of `model.surface_panels`."""

    def __init__(self, cell, around, weights, given, bend):
        self.cell, self.around, self.weights = cell, around, weights
        self.given, self.bend = given, bend


@while_compiling
@ti.data_oriented
class Flow:
    """What a group of panels sees of the water: fields by name, of lanes, vectors as lists of them."""

    def __init__(self, **given):
        vars(self).update(given)


@ti.func
def scalar(a: ti.template(), b: ti.template()):
    """a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@ti.func
def times(a: ti.template(), x: ti.template()):
    """a x, of matrices as lists of rows."""
    return [a[r][0] * x[0] + a[r][1] * x[1] + a[r][2] * x[2] for r in ti.static(range(3))]


@ti.func
def transposed_times(a: ti.template(), x: ti.template()):
    """a^T x."""
    return [a[0][k] * x[0] + a[1][k] * x[1] + a[2][k] * x[2] for k in ti.static(range(3))]


@ti.func
def middle_slope(nodes: ti.template(), c: ti.template(), s, g, row: ti.template()):
    """Gradient of a row of the nodes, in the middle of the cell of a group."""
    sums = [zero_lanes() for _ in ti.static(range(3))]
    for i in ti.static(range(8)):
        q = nodes[s, c.w, c.cells.node[c.panels.cell[g], i], row]
        for k in ti.static(range(3)):
            sums[k] += q * SIDES[i][k]
    share = 0.25 / c.scene.spacing
    return [[share * sums[k][r] for k in ti.static(range(3))] for r in ti.static(range(3))]


@ti.func
def panel_value(nodes: ti.template(), c: ti.template(), s, g, row: ti.template()):
    """A row of the nodes at the panels of a group."""
    return rows_at(c, nodes, s, c.panels.cell[g], row, c.panels.weights, g)


@ti.func
def second_gradient(c: ti.template(), g):
    """grad F about a group of panels: vectors by the pairs of axes in `_PAIRS` [1/m].

    Its sum over places from one of them is as exact as the differences between places.
    """
    found = [zero_lanes() for _ in ti.static(range(6))]
    origin = c.own_nodes[c.s, c.w, c.panels.around[g, 0], X]
    for k in range(c.panels.around.shape[1]):
        x = c.own_nodes[c.s, c.w, c.panels.around[g, k], X] - origin
        first, second = c.panels.bend[g, 2 * k], c.panels.bend[g, 2 * k + 1]
        for d in ti.static(range(3)):
            found[d] += first[d] * x
            found[3 + d] += second[d] * x
    return found


@ti.func
def along_pairs(w: ti.template()):
    """w w^T by the pairs of axes, those off the diagonal twice."""
    return [w[0] * w[0], w[1] * w[1], w[2] * w[2], 2.0 * w[1] * w[2], 2.0 * w[0] * w[2], 2.0 * w[0] * w[1]]


@ti.func
def flow_past(c: ti.template(), g):
    """How the water of a substep flows past a group of panels."""
    row = ti.static(c.panels.given)
    deformation, rate = middle_slope(c.own_nodes, c, c.s, g, X), middle_slope(c.own_nodes, c, c.s, g, V)
    h, j = inverse_transposed(deformation)
    v = panel_value(c.own_nodes, c, c.s, g, V)
    current = ti.static((c.scene.medium.current_x, c.scene.medium.current_y, c.scene.medium.current_z))
    for r in ti.static(range(3)):
        v[r] += lanes_of(0.0 - current[r])
    turned_area = times(h, [row[g, OF_AREA + k] for k in ti.static(range(3))])
    size = ti.sqrt(scalar(turned_area, turned_area) + TINY)
    n = [turned_area[r] / size for r in ti.static(range(3))]
    area = ti.max(j, SMALLEST_J) * size
    across = scalar(v, n)
    u = [v[r] - across * n[r] for r in ti.static(range(3))]
    w = transposed_times(h, u)
    turned = times(rate, w)
    bending = second_gradient(c, g)
    pairs = along_pairs(w)
    curved = [0.0 * across for _ in ti.static(range(3))]
    for d in ti.static(range(6)):
        for r in ti.static(range(3)):
            curved[r] += bending[d][r] * pairs[d]
    speed = ti.sqrt(scalar(v, v) + SLOW * SLOW)
    swift = ti.sqrt(across * across + SLOW * SLOW)
    ahead = h[0][0] * v[0] + h[1][0] * v[1] + h[2][0] * v[2]
    onto = 0.0 - ahead * row[g, OF_GROWTH]
    q = [n[r] - row[g, OF_AHEAD] * h[r][0] for r in ti.static(range(3))]
    sideways = scalar(v, q)
    grows = ti.sqrt(onto * onto + SLOW * SLOW)
    wetted = c.scene.medium.lift * c.scene.medium.density * row[g, OF_WETTED]
    lift = 0.5 * wetted * (onto + grows)
    suction = (0.0 - 0.25) * wetted * row[g, OF_GROWTH] * (1.0 + onto / grows) * sideways * sideways
    drag = (0.25 * c.scene.medium.density * c.scene.medium.normal_drag) * area * swift * swift / speed
    bent = [curved[r] - 2.0 * turned[r] for r in ti.static(range(3))]
    rubbing = (0.5 * c.scene.medium.density * c.scene.medium.friction) * area * row[g, OF_SHARE]
    return Flow(
        rate=rate, h=h, v=v, n=n, area=area, across=across, u=u, w=w, bending=bending, bent=bent, speed=speed,
        swift=swift, onto=onto, grows=grows, wetted=wetted, lift=lift, drag=drag, rubbing=rubbing,
        mass=row[g, OF_MASS], sideways=sideways, q=q, suction=suction,
    )  # fmt: skip


@ti.func
def wet_panels(c: ti.template(), g):
    """Add the water's force on a group of panels to FORCE of its nodes, and its resistance to ADDED."""
    flow = flow_past(c, g)
    normal = 0.0 - (flow.drag * flow.across + flow.mass * scalar(flow.n, flow.bent))
    along, lifted = 0.0 - flow.rubbing * flow.speed, 0.0 - flow.lift * flow.sideways
    force = [
        normal * flow.n[r] + along * flow.u[r] + lifted * flow.q[r] + flow.suction * flow.h[r][0]
        for r in ti.static(range(3))
    ]
    heavy, held = flow.mass + c.dt * flow.drag, c.dt * flow.lift
    added = [heavy * flow.n[a] * flow.n[b] + held * flow.q[a] * flow.q[b] for a, b in ti.static(_PAIRS)]
    for i in ti.static(range(8)):
        share = c.panels.weights[g, i]
        node = c.cells.node[c.panels.cell[g], i]
        c.own_nodes[c.s, c.w, node, FORCE] += summed(share, force[0], force[1], force[2])
        c.own_nodes[c.s, c.w, node, ADDED] += summed(share, added[0], added[1], added[2])
        c.own_nodes[c.s, c.w, node, ADDED_SHEAR] += summed(share, added[3], added[4], added[5])


@ti.func
def load_displaced(body: ti.template(), c: ti.template()):
    """Fill `displaced` with the volumes at the nodes of a world [m^3]."""
    for n in range(c.displaced.shape[1]):
        c.displaced[c.w, n] = 0.0 * c.scene.spacing
    for cell in range(c.cells.node.shape[0]):
        for lane in ti.static(range(LANES)):
            p = c.cells.particle[cell, lane]
            if p >= 0:
                for i in ti.static(range(8)):
                    share = c.cells.masses[c.cells.shape[cell], i][lane]
                    c.displaced[c.w, c.cells.node[cell, i]] += body[c.w, p, 0][VOLUME] * share


@ti.func
def resistance(c: ti.template(), n):
    """The inverse of a node's matrix K: (xx yy zz 0) and (yz xz xy 0) [1/kg]."""
    diagonal, shear = c.own_nodes[c.s, c.w, n, ADDED], c.own_nodes[c.s, c.w, n, ADDED_SHEAR]
    mass = 1.0 / c.cells.inverse[c.w, n]
    xx, yy, zz = diagonal[0] + mass, diagonal[1] + mass, diagonal[2] + mass
    yz, xz, xy = shear[0], shear[1], shear[2]
    a, b, d = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    scale = 1.0 / (xx * a + xy * b + xz * d)
    return (
        scale * ti.Vector([a, xx * zz - xz * xz, xx * yy - xy * xy, 0.0]),
        scale * ti.Vector([xy * xz - xx * yz, d, b, 0.0]),
    )


@ti.func
def applied(inverse: ti.template(), x):
    """What the inverse of `resistance` makes of a vector."""
    diagonal, shear = inverse
    return ti.Vector(
        [
            diagonal[0] * x[0] + shear[2] * x[1] + shear[1] * x[2],
            shear[2] * x[0] + diagonal[1] * x[1] + shear[0] * x[2],
            shear[1] * x[0] + shear[0] * x[1] + diagonal[2] * x[2],
            0.0,
        ]
    )


@ti.func
def gravity_of(c: ti.template()):
    """Gravity [m/s^2]."""
    return ti.Vector([c.scene.g_x, c.scene.g_y, c.scene.g_z, 0.0])


@ti.func
def gained(c: ti.template(), n):
    """A node's gain of velocity in a substep, by its force, and by its weight less that of the water it displaces."""
    weight = 1.0 / c.cells.inverse[c.w, n] - c.scene.medium.density * c.displaced[c.w, n]
    force = c.own_nodes[c.s, c.w, n, FORCE] + weight * gravity_of(c)
    return c.dt * applied(resistance(c, n), force)


@ti.func
def find_water_forces(c: ti.template()):
    """Add the water's part to FORCE of all nodes of a world at slot s, and fill ADDED."""
    for n in range(c.cells.inverse.shape[1]):
        c.own_nodes[c.s, c.w, n, ADDED] = zero_lanes()
        c.own_nodes[c.s, c.w, n, ADDED_SHEAR] = zero_lanes()
    for g in range(c.panels.cell.shape[0]):
        wet_panels(c, g)
