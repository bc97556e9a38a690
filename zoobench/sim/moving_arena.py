"""An arena that follows the robot, so that level ground and beds of solid matter have no end.

Once the robot's middle is `STEP` from where it began in the arena, the arena moves after it along x or z by whole
cells. The matter of the bed that it leaves behind becomes fresh matter before it: each particle takes the state at time
zero of one at that side of the arena. So memory, cost and the rounding of places stay what they are, however far the
robot goes, and it finds its track again only as far as the arena reaches. Water on a grid that the arena comes to is at
rest.

Fresh matter depends on nothing that was done before, so that its adjoint ends there; a place is moved by a constant.
"""

import numpy as np
import torch
from numpy.typing import NDArray

from zoobench.arrays import Array
from zoobench.sim.kernels.boundary import WALL_NODES
from zoobench.sim.model.rollout import ArenaMove
from zoobench.sim.model.state import Matter
from zoobench.sim.simulation import Simulation

STEP = 1 / 32
"""[m] At least; a whole number of cells. No robot goes farther within a control frame."""


class MovingArena:
    """Moves the arena of each world after its robot.

    Args:
        simulation: of a scene that `follows` its robot.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._sim = simulation
        self._cells = max(1, round(STEP / simulation.fidelity.grid_spacing))
        self._present = self._list_present()
        self._begun = [self._middle(world) for world in range(simulation.worlds)]

    def follow(self, world: int) -> list[ArenaMove]:
        """Move a world's arena to where its robot is now; returns the moves, none if it is near enough."""
        sim, done = self._sim, list[ArenaMove]()
        cells = (self._middle(world) - self._begun[world]) / sim.fidelity.grid_spacing
        for axis in (0, 2):
            # no number is not less than the step, either, and is left to the diagnostics
            if self._cells <= abs(cells[axis]) < np.inf:
                move = self._move(world, axis, int(cells[axis]))
                self.repeat(world, [move])
                done.append(move)
        return done

    def repeat(self, world: int, moves: list[ArenaMove]) -> None:
        """Move a world's arena as it was moved before."""
        sim = self._sim
        for move in moves:
            carry_out(sim, sim.matter, 0, world, move)
            sim.offsets[world, move.axis] += move.cells * sim.fidelity.grid_spacing

    def _middle(self, world: int) -> Array:
        """Middle of the box around the robot's present particles, from the grid's first node [m] `[3]`."""
        rows = self._sim.matter.memory[0, world, : self._sim.robot_count, 0]
        rows = rows if isinstance(rows, np.ndarray) else rows.cpu().numpy()
        places = rows.T.take(self._present[world], axis=1)  # extremes along rows are found six times as fast
        middle: Array = 0.5 * (places.min(axis=1)[:3].astype(np.float64) + places.max(axis=1)[:3])
        return middle

    def _list_present(self) -> list[NDArray[np.intp]]:
        """Those particles of each world's robot that have half of their place; all of one where none has."""
        sim = self._sim
        found = sim.parameters.volume[:, : sim.robot_count] > 0.5 * sim.tensor(sim.scene.robot.volumes)
        present = found | ~found.any(dim=1, keepdim=True)
        return [np.flatnonzero(each) for each in present.cpu().numpy()]

    def _move(self, world: int, axis: int, cells: int) -> ArenaMove:
        """A move by so many cells, and what of the bed is left behind and renewed."""
        sim, h, first = self._sim, self._sim.fidelity.grid_spacing, self._sim.elastic_count
        fresh, present = (
            state.state[0, world, first:, 0, axis].cpu().double().numpy() for state in (sim.start, sim.matter)
        )
        ahead = np.sign(cells)
        end = (sim.launcher.shape[axis] - 1 - WALL_NODES if ahead > 0 else WALL_NODES) * h
        sources = np.flatnonzero(ahead * (end - fresh) < abs(cells) * h)
        behind = np.argsort(ahead * present, kind="stable")[: len(sources)]
        return ArenaMove(axis, cells, first + behind, first + sources)


def carry_out(simulation: Simulation, matter: Matter, slot: int, world: int, move: ArenaMove) -> None:
    """Do to a world's state at a slot what the move of its arena does."""
    state = matter.state[slot, world]
    state[:, 0, move.axis] -= move.cells * simulation.fidelity.grid_spacing
    renewed, sources = torch.from_numpy(move.renewed), torch.from_numpy(move.sources)
    state[renewed] = simulation.start.state[0, world, sources]
    simulation.refresh_window(matter, slot, world)
    if simulation.scene.water:
        flow = _of_cells(simulation, matter.flow[slot, world])
        _shift(flow, move.axis, move.cells)
        if move.cells > 0:
            flow.select(move.axis, 0)[..., move.axis] = 0.0  # the faces of the wall behind


def end_adjoint(simulation: Simulation, adjoint: Matter, world: int, move: ArenaMove) -> None:
    """Take the adjoint of a world's state back through the move of its arena."""
    adjoint.state[0, world, torch.from_numpy(move.renewed)] = 0.0
    if simulation.scene.water:
        flow = _of_cells(simulation, adjoint.flow[0, world])
        if move.cells > 0:
            flow.select(move.axis, 0)[..., move.axis] = 0.0
        _shift(flow, move.axis, -move.cells)


def _of_cells(simulation: Simulation, flow: torch.Tensor) -> torch.Tensor:
    """A view of the water's state by cells `[nx, ny, nz, 4]`."""
    return flow.view(*simulation.scene.cells(simulation.fidelity.grid_spacing), 4)


def _shift(flow: torch.Tensor, axis: int, cells: int) -> None:
    """Move water by so many cells against an axis, in place; water that comes in is at rest."""
    kept = max(flow.shape[axis] - abs(cells), 0)
    first = max(cells, 0)
    moved = flow.narrow(axis, min(first, flow.shape[axis] - kept), kept).clone()
    flow.zero_()
    flow.narrow(axis, max(-cells, 0) if kept else 0, kept).copy_(moved)
