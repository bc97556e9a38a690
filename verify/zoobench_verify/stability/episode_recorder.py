"""The recorder of the stability cases: runs episodes and substeps, and keeps energies and the solver's own figures."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.diagnostics import diagnose
from zoobench.sim.model.rollout import Gradient, Rollout
from zoobench.sim.solver import Solver
from zoobench.sim.step_control import Diagnostics
from zoobench_verify import cases
from zoobench_verify.energies import EnergyBalance, energy_balance, nodal_power

GROWTH = 1.01
"""Bound on the total energy over its initial value: nothing may add to it."""

EXCHANGED = 0.1
"""Least share of the energy of moving matter that changes its form."""


@dataclass
class EnergyHistory:
    """Energy balances of a world from the beginning of an episode on."""

    balances: list[EnergyBalance] = field(default_factory=list)

    def largest(self, read: Callable[[EnergyBalance], float]) -> float:
        """The largest value of a quantity, NaN if one is."""
        return float(np.max([read(balance) for balance in self.balances]))

    def smallest(self, read: Callable[[EnergyBalance], float]) -> float:
        """The smallest value of a quantity, NaN if one is."""
        return float(np.min([read(balance) for balance in self.balances]))

    @property
    def growth(self) -> float:
        """Largest total energy over the first."""
        return self.largest(lambda balance: balance.total) / self.balances[0].total

    @property
    def exchanged(self) -> float:
        """Largest change of the kinetic, elastic or potential energy over the first total."""
        parts = np.array([(each.kinetic, each.elastic, each.potential) for each in self.balances])
        return float(np.ptp(parts, axis=0).max()) / self.balances[0].total

    @property
    def momentum(self) -> float:
        """Largest norm of the momentum [kg m/s]."""
        return self.largest(lambda balance: float(np.linalg.norm(balance.momentum)))

    @property
    def smallest_j(self) -> float:
        """Smallest volume ratio."""
        return self.smallest(lambda balance: balance.smallest_j)

    @property
    def lowest(self) -> float:
        """Smallest height of any particle [m]."""
        return self.smallest(lambda balance: balance.lowest[1])


@dataclass
class EpisodeRecorder(cases.CaseRecorder):
    """Records the checks of a case, and the solver's own figures summed over all its runs.

    Attributes:
        smallest_j: smallest volume ratio.
        step: smallest step taken [s]; infinite before the first.
        fraction: that step over the largest stable one that the solver declared.
        retries: frames that were repeated with half the step.
        frames: world-frames simulated.
        guarded, particle_frames: robot particles with a clamped log J at the end of a frame, and all of them.
    """

    smallest_j: float = math.inf
    step: float = math.inf
    fraction: float = math.nan
    retries: int = 0
    frames: int = 0
    guarded: int = 0
    particle_frames: int = 0

    def columns(self) -> dict[str, Any]:
        """The solver's figures; None where nothing was simulated."""
        stepped = math.isfinite(self.step)
        return {
            "smallest_j": self.smallest_j if math.isfinite(self.smallest_j) else None,
            "step": self.step if stepped else None,
            "step_fraction": self.fraction if stepped else None,
            "retries": self.retries,
            "guarded_share": self.guarded / max(self.particle_frames, 1),
            "repeated_share": self.retries / max(self.frames + self.retries, 1),
        }

    def episode(
        self, solver: Solver, actuation: Array | int, *, may_diverge: bool = False
    ) -> tuple[Rollout, EnergyHistory]:
        """Run frames under the solver's step control, with the first world's energy balance at every frame.

        Args:
            actuation: `[frames, worlds, muscles]`, or a number of frames of rest.
            may_diverge: otherwise a divergence is a failed check.
        """
        if isinstance(actuation, int):
            actuation = np.zeros((actuation, solver.worlds, solver.muscle_count))
        noted: list[tuple[EnergyBalance, float]] = []

        def note(_: int) -> None:
            is_alive = bool(solver.simulation.is_alive()[0])
            noted.append((energy_balance(solver), nodal_power(solver) if is_alive else 0.0))

        rollout = solver.run(actuation, progress=note)
        # a frame's steps are known once it is done, those of the first serve the beginning, too
        counts = rollout.counts[(rollout.counts > 0).all(axis=1), 0]
        steps = solver.frame_seconds / np.array([counts[0], *counts]) if len(counts) else np.zeros(1)
        energies = EnergyHistory([
            replace(balance, kinetic=balance.kinetic + 0.5 * float(step) * power)
            for (balance, power), step in zip(noted, steps, strict=False)
        ])  # fmt: skip
        self.add_rollout(solver, rollout, may_diverge=may_diverge)
        self.smallest_j = min(self.smallest_j, energies.smallest_j)
        return rollout, energies

    def march(self, solver: Solver, count: int, dt: float, every: int) -> EnergyHistory:
        """Take `count` substeps of `dt` [s] without step control, with an energy balance `every` few."""
        energies = EnergyHistory([energy_balance(solver, step=dt)])
        self.add_step(solver, dt)
        for begin in range(0, count, every):
            solver.substeps(min(every, count - begin), dt)
            energies.balances.append(energy_balance(solver, step=dt))
        self.smallest_j = min(self.smallest_j, energies.smallest_j)
        return energies

    def add_step(self, solver: Solver, dt: float) -> None:
        """Record a step [s] that was taken."""
        if dt < self.step:
            self.step, self.fraction = dt, dt / solver.limit.dt_iso

    def add_rollout(self, solver: Solver, rollout: Rollout, *, may_diverge: bool = False) -> None:
        """Record the solver's figures of an episode and, unless it may diverge, its divergences as failed checks."""
        self.add_step(solver, solver.frame_seconds / max(int(rollout.counts.max()), 1))
        self.smallest_j = min(self.smallest_j, float(rollout.smallest_j.min()))
        self.retries += int(rollout.retries.sum())
        self.guarded += int(rollout.guarded.sum())
        frames = int((rollout.counts > 0).sum())
        self.frames += frames
        self.particle_frames += frames * solver.robot_count
        for divergence in () if may_diverge else rollout.divergences.values():
            self.holds(str(divergence), False)

    def energy_bounded(self, energies: EnergyHistory, prefix: str = "", bound: float = GROWTH) -> None:
        """Check that the total energy does not grow, though its form changes."""
        self.at_most(f"{prefix}energy / initial", energies.growth, bound)
        self.moves(energies, prefix)

    def moves(self, energies: EnergyHistory, prefix: str = "") -> None:
        """Check that something happened: matter that never moves meets all bounds of a stable one."""
        self.at_least(f"{prefix}energy that changes its form / initial", energies.exchanged, EXCHANGED)

    def robot_volume(self, rollout: Rollout, bound: float, prefix: str = "") -> None:
        """Check the smallest volume ratio of the robot during an episode."""
        self.at_least(f"{prefix}smallest J", rollout.smallest_j.min(), bound)

    def stays_above(self, energies: EnergyHistory, spacing: float) -> None:
        """Check that no matter penetrates the ground by more than a cell."""
        self.at_least("lowest [cells]", energies.lowest / spacing, -1.0)

    def no_drift(self, solver: Solver, energies: EnergyHistory, prefix: str = "") -> None:
        """Check that the centre of a free body stays in place."""
        speed = energies.momentum / float(solver.parameters.mass.sum())
        largest = energies.largest(lambda balance: balance.speed)
        self.at_most(f"{prefix}speed of the centre / largest speed", speed / largest, 1e-9)

    def path_finite(self, rollout: Rollout, prefix: str = "", words: str = "path finite") -> None:
        """Check that all positions of an episode are finite."""
        self.holds(f"{prefix}{words}", bool(np.isfinite(rollout.positions).all()))

    def gradient_finite(
        self, gradient: Gradient, parts: Sequence[Array], prefix: str = "", *, may_vanish: bool = False
    ) -> None:
        """Check that the norm of these parts of a gradient is finite and, unless it may vanish, positive."""
        norm = float(np.sqrt(sum(np.square(part).sum() for part in parts)))
        sound = bool(np.isfinite(norm)) and (may_vanish or norm > 0.0) and not gradient.fault
        self.holds(f"{prefix}gradient finite ({norm:.3g})", sound)


case = partial(cases.case, recorder=EpisodeRecorder)
"""Decorator of a stability case."""


def flagged(solver: Solver, dt: float) -> str:
    """The finding of the solver's health check for the present state after steps of `dt` [s]; empty if none."""
    for condition in Diagnostics(solver.simulation).survey():
        if (finding := diagnose(condition, dt, solver.fidelity.grid_spacing)) is not None:
            return f"{finding.quantity} {finding.value:.3g}"
    return ""
