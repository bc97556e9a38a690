"""Which matter of a bed sleeps through a control frame: matter with nothing moving near it.

A particle of a solid medium is awake if the robot, or a particle of the medium that moves at least as fast as
`Fidelity.sleep`, is within `REACH` cells of it in every direction. All others keep their state through the frame, and
act on the matter awake by it: see `kernels.sleepers`. Matter that was stopped, or has not moved yet, is awake, too:
where its stress is out of balance by an acceleration a it gains the speed a T in a frame T, and stays awake if that is
above the threshold. The balance of matter asleep changes only through matter awake at its side, which the same stress
sets in motion: a push and a wave wake the bed before them.

Neglected are motion slower than the threshold, and waves that go farther than `REACH` cells within a frame: both end at
matter asleep as at a rigid wall, which takes their momentum.

The choice follows from the state at the beginning of the frame alone.
"""

import numpy as np
from numpy.typing import NDArray

from zoobench.sim.simulation import Simulation

REACH = 2
"""Distance from moving matter up to which matter is awake [cells]."""


def choose_sleepers(simulation: Simulation) -> NDArray[np.bool_]:
    """Which of the medium's particles sleep from the present state on `[worlds, sleepers]`."""
    if not simulation.sleepers:
        return np.zeros((simulation.worlds, 0), np.bool_)
    found = simulation.launcher.find_sleepers(simulation.matter, simulation.parameters, REACH)
    asleep: NDArray[np.bool_] = found.numpy()[:, simulation.elastic_count :] > 0
    return asleep
