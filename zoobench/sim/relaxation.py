"""Dynamic relaxation (Barnes 1999): a scene under constant loads comes to rest within a few periods of its waves."""

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array
from zoobench.sim.model.rollout import Feedback, FloatArray
from zoobench.sim.simulation import Simulation


class Relaxation:
    """Stops all matter of a world whenever its kinetic energy has passed a peak."""

    def __init__(self, simulation: Simulation) -> None:
        self._sim = simulation
        self._energy = np.zeros(simulation.worlds)

    def damp(self, *, is_last: bool) -> NDArray[np.bool_]:
        """Stop the worlds whose kinetic energy has fallen since the last call, all of them at the last.

        Returns:
            `[worlds]` which of them were stopped.
        """
        matter, masses = self._sim.matter, self._sim.parameters.mass[:, :, None]
        energy = masses * matter.v[0] ** 2
        energies = np.array([float(energy[world : world + 1].sum()) for world in range(len(energy))])
        stops = np.asarray((energies < self._energy) | is_last)
        self._energy = np.where(stops, 0.0, energies)
        for world in np.flatnonzero(stops).tolist():
            matter.stop(0, world)
        return stops


def delayed(feedback: Feedback, frames: int) -> Feedback:
    """The feedback of an episode that begins after so many frames of rest."""

    def act(frame: int, positions: FloatArray, velocities: FloatArray) -> Array:
        first = feedback(max(frame - frames, 0), positions, velocities)
        return first if frame >= frames else np.zeros_like(first)

    return act
