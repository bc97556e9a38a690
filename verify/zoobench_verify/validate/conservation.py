"""Free fall, and the conserved quantities of a spinning body."""

from dataclasses import replace

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.fidelity import Transfer
from zoobench.sim.model.laws.elastic import ElasticMaterial, neo_hookean_energy
from zoobench.sim.model.scene import Scene
from zoobench_verify.cases import CaseRecorder, case
from zoobench_verify.validate.rig import GRAVITY, WEIGHTLESS, Rig, lattice, passive_body

_FALL_SOURCE = "closed form of symplectic Euler"
_SPIN_SOURCE = "Jiang, Schroeder, Teran 2017, An angular momentum conserving APIC method"

_FALL_GRID = 1 / 32
_RUBBER = ElasticMaterial(youngs_modulus=1e6, poissons_ratio=0.3, density=1000.0)


@case("free-fall-single", _FALL_SOURCE, "block of 8³ cells, h = 1/32 m", args=(32,), precision=32)
@case("free-fall", _FALL_SOURCE, "block of 8³ cells, h = 1/32 m", args=(64,))
def free_fall(record: CaseRecorder, precision: int) -> None:
    """A thrown block in flight; symplectic Euler gives y_0 + v t - g dt^2 n (n + 1) / 2 to round-off."""
    start = np.array([0.3, 0.5, -0.2])
    h = _FALL_GRID
    points = lattice((0.3, 0.8, 0.5), (0.3 + 8 * h, 0.8 + 8 * h, 0.5 + 8 * h), h / 2)
    scene = Scene(passive_body(_RUBBER, points, h**3 / 8, start), (0, 0, 0), (1.25, 1.25, 1.25))
    rig = Rig(scene, h, seconds=0.4, precision=precision)
    pieces, piece = 20, rig.steps // 20
    path = [points.mean(0)]
    for _ in range(pieces):
        rig.advance(piece)
        path.append(rig.positions.mean(0))
    n, t = piece * np.arange(pieces + 1), rig.times(pieces, piece)
    exact = points.mean(0) + t[:, None] * start
    exact[:, 1] -= GRAVITY * rig.dt**2 * n * (n + 1) / 2
    fallen = GRAVITY * t[-1] ** 2 / 2
    moved = rig.positions - points
    found = np.array(path)
    momentum = (rig.mass[:, None] * rig.v).sum(0, dtype=float) / rig.mass.sum(dtype=float)
    due = start - np.array([0.0, GRAVITY * t[-1], 0.0])
    bound = {32: 1e-4, 64: 1e-12}[precision]
    record.at_most("centre of mass off the discrete path, per fall", np.abs(found - exact).max() / fallen, bound)
    record.at_most("spread of the particles' displacements, per fall", np.ptp(moved, axis=0).max() / fallen, bound)
    record.at_most("momentum off p_0 + m g t, relative", np.abs(momentum - due).max() / np.abs(due).max(), bound)
    figure = record.plot(f"Free fall in float{precision}", "time [s]", "height of the centre of mass [m]")
    figure.computed("MPM", t, found[:, 1], points=True)
    figure.reference("y0 + v t - g dt² n (n + 1) / 2", t, exact[:, 1])


@case("spinning-disc-single", _SPIN_SOURCE, "radius 6.4 cells, h = 1/32 m", args=(32, "aflip"), precision=32)
@case("spinning-disc", _SPIN_SOURCE, "radius 6.4 cells, h = 1/32 m", args=(64, "aflip"))
@case("spinning-disc-apic", _SPIN_SOURCE, "radius 6.4 cells, h = 1/32 m", args=(64, "apic"))
def spinning_disc(record: CaseRecorder, precision: int, transfer: Transfer) -> None:
    """One revolution of a free elastic disc of 6.4 cells radius.

    All transfers conserve momentum to round-off, APIC the angular momentum, too. The velocity that AFLIP keeps turns
    with the particles to first order in the step, so that it conserves the angular momentum but for 1e-6.

    It starts spinning and unstretched, so that it also oscillates radially; its energy is kinetic (affine motion
    included) and elastic. Round-off in float32 adds 3e-9 of the angular momentum in every substep of any length, so
    the step is long.
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
    rig = Rig(scene, h, 1.0, precision=precision, courant=0.8, transfer=transfer)
    pieces, piece = 40, rig.steps // 40
    budgets, turned, before = [], [], arm[:, :2] @ [1, 1j]
    for _ in range(pieces + 1):
        budgets.append(_budget(rig, centre))
        now = (rig.positions - centre)[:, :2] @ [1, 1j]
        turned.append(float(np.angle(np.vdot(before, now))))
        before = now
        rig.advance(piece)
    momentum, angular, energy = map(np.array, zip(*budgets, strict=True))
    speed = float(rig.mass.sum(dtype=float)) * spin * radius
    drift = np.linalg.norm(momentum - momentum[0], axis=1) / speed
    turn = np.linalg.norm(angular - angular[0], axis=1) / np.linalg.norm(angular[0])
    loss = 1 - energy / energy[0]
    t = rig.times(pieces, piece)
    bound = {32: 1e-5, 64: 1e-12}[precision]
    record.at_most("change of momentum, per m omega R", drift.max(), bound)
    drift_bound = max(bound, 1e-6) if transfer == "aflip" else bound
    record.at_most("change of angular momentum, relative", turn.max(), drift_bound)
    record.within("energy lost in one revolution, relative", loss[-1], 0.0, 1e-3)
    record.within("revolutions of the particles by the spin's", sum(turned) / (spin * t[-1]), 0.99, 1.01)
    figure = record.plot(f"Spinning disc in float{precision}", "time [s]", "share of energy lost [-]")
    figure.computed("MPM", t, loss)
    figure.reference("conserved", t, 0 * t)


def _budget(rig: Rig, centre: Array) -> tuple[Array, Array, float]:
    """Momentum, angular momentum about the centre and energy, including the affine motion.

    A particle's matrix C carries the momentum of a body with the spline's moment per mass along each axis (Jiang et
    al. 2017).
    """
    mass, moment = rig.mass.astype(float), rig.solver.fidelity.moment
    v, C, F = rig.v.astype(float), rig.C.astype(float), rig.F.astype(float)
    axial = np.stack([C[:, 2, 1] - C[:, 1, 2], C[:, 0, 2] - C[:, 2, 0], C[:, 1, 0] - C[:, 0, 1]], axis=1)
    angular = (mass[:, None] * (np.cross(rig.positions - centre, v) + moment * axial)).sum(0)
    kinetic = 0.5 * (mass * ((v**2).sum(1) + moment * (C**2).sum((1, 2)))).sum()
    volume = mass / _RUBBER.density
    mu, lam = _RUBBER.lame
    stored = (volume * neo_hookean_energy(F, mu, lam)).sum()
    return (mass[:, None] * v).sum(0), angular, float(kinetic + stored)
