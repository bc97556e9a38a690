"""Detection of a simulation that has left the range in which its numbers mean anything, once per control frame."""

import math
from typing import TYPE_CHECKING

import torch

from zoobench.errors import Divergence
from zoobench.sim.stepping import LARGEST_COURANT

if TYPE_CHECKING:
    from zoobench.sim.rollout import Rollout
    from zoobench.sim.solver import Solver

LARGEST_ESCAPE = 1.0
"""Cells that a particle may lie beyond a wall plane: the wall is first order, matter sinks in by part of a cell."""

_ADVICE = {
    "finite state": "Lower the actuation or the stiffness, or use a smaller Courant fraction.",
    "det F": "An element is inverted: lower the actuation or the muscle strength, or use a finer fidelity.",
    "Courant number": "Matter moves too fast for the step: use a smaller Courant fraction.",
    "velocity gradient times dt": "Matter shears too fast for the step: use a smaller Courant fraction.",
    "distance beyond the arena in cells": "Widen the arena or shorten the episode.",
}


class Doctor:
    """Looks at every world after each frame and takes out those that diverged."""

    def __init__(self, solver: "Solver") -> None:
        self._solver = solver
        real, worlds = solver.matter.x.dtype, solver.worlds
        self._report = torch.zeros((worlds, 5), dtype=real, device=solver.matter.x.device)
        self._culprit = torch.zeros((worlds, 4), dtype=torch.int32, device=solver.matter.x.device)

    def examine(self, rollout: "Rollout", frame: int) -> None:
        """Survey all worlds alive; a diverged one is recorded and simulated no further."""
        solver = self._solver
        solver.launcher.survey(solver.matter, solver.parameters, solver.alive, self._report, self._culprit)
        for world, row in enumerate(self._report.tolist()):
            if int(solver.alive[world]):
                rollout.guarded[world] += int(row[4])
                if (found := self._judge(world, row, frame)) is not None:
                    self._take_out(rollout, frame, found)

    def _judge(self, world: int, row: list[float], frame: int) -> Divergence | None:
        speed, shear, beyond, smallest_j, _ = row
        checks = (
            ("distance beyond the arena in cells", beyond, LARGEST_ESCAPE, 2),
            ("Courant number", speed, LARGEST_COURANT, 0),
            ("velocity gradient times dt", shear, 2 * LARGEST_COURANT, 1),
        )
        for _, value, limit, column in checks:
            if not math.isfinite(value):
                return self._divergence(world, frame, "finite state", value, limit, column)
        if not smallest_j > 0.0:
            return self._divergence(world, frame, "det F", smallest_j, 0.0, 3)
        for quantity, value, limit, column in checks:
            if value > limit:
                return self._divergence(world, frame, quantity, value, limit, column)
        return None

    def _divergence(self, world: int, frame: int, quantity: str, value: float, limit: float, column: int) -> Divergence:
        solver = self._solver
        particle = int(self._culprit[world, column])
        x, y, z = (solver.matter.x[0, world, particle].cpu().double().numpy() + solver.origin).tolist()
        step = (frame + 1) * solver.substeps_per_frame
        return Divergence(world, frame, step, quantity, value, limit, particle, (x, y, z), _ADVICE[quantity])

    def _take_out(self, rollout: "Rollout", frame: int, found: Divergence) -> None:
        solver, world = self._solver, found.world
        rollout.divergences[world] = found
        solver.alive[world] = 0
        # the last healthy state stands in, so that no later reader meets a NaN
        count = solver.robot_count
        healthy = torch.as_tensor(rollout.positions[frame, world] - solver.origin)
        solver.matter.x[0, world, :count] = healthy.to(solver.matter.x)
        solver.matter.v[0, world, :count] = torch.as_tensor(rollout.velocities[frame, world]).to(solver.matter.v)
