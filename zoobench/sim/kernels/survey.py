"""The survey after a frame: the worst values of every world, from which divergence and the next step are found."""

import taichi as ti

from zoobench.sim.kernels.array_types import Matrices, Scalars, Vectors
from zoobench.sim.kernels.elastic import SMALLEST_J
from zoobench.sim.kernels.linalg import identity, matmul
from zoobench.sim.kernels.media import SNOW, WATER


@ti.func
def largest_square(F):
    """Upper bound of the largest squared stretch, exact if the two others are equal (Wolkowicz and Styan 1980).

    With mean m and standard deviation s of the three it is m + sqrt(2) s, without a decomposition.
    """
    b = matmul(F, F.transpose())
    mean = b.trace() / 3.0
    deviator = b - mean * identity()
    return mean + ti.sqrt(2.0 / 3.0) * deviator.norm()


@ti.func
def medium_kappa(history, constants, law: ti.template()):
    """Stiffness [Pa] of an isolated particle in its state (see `step_limits`): 2 mu + 3 lambda in Hencky strain.

    That of snow is at its present hardening and largest elastic stretch, that of water at its present J.
    """
    kappa = 2.0 * constants[0] + 3.0 * constants[1]
    if ti.static(law == SNOW):
        # derivative of the corotated stress by log stretch, equal in all directions, at s = 1 + theta_s
        s = 1.0 + constants[3]
        soft = 2.0 * constants[0] * (2.0 * s - 1.0) * s + 3.0 * constants[1] * (2.0 * s**3 - 1.0) * s**3
        kappa = ti.exp(constants[4] * (1.0 - history)) * soft
    if ti.static(law == WATER):
        bulk, gamma = constants[1], constants[2]
        # -3 d(J p)/d log J of the Tait pressure
        J = ti.min(history, 1.0)
        kappa = 3.0 * bulk / gamma * ((gamma - 1.0) * ti.pow(J, 1.0 - gamma) + J)
    return kappa


@ti.kernel
def survey(
    x: Vectors, v: Vectors, C: Matrices, F: Matrices, history: Scalars,
    mass: Scalars, volume: Scalars, stiffness: Scalars, tension: Scalars, alive: Scalars,
    report: Scalars, culprit: Scalars, low: float, high_x: float, high_y: float, high_z: float,
    h: float, mu: float, lam: float, eta: float, m0: float, m1: float, m2: float, m3: float, m4: float,
    law: ti.template(),
):  # fmt: skip
    """Fill the `report` of every world alive with its `step_limits.Condition`, from slot 0.

    `culprit[w]` holds the particle of each of the first four, where the first NaN is kept, and of the stretch.
    Massless particles are left out.
    """
    for w in range(x.shape[1]):
        constants = ti.Vector([m0, m1, m2, m3, m4])
        worst = ti.Vector([0.0, 0.0, 0.0, -1e30])
        who = ti.Vector([0, 0, 0, 0])
        guarded, widest, square, robot, medium, viscosity = 0, 0, 0.0, 0.0, 0.0, 0.0
        for p in range(x.shape[2] * alive[w]):
            if mass[w, p] > 0.0:
                place = x[0, w, p]
                beyond = ti.max(low - place, place - ti.Vector([high_x, high_y, high_z])) / h
                largest = ti.max(beyond[0], beyond[1], beyond[2])
                # max drops a NaN, a difference keeps it
                spread = place.sum() - place.sum()
                values = ti.Vector([v[0, w, p].norm(), C[0, w, p].norm(), largest + spread, -1e30])
                per_mass = volume[w, p] / mass[w, p]
                if p < F.shape[2]:
                    values[3] = -F[0, w, p].determinant()
                    if -values[3] < SMALLEST_J:
                        guarded += 1
                    k = stiffness[w, p]
                    stretched = largest_square(F[0, w, p])
                    if stretched > square:
                        square = stretched
                        widest = p
                    viscosity = ti.max(viscosity, eta * per_mass)
                    # kappa of `step_limits.elastic_kappa`; a muscle that pushes does not lower it
                    active = 2.0 * (k * mu + ti.max(tension[w, p], 0.0)) * stretched
                    robot = ti.max(robot, (active + 3.0 * k * lam) * per_mass)
                elif ti.static(law):
                    medium = ti.max(medium, medium_kappa(history[0, w, p - F.shape[2]], constants, law) * per_mass)
                for q in ti.static(range(4)):
                    # negated, as a NaN fails every comparison; worst is equal to itself unless it is a NaN already
                    if not (values[q] <= worst[q]) and worst[q] == worst[q]:
                        worst[q] = values[q]
                        who[q] = p
        for q in ti.static(range(3)):
            report[w, q] = worst[q]
        for q in ti.static(range(4)):
            culprit[w, q] = who[q]
        culprit[w, 4] = widest
        report[w, 3] = -worst[3]
        report[w, 4] = guarded
        report[w, 5] = ti.sqrt(square)
        report[w, 6] = robot
        report[w, 7] = medium
        report[w, 8] = viscosity
