"""Elastic matter far from rest: pressed, stretched, collapsed and inverted."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.scene import Scene
from zoobench.verify.energies import read_entry
from zoobench.verify.stability import scenes
from zoobench.verify.stability.base import Probe, case
from zoobench.verify.stability.ledger import GROWTH, episode, healthy

if TYPE_CHECKING:
    from zoobench.sim.model.rollout import Rollout
    from zoobench.sim.solver import Solver


_MIDDLE = (0.3125, 0.3125, 0.3125)
_CELLS = (4, 4, 4)


def strained_solver(scene: Scene, fidelity: Fidelity, F: Array, *, gradients: bool = False) -> "Solver":
    """A solver that starts from these deformation gradients of the robot, `[3, 3]` or `[robot, 3, 3]`."""
    from zoobench.sim.solver import Solver

    start = scenes.strained(Solver(scene, fidelity), F)
    return Solver(scene, fidelity, gradients=gradients, start=start)


def _release(probe: Probe, stretches: tuple[float, float, float], cells: tuple[int, int, int], frames: int) -> None:
    """A block is let go from a uniform stretch: it swings back without gaining energy, inverting or drifting off."""
    F = np.diag(stretches)
    positions = scenes.lattice(_MIDDLE, cells)
    centre = positions.mean(0)
    body = scenes.passive(1.25 + (positions - centre) @ F)
    solver = strained_solver(scenes.flight(body, 2.5), scenes.fidelity(64), F)
    rollout, ledger = episode(probe, solver, frames)
    healthy(probe, rollout)
    what = f"J = {np.prod(stretches):.3g}:"
    probe.below(f"{what} energy / initial", ledger.growth, GROWTH)
    probe.above(f"{what} smallest J", float(rollout.smallest_j.min()), 0.05)
    speed = ledger.largest(lambda entry: float(np.linalg.norm(entry.momentum))) / float(solver.parameters.mass.sum())
    probe.below(f"{what} speed of the centre / largest speed", speed / ledger.largest(lambda e: e.speed), 1e-9)


@case("release-from-pressure")
def release_from_pressure(probe: Probe) -> None:
    """A cube of rubber is let go at half its volume."""
    side = 0.5 ** (1 / 3)
    _release(probe, (side, side, side), _CELLS, 60)


@case("release-from-tension")
def release_from_tension(probe: Probe) -> None:
    """A cube of rubber is let go at twice its volume."""
    side = 2.0 ** (1 / 3)
    _release(probe, (side, side, side), _CELLS, 60)


def _gradient_of_path(solver: "Solver", rollout: "Rollout") -> tuple[float, str]:
    """Norm of the gradient of a random linear function of the path, and the solver's fault."""
    rng = np.random.default_rng(7)
    pulls = rng.normal(size=(2, *rollout.positions.shape))
    gradient = solver.backward(rollout, pulls[0], pulls[1])
    parts = (gradient.actuation, gradient.stiffness, gradient.density_ratio, gradient.occupancy, gradient.fibres)
    return float(np.sqrt(sum(np.square(part).sum() for part in parts))), gradient.fault


