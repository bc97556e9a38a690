"""A robot's particle to and from the faces of the water's grid: MLS-MPM with APIC, direction by direction.

Faces of direction d form a grid that is offset by half a cell in the two other directions. Arrays and names are those
of `substep`; fields of the grid are those of `water_layout`.
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
from zoobench.sim.kernels.layout import MASS, VOLUME, C, F, V, X, columns, put_columns
from zoobench.sim.kernels.splines import INVERSE_MOMENT, stencil, weight_derivatives, weights
from zoobench.sim.kernels.substep import particle_stress
from zoobench.sim.kernels.substep_adjoint import robot_stress_adjoint
from zoobench.sim.kernels.transfer import gather, gather_adjoint, scatter, scatter_adjoint
from zoobench.sim.kernels.water_grid.water_layout import MOVED, ROBOT, only, unit

COVER = 3
"""Lane of a particle's second row of `body`: the factor of its volume by which faces count as solid."""


@ti.func
def face_stencil(place, own, scene: ti.template(), nodes: ti.template(), width: ti.template()):
    """The stencil of a place in the faces of a direction, of which `own` is the unit vector."""
    half = 0.5 * scene.spacing
    return stencil(place - lanes(half, half, half, 0.0) + half * own, scene, nodes, width)


@ti.func
def along(a: ti.template(), own):
    """The row of a matrix in a direction, as slopes of the first lane."""
    return matrix(only(dot(a.x, own), 0), only(dot(a.y, own), 0), only(dot(a.z, own), 0))


@ti.func
def affine(state: ti.template(), body: ti.template(), scene: ti.template(), dt, s, w, p, variant: ti.template()):
    """Change of a particle's momentum from node to node: of its motion and of the internal forces (see `substep`)."""
    q = body[w, p, 0]
    factor = -ti.static(INVERSE_MOMENT[variant.width]) * dt * scene.inverse * q[VOLUME]
    slope = scale(factor, particle_stress(state, body, scene, s, w, p, variant))
    return add(slope, scale(q[MASS] * scene.spacing, columns(state, s, w, p, C)))


@ti.func
def origin_row(state: ti.template(), body: ti.template(), s, w, p, own, slope: ti.template(), offset):
    """(momentum along a direction, mass, volume, covered volume) at the first node of a stencil."""
    q = body[w, p, 0]
    momentum = q[MASS] * state[s, w, p, V] - offset[0] * slope.x - offset[1] * slope.y - offset[2] * slope.z
    return lanes(dot(momentum, own), q[MASS], q[VOLUME], q[VOLUME] * body[w, p, 1][COVER])


@ti.func
def to_faces(
    state: ti.template(), body: ti.template(), grid: ti.template(), nodes: ti.template(), scene: ti.template(), dt,
    s, w, p, variant: ti.template(),
):  # fmt: skip
    """Scatter one particle."""
    width = ti.static(variant.width)
    slope = affine(state, body, scene, dt, s, w, p, variant)
    for d in range(3):
        own = unit(d)
        at = face_stencil(state[s, w, p, X], own, scene, nodes, width)
        origin = origin_row(state, body, s, w, p, own, slope, at.offset)
        share = weights(at.offset, width)
        scatter(grid, ROBOT + d, 0, nodes, at.node, share, origin, along(slope, own), width)


@ti.func
def from_faces(
    state: ti.template(), grid: ti.template(), nodes: ti.template(), scene: ti.template(), dt, s, t, w, p,
    variant: ti.template(),
):  # fmt: skip
    """Gather, move and deform one particle."""
    width = ti.static(variant.width)
    factor = ti.static(INVERSE_MOMENT[variant.width]) * scene.inverse
    place, velocity = state[s, w, p, X], zero_lanes()
    rate_x, rate_y, rate_z = zero_lanes(), zero_lanes(), zero_lanes()
    for d in range(3):
        own = unit(d)
        at = face_stencil(place, own, scene, nodes, width)
        total, by_x, by_y, by_z = gather(grid, MOVED + d, nodes, at.node, weights(at.offset, width), width)
        v = total[0]
        velocity += v * own
        rate_x += factor * (by_x[0] - at.offset[0] * v) * own
        rate_y += factor * (by_y[0] - at.offset[1] * v) * own
        rate_z += factor * (by_z[0] - at.offset[2] * v) * own
    rate = matrix(rate_x, rate_y, rate_z)
    state[t, w, p, X] = place + dt * velocity
    state[t, w, p, V] = velocity
    put_columns(state, t, w, p, C, rate)
    deformation = columns(state, s, w, p, F)
    put_columns(state, t, w, p, F, add(deformation, matmul(scale(dt, rate), deformation)))


