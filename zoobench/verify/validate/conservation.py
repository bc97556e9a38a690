"""Motion without forces from outside: free fall, and what a spinning body must keep."""

from dataclasses import replace
from functools import partial

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.matter import ElasticMaterial
from zoobench.sim.model.scene import Scene
from zoobench.verify.validate.base import Case, Check, Figure, Outcome, Role, curve
from zoobench.verify.validate.stage import GRAVITY, WEIGHTLESS, Stage, lattice, passive_body

_FALL_GRID = 1 / 32
_TOLERANCE = {32: 1e-4, 64: 1e-12}
_RUBBER = ElasticMaterial(youngs_modulus=1e6, poissons_ratio=0.3, density=1000.0)


def _free_fall(precision: int) -> Outcome:
    """A thrown block in flight; symplectic Euler has the path y_0 + v t - g dt^2 n (n + 1) / 2 to round-off."""
    start = np.array([0.3, 0.5, -0.2])
    h = _FALL_GRID
    points = lattice((0.3, 0.8, 0.5), (0.3 + 8 * h, 0.8 + 8 * h, 0.5 + 8 * h), h / 2)
    scene = Scene(passive_body(_RUBBER, points, h**3 / 8, start), (0, 0, 0), (1.25, 1.25, 1.25))
    stage = Stage(scene, h, seconds=0.4, precision=precision)
    pieces, piece = 20, stage.steps // 20
    path = [points.mean(0)]
    for _ in range(pieces):
        stage.advance(piece)
        path.append(stage.positions.mean(0))
    n, t = piece * np.arange(pieces + 1), stage.times(pieces, piece)
    exact = points.mean(0) + t[:, None] * start
    exact[:, 1] -= GRAVITY * stage.dt**2 * n * (n + 1) / 2
    fallen = GRAVITY * t[-1] ** 2 / 2
    moved = stage.positions - points
    found = np.array(path)
    momentum = (stage.mass[:, None] * stage.v).sum(0, dtype=float) / stage.mass.sum(dtype=float)
    due = start - np.array([0.0, GRAVITY * t[-1], 0.0])
    height = "height of the centre of mass [m]"
    return Outcome(
        (
            _small("centre of mass off the discrete path, per fall", np.abs(found - exact).max() / fallen, precision),
            _small("spread of the particles' displacements, per fall", np.ptp(moved, axis=0).max() / fallen, precision),
            _small("momentum off p_0 + m g t, relative", np.abs(momentum - due).max() / np.abs(due).max(), precision),
        ),
        Figure(
            f"Free fall in float{precision}", "time [s]", height,
            (curve("MPM", Role.COMPUTED, t, found[:, 1], points=True),
             curve("y0 + v t - g dt² n (n + 1) / 2", Role.REFERENCE, t, exact[:, 1])),
        ),
    )  # fmt: skip


def _small(measure: str, value: float, precision: int) -> Check:
    return Check(measure, float(value), at_most=_TOLERANCE[precision])


def _spinning_disc(precision: int) -> Outcome:
    """One revolution of a free elastic disc of 6.4 cells radius; APIC keeps the angular momentum to round-off.

    It starts spinning and unstretched, so that it also breathes; its energy is kinetic (the affine motion of a particle
    included) and elastic. Round-off in float32 adds 3e-9 of the angular momentum in every substep, whatever its length:
    the step is a long one.
    """
    h, radius, spin = 1 / 32, 0.2, 2 * np.pi
    centre = np.array([0.4, 0.4, 2 * h])
    points = lattice((0.4 - 8 * h, 0.4 - 8 * h, h), (0.4 + 8 * h, 0.4 + 8 * h, 3 * h), h / 2)
    arm = points - centre
    points, arm = points[np.hypot(arm[:, 0], arm[:, 1]) <= radius], arm[np.hypot(arm[:, 0], arm[:, 1]) <= radius]
    rate = np.array([[0.0, -spin, 0.0], [spin, 0.0, 0.0], [0.0, 0.0, 0.0]])
    body = replace(
        passive_body(_RUBBER, points, h**3 / 8),
        velocities=arm @ rate.T,
        velocity_gradients=np.tile(rate, (len(points), 1, 1)),
    )
    scene = Scene(body, (0, 0, 0), (0.8, 0.8, 4 * h), gravity=WEIGHTLESS)
    stage = Stage(scene, h, 1.0, precision=precision, courant=0.8)
    momentum, angular, energy = [], [], []
    pieces, piece = 40, stage.steps // 40
    for _ in range(pieces + 1):
        p, q, e = _budget(stage, centre)
        momentum.append(p)
        angular.append(q)
        energy.append(e)
        stage.advance(piece)
    speed = float(stage.mass.sum(dtype=float)) * spin * radius
    drift = np.linalg.norm(np.array(momentum) - momentum[0], axis=1) / speed
    turn = np.linalg.norm(np.array(angular) - angular[0], axis=1) / np.linalg.norm(angular[0])
    loss = 1 - np.array(energy) / energy[0]
    t = stage.times(pieces, piece)
    bound = {32: 1e-5, 64: 1e-12}[precision]
    return Outcome(
        (
            Check("change of momentum, per m omega R", float(drift.max()), at_most=bound),
            Check("change of angular momentum, relative", float(turn.max()), at_most=bound),
            Check("energy lost in one revolution, relative", float(loss[-1]), at_least=0.0, at_most=1e-3),
        ),
        Figure(
            f"Spinning disc in float{precision}", "time [s]", "share of energy lost [-]",
            (curve("MPM", Role.COMPUTED, t, loss), curve("conserved", Role.REFERENCE, t, 0 * t)),
        ),
    )  # fmt: skip


def _budget(stage: Stage, centre: Array) -> tuple[Array, Array, float]:
    """Momentum, angular momentum about the centre and energy, each with the share of the affine motion.

    A particle's matrix C carries the momentum of a body with the spline's moment per mass along each axis (Jiang et
    al. 2017).
    """
    from zoobench.sim.model.laws_numpy import neo_hookean_energy
    from zoobench.sim.model.matter import lame_parameters

    mass, moment = stage.mass.astype(float), stage.solver.fidelity.moment
    v, C, F = stage.v.astype(float), stage.C.astype(float), stage.F.astype(float)
    axial = np.stack([C[:, 2, 1] - C[:, 1, 2], C[:, 0, 2] - C[:, 2, 0], C[:, 1, 0] - C[:, 0, 1]], axis=1)
    angular = (mass[:, None] * (np.cross(stage.positions - centre, v) + moment * axial)).sum(0)
    kinetic = 0.5 * (mass * ((v**2).sum(1) + moment * (C**2).sum((1, 2)))).sum()
    volume = mass / _RUBBER.density
    mu, lam = lame_parameters(_RUBBER.youngs_modulus, _RUBBER.poissons_ratio)
    stored = (volume * neo_hookean_energy(F, mu, lam)).sum()
    return (mass[:, None] * v).sum(0), angular, float(kinetic + stored)


_FALL_SOURCE = "closed form of symplectic Euler"
_SPIN_SOURCE = "Jiang, Schroeder, Teran 2017, An angular momentum conserving APIC method"

CASES = [
    *(
        Case(name, _FALL_SOURCE, "block of 8³ cells, h = 1/32 m", partial(_free_fall, bits), precision=bits)
        for name, bits in (("free-fall", 64), ("free-fall-single", 32))
    ),
    *(
        Case(name, _SPIN_SOURCE, "radius 6.4 cells, h = 1/32 m", partial(_spinning_disc, bits), precision=bits)
        for name, bits in (("spinning-disc", 64), ("spinning-disc-single", 32))
    ),
]
