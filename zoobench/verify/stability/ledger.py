"""The account of an episode: energy and momentum from frame to frame, and the drivers that keep it."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from zoobench.arrays import Array
from zoobench.verify.energies import Entry, read_entry
from zoobench.verify.stability.base import Probe

if TYPE_CHECKING:
    from zoobench.sim.model.rollout import Rollout
    from zoobench.sim.solver import BodyState, Solver


GROWTH = 1.01
"""Total energy may exceed its initial value by this factor: symplectic steps let it swing, nothing may add to it."""


@dataclass
class Ledger:
    """Entries from the beginning of an episode on."""

    entries: list[Entry] = field(default_factory=list)

    def largest(self, read: Callable[[Entry], float]) -> float:
        """The largest value of a quantity, NaN if one is."""
        return float(np.max([read(entry) for entry in self.entries]))

    def smallest(self, read: Callable[[Entry], float]) -> float:
        """The smallest value of a quantity, NaN if one is."""
        return float(np.min([read(entry) for entry in self.entries]))

    @property
    def growth(self) -> float:
        """Largest total energy by the first."""
        return self.largest(lambda entry: entry.total) / self.entries[0].total


def episode(
    probe: Probe,
    solver: "Solver",
    actuation: Array | int,
    body: "BodyState | None" = None,
) -> tuple["Rollout", Ledger]:
    """Run frames with the solver's own step control, the first world's account kept at every frame.

    `actuation` is `[frames, worlds, muscles]`, or a number of frames of rest. A divergence is the probe's to judge.
    """
    if isinstance(actuation, int):
        actuation = np.zeros((actuation, solver.worlds, solver.muscle_count))
    ledger = Ledger()
    solver.reset(body)
    ledger.entries.append(read_entry(solver))

    def keep(_: int) -> None:
        ledger.entries.append(read_entry(solver))

    rollout = solver.run(actuation, body, progress=keep)
    probe.note_rollout(solver, rollout)
    probe.smallest_j = min(probe.smallest_j, ledger.smallest(lambda entry: entry.smallest_j))
    return rollout, ledger


def healthy(probe: Probe, rollout: "Rollout") -> None:
    """No world may have diverged."""
    for divergence in rollout.divergences.values():
        probe.holds(str(divergence), False)


def march(probe: Probe, solver: "Solver", count: int, dt: float, every: int) -> Ledger:
    """`count` substeps of `dt` [s] from the solver's present state without any control, the account kept all along."""
    ledger = Ledger([read_entry(solver)])
    probe.note_step(solver, dt)
    for begin in range(0, count, every):
        solver.substeps(min(every, count - begin), dt)
        ledger.entries.append(read_entry(solver))
    probe.smallest_j = min(probe.smallest_j, ledger.smallest(lambda entry: entry.smallest_j))
    return ledger


def flagged(solver: "Solver", dt: float) -> str:
    """What the solver's health check says of the present state after steps of `dt` [s]; empty if it finds nothing."""
    from zoobench.sim.model.diagnostics import diagnose
    from zoobench.sim.step_control import Diagnostics

    for condition in Diagnostics(solver.simulation).survey():
        if (finding := diagnose(condition, dt, solver.fidelity.grid_spacing)) is not None:
            return f"{finding.quantity} {finding.value:.3g}"
    return ""
