"""The survey after a frame: the worst values of every world, from which divergence and the next step are found."""

from typing import Any

import taichi as ti

from zoobench.sim.kernels.array_types import Rows, Scalars
from zoobench.sim.kernels.boundary import TERRAIN, WALL_NODES
from zoobench.sim.kernels.columns import cofactor, contract, determinant, dot, matmul_transposed, scale, trace
from zoobench.sim.kernels.elastic import SMALLEST_J
from zoobench.sim.kernels.laws.law import Law
from zoobench.sim.kernels.layout import (
    MASS,
    STIFFNESS,
    TENSION,
    VOLUME,
    C,
    F,
    Surveyed,
    V,
    X,
    columns,
    history,
    object_constants,
    scene_constants,
    while_compiling,
)


@while_compiling
def known_constants(constants: Any, of: Surveyed) -> ti.Struct:
    """The constants by name, those of objects after those of their medium or water."""
    return scene_constants(constants, of.water or of.law, object_constants(of.objects))


@ti.func
def largest_square(F: ti.template()):
    """Upper bound of the largest squared stretch, exact if the two others are equal (Wolkowicz and Styan 1980).

    With mean m and standard deviation s of the three it is m + sqrt(2) s, without a decomposition.
    """
    b = matmul_transposed(F, F)
    mean = trace(b) / 3.0
    # |dev b|^2 by differences, which do not cancel
    x, y, z = b.x[0] - mean, b.y[1] - mean, b.z[2] - mean
    off = b.x[1] * b.x[1] + b.x[2] * b.x[2] + b.y[2] * b.y[2]
    return mean + ti.sqrt(2.0 / 3.0) * ti.sqrt(x * x + y * y + z * z + 2.0 * off)


@ti.func
def condition(state: ti.template(), body: ti.template(), scene: ti.template(), w, p, of: ti.template()):
    """What a particle of mass has of `step_limits.Condition` at slot 0: its four `values`, which may be NaN, and the
    others, 0 where its matter has none."""
    if ti.static(of.rest_frame):
        return rest_frame_condition(state, body, scene, w, p, of)
    q = body[w, p, 0]
    place, speed, rate = state[0, w, p, X], state[0, w, p, V], columns(state, 0, w, p, C)
    nodes = (scene.nodes_x, scene.nodes_y, scene.nodes_z)
    largest = 0.0 * scene.spacing - 1e30
    for d in ti.static(range(3)):
        cells = place[d] * scene.inverse
        largest = ti.max(largest, WALL_NODES - cells, cells - (nodes[d] - 1 - WALL_NODES))
    # max drops a NaN, a difference keeps it
    spread = place.sum() - place.sum()
    values = ti.Vector([ti.sqrt(dot(speed, speed)), ti.sqrt(contract(rate, rate)), largest + spread, -1e30])
    per_mass = q[VOLUME] / q[MASS]
    square, robot, medium, viscosity, ground = 0.0, 0.0, 0.0, 0.0, 0.0
    if p < scene.robot:
        deformation = columns(state, 0, w, p, F)
        values[3] = -determinant(deformation)
        k, mu, lam, eta = q[STIFFNESS], scene.mu, scene.lam, scene.eta
        for n in ti.static(range(of.objects)):
            if p >= scene.first[n]:
                mu, lam, eta = scene.object_mu[n], scene.object_lam[n], scene.object_eta[n]
        square = largest_square(deformation)
        viscosity = eta * per_mass
        if ti.static(of.skin):
            ground = scene.skin_rate * per_mass
        # kappa of `step_limits.elastic_kappa`; a muscle that pushes does not lower it
        active = 2.0 * (k * mu + ti.max(q[TENSION], 0.0)) * square
        robot = (active + 3.0 * k * lam) * per_mass
    elif ti.static(isinstance(of.law, Law)):
        medium = of.law.kappa(history(state, 0, w, p), scene.medium) * per_mass
    return ti.Struct(values=values, square=square, robot=robot, medium=medium, viscosity=viscosity, ground=ground)


