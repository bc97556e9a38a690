"""A robot's particle to and from the faces of the water's grid: MLS-MPM with APIC, direction by direction.

Faces of direction d form a grid that is offset by half a cell in the two other directions. `c` is the substep's
`context.Context`; fields of the grid are those of `water_layout`.
"""

import taichi as ti

from zoobench.sim.kernels.columns import (
    add,
    contract,
    dot,
    lanes,
    matmul,
    matmul_transposed,
    matrix,
    scale,
    spatial,
    transpose,
    transposed_matmul,
    transposed_matvec,
    zero_lanes,
)
from zoobench.sim.kernels.context import Around
from zoobench.sim.kernels.layout import MASS, VOLUME, C, F, V, X, columns, put_columns
from zoobench.sim.kernels.splines import INVERSE_MOMENT, stencil, weight_derivatives, weights
from zoobench.sim.kernels.substep import particle_stress
from zoobench.sim.kernels.substep_adjoint import robot_stress_adjoint
from zoobench.sim.kernels.transfer import gather, gather_adjoint, scatter, scatter_adjoint
from zoobench.sim.kernels.water_grid.water_layout import MOVED, ROBOT, direction_row, only

COVER = 3
"""Lane of a particle's second row of `body`: the factor of its volume by which faces count as solid."""


@ti.func
def face_stencil(c: ti.template(), place, own):
    """The stencil of a place in the faces of a direction, of which `own` is the unit vector."""
    half = 0.5 * c.scene.spacing
    return stencil(place - lanes(half, half, half, 0.0) + half * own, c.scene, c.nodes, c.variant.width)


@ti.func
def along(a: ti.template(), own):
    """The row of a matrix in a direction, as slopes of the first lane."""
    return matrix(only(dot(a.x, own), 0), only(dot(a.y, own), 0), only(dot(a.z, own), 0))


@ti.func
def affine(c: ti.template(), p):
    """Change of a particle's momentum from node to node: of its motion and of the internal forces (see `substep`)."""
    q = c.body[c.w, p, 0]
    factor = -ti.static(INVERSE_MOMENT[c.variant.width]) * c.dt * c.scene.inverse * q[VOLUME]
    slope = scale(factor, particle_stress(c, p))
    return add(slope, scale(q[MASS] * c.scene.spacing, columns(c.state, c.s, c.w, p, C)))


@ti.func
def origin_row(c: ti.template(), p, own, slope: ti.template(), offset):
    """(momentum along a direction, mass, volume, covered volume) at the first node of a stencil."""
    q = c.body[c.w, p, 0]
    momentum = q[MASS] * c.state[c.s, c.w, p, V] - offset[0] * slope.x - offset[1] * slope.y - offset[2] * slope.z
    return lanes(dot(momentum, own), q[MASS], q[VOLUME], q[VOLUME] * c.body[c.w, p, 1][COVER])


@ti.func
def to_faces(c: ti.template(), p):
    """Scatter one particle."""
    width = ti.static(c.variant.width)
    slope = affine(c, p)
    for d in range(3):
        own = direction_row(d)
        at = face_stencil(c, c.state[c.s, c.w, p, X], own)
        origin = origin_row(c, p, own, slope, at.offset)
        share = weights(at.offset, width)
        scatter(c.field(ROBOT + d), Around(at, share), origin, along(slope, own))


@ti.func
def from_faces(c: ti.template(), p):
    """Gather, move and deform one particle."""
    width = ti.static(c.variant.width)
    factor = ti.static(INVERSE_MOMENT[c.variant.width]) * c.scene.inverse
    place, velocity = c.state[c.s, c.w, p, X], zero_lanes()
    rate_x, rate_y, rate_z = zero_lanes(), zero_lanes(), zero_lanes()
    for d in range(3):
        own = direction_row(d)
        at = face_stencil(c, place, own)
        share = weights(at.offset, width)
        total, by_x, by_y, by_z = gather(c.field(MOVED + d), Around(at, share))
        v = total[0]
        velocity += v * own
        rate_x += factor * (by_x[0] - at.offset[0] * v) * own
        rate_y += factor * (by_y[0] - at.offset[1] * v) * own
        rate_z += factor * (by_z[0] - at.offset[2] * v) * own
    rate = matrix(rate_x, rate_y, rate_z)
    c.state[c.t, c.w, p, X] = place + c.dt * velocity
    c.state[c.t, c.w, p, V] = velocity
    put_columns(c.state, c.t, c.w, p, C, rate)
    deformation = columns(c.state, c.s, c.w, p, F)
    put_columns(c.state, c.t, c.w, p, F, add(deformation, matmul(scale(c.dt, rate), deformation)))