@ti.func
def from_faces_adjoint(
    state: ti.template(), adjoint: ti.template(), grid: ti.template(), grid_adjoint: ti.template(),
    nodes: ti.template(), scene: ti.template(), dt, s, t, w, p, variant: ti.template(),
):  # fmt: skip
    """Adjoint of `from_faces`: adds to the faces' velocity adjoint in ROBOT; those of v and C are used up."""
    width = ti.static(variant.width)
    factor = ti.static(INVERSE_MOMENT[variant.width]) * scene.inverse
    place, rate = state[s, w, p, X], columns(state, t, w, p, C)
    F_adjoint, x_adjoint = columns(adjoint, 0, w, p, F), adjoint[0, w, p, X]
    rate_adjoint = add(
        columns(adjoint, 0, w, p, C), scale(dt, matmul_transposed(F_adjoint, columns(state, s, w, p, F)))
    )
    put_columns(adjoint, 0, w, p, F, add(F_adjoint, scale(dt, transposed_matmul(rate, F_adjoint))))
    v_adjoint, velocity = adjoint[0, w, p, V] + dt * x_adjoint, state[t, w, p, V]
    slope = scale(factor, rate_adjoint)
    for d in range(3):
        own = unit(d)
        at = face_stencil(place, own, scene, nodes, width)
        by_place = transposed_matvec(slope, own)
        origin = only(dot(v_adjoint, own) - dot(at.offset, by_place), 0)
        x_adjoint += scene.inverse * (
            gather_adjoint(
                grid, MOVED + d, 0, grid_adjoint, ROBOT + d, nodes, at.node,
                weights(at.offset, width), weight_derivatives(at.offset, width), origin, along(slope, own), width, True,
            )
            - dot(velocity, own) * by_place
        )  # fmt: skip
    adjoint[0, w, p, X] = x_adjoint


@ti.func
def to_faces_adjoint(
    state: ti.template(), body: ti.template(), adjoint: ti.template(), body_adjoint: ti.template(),
    grid_adjoint: ti.template(), nodes: ti.template(), scene: ti.template(), dt, s, w, p, variant: ti.template(),
):  # fmt: skip
    """Adjoint of `to_faces`: state adjoints at slot s, and additions to those of the parameters."""
    width = ti.static(variant.width)
    q, velocity, rate = body[w, p, 0], state[s, w, p, V], columns(state, s, w, p, C)
    slope = affine(state, body, scene, dt, s, w, p, variant)
    x_adjoint, v_adjoint, sums = zero_lanes(), zero_lanes(), zero_lanes()
    by_x, by_y, by_z = zero_lanes(), zero_lanes(), zero_lanes()
    for d in range(3):
        own = unit(d)
        at = face_stencil(state[s, w, p, X], own, scene, nodes, width)
        origin = origin_row(state, body, s, w, p, own, slope, at.offset)
        offset_adjoint, total, first_x, first_y, first_z = scatter_adjoint(
            grid_adjoint, ROBOT + d, nodes, at.node, weights(at.offset, width),
            weight_derivatives(at.offset, width), origin, along(slope, own), width,
        )  # fmt: skip
        x_adjoint += offset_adjoint - total[0] * transposed_matvec(slope, own)
        v_adjoint += total[0] * own
        by_x += (first_x[0] - at.offset[0] * total[0]) * own
        by_y += (first_y[0] - at.offset[1] * total[0]) * own
        by_z += (first_z[0] - at.offset[2] * total[0]) * own
        sums += total
    affine_adjoint = matrix(by_x, by_y, by_z)
    rate_adjoint = scale(scene.spacing, affine_adjoint)
    mass_adjoint = sums[1] + dot(v_adjoint, velocity) + contract(rate_adjoint, rate)
    adjoint[0, w, p, X] += scene.inverse * spatial(x_adjoint)
    adjoint[0, w, p, V] = q[MASS] * v_adjoint
    put_columns(adjoint, 0, w, p, C, scale(q[MASS], rate_adjoint))
    # the stress is symmetric, so only the symmetric part of its adjoint acts
    factor = -ti.static(INVERSE_MOMENT[width]) * dt * scene.inverse
    even = scale(0.5 * factor, add(affine_adjoint, transpose(affine_adjoint)))
    stress = particle_stress(state, body, scene, s, w, p, variant)
    volume_adjoint = contract(even, stress) + sums[2] + body[w, p, 1][COVER] * sums[3]
    body_adjoint[w, p, 0] += ti.Vector([mass_adjoint, volume_adjoint, 0.0, 0.0])
    robot_stress_adjoint(state, body, adjoint, body_adjoint, scene, s, w, p, scale(q[VOLUME], even), variant)
