"""The state of rest of a scene, from which its episodes begin."""

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.state import Matter
from zoobench.sim.solver import Solver

REST_SPEED = 2.5e-7
"""Largest horizontal speed of a robot at rest [m/s], between stops; left alone it then moves by less than 1e-6 m/s."""

MOST_ROUNDS = 20
"""Half equilibrations that follow the first until the robot rests."""


def come_to_rest(solver: Solver, frames: int) -> Matter:
    """Equilibrate the only world and begin its episodes there.

    After `frames` control frames it goes on for half as many at a time, as long as the centre of mass of its robot
    moves by more than `REST_SPEED` along the ground: a body that tips over or sags needs longer than one that stands.
    On a terrain, where a body may slide for ever, and after `MOST_ROUNDS` it is left as it is.

    Returns:
        the state of rest.

    Raises:
        DivergenceError: the scene diverges.
    """
    state = solver.equilibrate(frames)
    is_level = solver.scene.ground is None or solver.scene.ground.terrain is None
    for _ in range(MOST_ROUNDS if is_level else 0):
        solver.start_at(state)
        before = _centre(solver)
        further = solver.equilibrate(frames // 2)
        moved = np.hypot(*(_centre(solver) - before)[[0, 2]])
        if moved < REST_SPEED * (frames // 2) * solver.frame_seconds:
            break
        state = further
    solver.start_at(state)
    return state


def _centre(solver: Solver) -> Array:
    """Centre of mass of the robot `[3]` [m]."""
    masses = solver.parameters.mass[0, : solver.robot_count].double()
    weighed: Array = (masses @ solver.matter.x[0, 0, : solver.robot_count].double() / masses.sum()).cpu().numpy()
    return weighed