@case("inverted-particles")
def inverted_particles(probe: Probe) -> None:
    """One particle in twenty is turned inside out: named by the health check, the state stays finite."""
    body = scenes.passive(scenes.lattice(_MIDDLE, _CELLS))
    rng = np.random.default_rng(8)
    F = np.eye(3) + 0.05 * rng.normal(size=(body.particle_count, 3, 3))
    turned = rng.permutation(body.particle_count)[: body.particle_count // 20]
    F[turned, :, 0] *= -1.0
    solver = strained_solver(scenes.flight(body), scenes.fidelity(), F, gradients=True)
    rollout, _ = episode(probe, solver, 10)
    quantities = {divergence.quantity for divergence in rollout.divergences.values()}
    probe.holds(f"recovered, or named ({', '.join(quantities) or 'recovered'})", quantities <= {"det F"})
    if not quantities:
        probe.above("smallest J at the end", read_entry(solver).smallest_j, 0.0)
    probe.holds("path finite", bool(np.isfinite(rollout.positions).all()))
    norm, fault = _gradient_of_path(solver, rollout)
    probe.holds(f"gradient finite ({norm:.3g})", bool(np.isfinite(norm)) and not fault)


@case("collapsed-particles")
def collapsed_particles(probe: Probe) -> None:
    """One particle in twenty is squeezed to nearly a plane, a line or a point: held, counted, finite gradient."""
    body = scenes.passive(scenes.lattice(_MIDDLE, _CELLS))
    body = replace(body, velocities=body.velocities + 0.1)
    pressed = np.random.default_rng(9).permutation(body.particle_count)[: body.particle_count // 20]
    for name, stretches in (("plane", (1.0, 1.0, 1e-3)), ("line", (1.0, 1e-2, 1e-2)), ("point", (1e-2, 1e-2, 1e-2))):
        F = np.tile(np.eye(3), (body.particle_count, 1, 1))
        F[pressed] = np.diag(stretches)
        solver = strained_solver(scenes.flight(body), scenes.fidelity(), F, gradients=True)
        rollout, ledger = episode(probe, solver, 10)
        healthy(probe, rollout)
        probe.above(f"{name}: held particle-frames", float(rollout.guarded.sum()), 1.0)
        probe.below(f"{name}: energy / initial", ledger.growth, GROWTH)
        norm, fault = _gradient_of_path(solver, rollout)
        probe.holds(f"{name}: gradient finite ({norm:.3g})", bool(np.isfinite(norm)) and norm > 0.0 and not fault)
    F[pressed] = 0.0
    solver = strained_solver(scenes.flight(body), scenes.fidelity(), F)
    rollout, _ = episode(probe, solver, 2)
    quantities = [divergence.quantity for divergence in rollout.divergences.values()]
    probe.holds("F = 0 named by the health check", quantities == ["det F"])
    probe.holds("path finite", bool(np.isfinite(rollout.positions).all()))


def gap_count(positions: Array, reach: float) -> int:
    """Number of pieces of a body along x: groups of particles with more than `reach` [m] between them, less one."""
    return int((np.diff(np.sort(positions[:, 0])) > reach).sum())


@case("stretched-bar")
def stretched_bar(probe: Probe) -> None:
    """Bars of rubber are let go at 1.8, 3 and 5 times their length: within two particles per cell none breaks.

    A grid holds a body together as long as its particles are closer than a cell; with two particles per cell and axis
    that is up to twice its length. Beyond, the number of gaps is reported.
    """
    for stretch in (1.8, 3.0, 5.0):
        across = stretch**-0.5
        F = np.diag([stretch, across, across])
        positions = scenes.lattice(_MIDDLE, (8, 3, 3))
        body = scenes.passive(1.25 + (positions - positions.mean(0)) @ F)
        solver = strained_solver(scenes.flight(body, 2.5), scenes.fidelity(64), F)
        rollout, ledger = episode(probe, solver, 40)
        gaps = [gap_count(frame[0], scenes.SPACING) for frame in rollout.positions[1:]]
        if stretch < 2.0:
            healthy(probe, rollout)
            probe.below(f"{stretch:g}: gaps", max(gaps), 0)
            length = float(np.ptp(rollout.positions[-1, 0, :, 0])) / float(np.ptp(positions[:, 0]))
            probe.below(f"{stretch:g}: length at the end / unstrained", length, stretch)
        else:
            probe.remark(f"{stretch:g}: {gaps[0]} gaps at first, {gaps[-1]} at the end")
        probe.holds(f"{stretch:g}: stays finite", bool(np.isfinite(rollout.positions).all()))
        probe.below(f"{stretch:g}: energy / initial", ledger.growth, GROWTH)
        probe.above(f"{stretch:g}: smallest J", float(rollout.smallest_j.min()), 0.05)