@ti.func
def rest_frame_condition(state: ti.template(), body: ti.template(), scene: ti.template(), w, p, of: ti.template()):
    """`condition` of a particle of a robot in its rest frame.

    There the stiffness by place grows in compression, as the square of the largest stretch of F^-1, and the viscosity
    likewise. There is no velocity gradient of the grid, and no wall: where a terrain ends the robot is beyond the
    arena, on level ground nowhere.
    """
    q = body[w, p, 0]
    v, deformation = state[0, w, p, V], columns(state, 0, w, p, F)
    j, per_mass, zero = determinant(deformation), q[VOLUME] / q[MASS], 0.0 * scene.spacing
    speed = ti.sqrt(dot(v, v)) + 0.0 * dot(deformation.x, deformation.x)
    held = ti.max(j, SMALLEST_J)
    folds = largest_square(scale(1.0 / held, cofactor(deformation)))
    mu, lam = q[STIFFNESS] * scene.mu, q[STIFFNESS] * scene.lam
    bulk = mu + lam * ti.max(0.0, 1.0 - ti.log(held))
    beyond, ground = zero, zero
    if ti.static(of.skin):
        ground = scene.skin_rate * per_mass
    if ti.static(of.ground == TERRAIN):
        x, z = state[0, w, p, X][0] * scene.inverse, state[0, w, p, X][2] * scene.inverse
        by_x = ti.max(WALL_NODES - x, x - (scene.nodes_x - 1 - WALL_NODES))
        by_z = ti.max(WALL_NODES - z, z - (scene.nodes_z - 1 - WALL_NODES))
        beyond = ti.max(beyond, by_x, by_z)
    return ti.Struct(
        values=ti.Vector([speed, zero, beyond, 0.0 - j]), square=largest_square(deformation),
        robot=per_mass * (mu + bulk * folds + ti.max(0.0, q[TENSION])), medium=zero,
        viscosity=per_mass * scene.eta * folds, ground=ground,
    )  # fmt: skip


@ti.kernel
def survey(
    state: Rows, body: Rows, constants: Scalars, alive: Scalars, report: Scalars, culprit: Scalars,
    count: int, of: ti.template(),
):  # fmt: skip
    """Fill the `report` of every world alive with the `step_limits.Condition` of its first `count` particles, from slot
    0.

    `culprit[w]` holds the particle of each of the first four, where the first NaN is kept. Massless particles are left
    out. `of` is a `layout.Surveyed`.
    """
    ti.loop_config(serialize=not of.at_once)
    for w in range(state.shape[1]):
        scene = known_constants(constants, of)
        worst = ti.Vector([0.0, 0.0, 0.0, -1e30])
        who = ti.Vector([0, 0, 0, 0])
        guarded, square, robot, medium, viscosity, ground = 0, 0.0, 0.0, 0.0, 0.0, 0.0
        for p in range(count * alive[w]):
            if body[w, p, 0][MASS] > 0.0:
                found = condition(state, body, scene, w, p, of)
                values = found.values
                guarded += ti.cast(-values[3] < SMALLEST_J, ti.i32)
                square, robot = ti.max(square, found.square), ti.max(robot, found.robot)
                medium, ground = ti.max(medium, found.medium), ti.max(ground, found.ground)
                viscosity = ti.max(viscosity, found.viscosity)
                for c in ti.static(range(4)):
                    # negated, as a NaN fails every comparison; worst is equal to itself unless it is a NaN already
                    if not (values[c] <= worst[c]) and worst[c] == worst[c]:
                        worst[c] = values[c]
                        who[c] = p
        for c in ti.static(range(3)):
            report[w, c] = worst[c]
        for c in ti.static(range(4)):
            culprit[w, c] = who[c]
        report[w, 3] = -worst[3]
        report[w, 4] = guarded
        report[w, 5] = ti.sqrt(square)
        report[w, 6] = robot
        report[w, 7] = medium
        report[w, 8] = viscosity
        report[w, 9] = ground


@ti.kernel
def survey_each(
    state: Rows, body: Rows, constants: Scalars, alive: Scalars, found: Scalars, count: int, of: ti.template(),
):  # fmt: skip
    """The `condition` of every particle of mass in a world alive `[worlds, count, 9]`, for many threads."""
    for w, p in ti.ndrange(state.shape[1], count):
        for c in ti.static(range(9)):
            found[w, p, c] = -1e30 if ti.static(c == 3) else 0.0
        if alive[w] and body[w, p, 0][MASS] > 0.0:
            each = condition(state, body, known_constants(constants, of), w, p, of)
            for c in ti.static(range(4)):
                found[w, p, c] = each.values[c]
            found[w, p, 4] = each.square
            found[w, p, 5] = each.robot
            found[w, p, 6] = each.medium
            found[w, p, 7] = each.viscosity
            found[w, p, 8] = each.ground
