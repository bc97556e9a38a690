"""Elastic matter far from rest: compressed, stretched, collapsed and inverted."""

from dataclasses import replace

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.rollout import Gradient, Rollout
from zoobench.sim.solver import Solver
from zoobench_verify.energies import energy_balance
from zoobench_verify.stability import stability_scenes as scenes
from zoobench_verify.stability.episode_recorder import EpisodeRecorder, case


def _stretched(positions: Array, F: Array) -> Solver:
    """A body in free flight, stretched about the middle of the arena."""
    body = scenes.passive(1.25 + (positions - positions.mean(0)) @ F)
    return scenes.strained_solver(scenes.flight(body, 2.5), scenes.fidelity(64), F)


@case("release-from-tension", args=(2.0,), summary="A cube of rubber is released at twice its volume.")
@case("release-from-pressure", args=(0.5,), summary="A cube of rubber is released at half its volume.")
def release(record: EpisodeRecorder, volume_ratio: float) -> None:
    """A cube released from a uniform stretch oscillates without gaining energy, inverting or drifting."""
    side = volume_ratio ** (1 / 3)
    solver = _stretched(scenes.cube(), np.diag((side, side, side)))
    rollout, energies = record.episode(solver, 60)
    prefix = f"J = {volume_ratio:g}: "
    record.energy_bounded(energies, prefix)
    record.robot_volume(rollout, 0.05, prefix)
    record.no_drift(solver, energies, prefix)


def _random_gradient(solver: Solver, rollout: Rollout) -> tuple[Gradient, tuple[Array, ...]]:
    """The gradient of a random linear function of the trajectory, and its parts without the muscles' membership."""
    adjoints = np.random.default_rng(7).normal(size=(2, *rollout.positions.shape))
    gradient = solver.backward(rollout, adjoints[0], adjoints[1])
    parts = (gradient.actuation, gradient.stiffness, gradient.density_ratio, gradient.occupancy, gradient.fibres)
    return gradient, parts


@case("inverted-particles")
def inverted_particles(record: EpisodeRecorder) -> None:
    """One particle in twenty is turned inside out: named by the health check, the state stays finite."""
    body = scenes.passive(scenes.cube())
    rng = np.random.default_rng(8)
    F = np.eye(3) + 0.05 * rng.normal(size=(body.particle_count, 3, 3))
    turned = rng.permutation(body.particle_count)[: body.particle_count // 20]
    F[turned, :, 0] *= -1.0
    solver = scenes.strained_solver(scenes.flight(body), scenes.fidelity(), F, gradients=True)
    rollout, _ = record.episode(solver, 10, may_diverge=True)
    quantities = {divergence.quantity for divergence in rollout.divergences.values()}
    record.holds(f"recovered, or named ({', '.join(quantities) or 'recovered'})", quantities <= {"det F"})
    if not quantities:
        record.at_least("smallest J at the end", energy_balance(solver).smallest_j, 0.0)
    record.path_finite(rollout)
    record.gradient_finite(*_random_gradient(solver, rollout), may_vanish=True)


@case("collapsed-particles")
def collapsed_particles(record: EpisodeRecorder) -> None:
    """One particle in twenty is squeezed to nearly a plane, a line or a point: clamped, counted, finite gradient."""
    body = scenes.passive(scenes.cube())
    body = replace(body, velocities=body.velocities + 0.1)
    pressed = np.random.default_rng(9).permutation(body.particle_count)[: body.particle_count // 20]
    for name, stretches in (("plane", (1.0, 1.0, 1e-3)), ("line", (1.0, 1e-2, 1e-2)), ("point", (1e-2, 1e-2, 1e-2))):
        F = np.tile(np.eye(3), (body.particle_count, 1, 1))
        F[pressed] = np.diag(stretches)
        solver = scenes.strained_solver(scenes.flight(body), scenes.fidelity(), F, gradients=True)
        rollout, energies = record.episode(solver, 10)
        record.at_least(f"{name}: held particle-frames", rollout.guarded.sum(), 1.0)
        record.energy_bounded(energies, f"{name}: ")
        record.gradient_finite(*_random_gradient(solver, rollout), f"{name}: ")
    F[pressed] = 0.0
    solver = scenes.strained_solver(scenes.flight(body), scenes.fidelity(), F)
    rollout, _ = record.episode(solver, 2, may_diverge=True)
    quantities = [divergence.quantity for divergence in rollout.divergences.values()]
    record.holds("F = 0 named by the health check", quantities == ["det F"])
    record.path_finite(rollout)


def gap_count(positions: Array, reach: float) -> int:
    """Number of gaps wider than `reach` [m] along x between the particles of a body."""
    return int((np.diff(np.sort(positions[:, 0])) > reach).sum())


@case("stretched-bar")
def stretched_bar(record: EpisodeRecorder) -> None:
    """Bars of rubber are released at 1.8, 3 and 5 times their length: within two particles per cell none breaks.

    A grid holds a body together as long as its particles are closer than a cell; with two particles per cell and axis
    that is up to twice its length. Beyond, the number of gaps is reported.
    """
    for stretch in (1.8, 3.0, 5.0):
        across = stretch**-0.5
        positions = scenes.lattice(scenes.MIDDLE, (8, 3, 3))
        solver = _stretched(positions, np.diag([stretch, across, across]))
        rollout, energies = record.episode(solver, 40, may_diverge=stretch >= 2.0)
        gaps = [gap_count(frame[0], scenes.SPACING) for frame in rollout.positions[1:]]
        if stretch < 2.0:
            record.at_most(f"{stretch:g}: gaps", max(gaps), 0)
            lengths = np.ptp(rollout.positions[:, 0, :, 0], axis=1) / np.ptp(positions[:, 0])
            record.at_most(f"{stretch:g}: length at the end / unstrained", lengths[-1], stretch)
            record.within(f"{stretch:g}: least length / unstrained", lengths.min(), 0.5, 1.0)
        else:
            record.remark(f"{stretch:g}: {gaps[0]} gaps at first, {gaps[-1]} at the end")
        record.path_finite(rollout, f"{stretch:g}: ", "stays finite")
        record.energy_bounded(energies, f"{stretch:g}: ")
        record.robot_volume(rollout, 0.05, f"{stretch:g}: ")