@ti.func
def from_faces_adjoint(c: ti.template(), p):
    """Adjoint of `from_faces`: adds to the faces' velocity adjoint in ROBOT; those of v and C are used up."""
    width = ti.static(c.variant.width)
    factor = ti.static(INVERSE_MOMENT[c.variant.width]) * c.scene.inverse
    place, rate = c.state[c.s, c.w, p, X], columns(c.state, c.t, c.w, p, C)
    F_adjoint, x_adjoint = columns(c.adjoint, 0, c.w, p, F), c.adjoint[0, c.w, p, X]
    rate_adjoint = add(
        columns(c.adjoint, 0, c.w, p, C), scale(c.dt, matmul_transposed(F_adjoint, columns(c.state, c.s, c.w, p, F)))
    )
    put_columns(c.adjoint, 0, c.w, p, F, add(F_adjoint, scale(c.dt, transposed_matmul(rate, F_adjoint))))
    v_adjoint, velocity = c.adjoint[0, c.w, p, V] + c.dt * x_adjoint, c.state[c.t, c.w, p, V]
    slope = scale(factor, rate_adjoint)
    for d in range(3):
        own = direction_row(d)
        at = face_stencil(c, place, own)
        share, slopes = weights(at.offset, width), weight_derivatives(at.offset, width)
        near, by_place = Around(at, share, slopes), transposed_matvec(slope, own)
        origin = only(dot(v_adjoint, own) - dot(at.offset, by_place), 0)
        x_adjoint += c.scene.inverse * (
            gather_adjoint(c.field(MOVED + d), c.adjoint_of(ROBOT + d), near, origin, along(slope, own))
            - dot(velocity, own) * by_place
        )
    c.adjoint[0, c.w, p, X] = x_adjoint


@ti.func
def to_faces_adjoint(c: ti.template(), p):
    """Adjoint of `to_faces`: state adjoints at slot s, and additions to those of the parameters."""
    width = ti.static(c.variant.width)
    q, velocity, rate = c.body[c.w, p, 0], c.state[c.s, c.w, p, V], columns(c.state, c.s, c.w, p, C)
    slope = affine(c, p)
    x_adjoint, v_adjoint, sums = zero_lanes(), zero_lanes(), zero_lanes()
    by_x, by_y, by_z = zero_lanes(), zero_lanes(), zero_lanes()
    for d in range(3):
        own = direction_row(d)
        at = face_stencil(c, c.state[c.s, c.w, p, X], own)
        origin = origin_row(c, p, own, slope, at.offset)
        share, slopes = weights(at.offset, width), weight_derivatives(at.offset, width)
        offset_adjoint, total, first_x, first_y, first_z = scatter_adjoint(
            c.adjoint_of(ROBOT + d), Around(at, share, slopes), origin, along(slope, own)
        )
        x_adjoint += offset_adjoint - total[0] * transposed_matvec(slope, own)
        v_adjoint += total[0] * own
        by_x += (first_x[0] - at.offset[0] * total[0]) * own
        by_y += (first_y[0] - at.offset[1] * total[0]) * own
        by_z += (first_z[0] - at.offset[2] * total[0]) * own
        sums += total
    affine_adjoint = matrix(by_x, by_y, by_z)
    rate_adjoint = scale(c.scene.spacing, affine_adjoint)
    mass_adjoint = sums[1] + dot(v_adjoint, velocity) + contract(rate_adjoint, rate)
    c.adjoint[0, c.w, p, X] += c.scene.inverse * spatial(x_adjoint)
    c.adjoint[0, c.w, p, V] = q[MASS] * v_adjoint
    put_columns(c.adjoint, 0, c.w, p, C, scale(q[MASS], rate_adjoint))
    # the stress is symmetric, so only the symmetric part of its adjoint acts
    factor = -ti.static(INVERSE_MOMENT[width]) * c.dt * c.scene.inverse
    even = scale(0.5 * factor, add(affine_adjoint, transpose(affine_adjoint)))
    stress = particle_stress(c, p)
    volume_adjoint = contract(even, stress) + sums[2] + c.body[c.w, p, 1][COVER] * sums[3]
    c.body_adjoint[c.w, p, 0] += ti.Vector([mass_adjoint, volume_adjoint, 0.0, 0.0])
    robot_stress_adjoint(c, p, scale(q[VOLUME], even))
