"""Active energy of the muscles at frame boundaries, of many frames at a time."""

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.rollout import Rollout
from zoobench.sim.model.state import Matter, Parameters

_MOST_BYTES = 1 << 18
"""Memory of the deformations that wait: what a processor's second cache holds."""


class MuscleEnergy:
    """Computes `Rollout.muscle_potential` from the deformations that it is given, together where they are small.

    A few hundred particles take less time than the calls of a dozen functions on them.

    Args:
        strength: of the muscles [Pa].
    """

    def __init__(self, strength: float) -> None:
        self._half = 0.5 * strength
        self._fibre: Array = np.zeros(0)
        self._energy: Array = np.zeros(0)
        self._waiting: list[Array] = []
        self._frames: list[int] = []
        self._rollout: Rollout | None = None

    def set_body(self, parameters: Parameters) -> None:
        """Take fibres and volumes of the particles from here on."""
        count = parameters.robot
        self._fibre = parameters.fibre.double().cpu().numpy()
        self._energy = self._half * parameters.volume[:, :count].double().cpu().numpy()

    def note(self, rollout: Rollout, frame: int, matter: Matter) -> None:
        """Take the present state for that at the beginning of a frame; `finish` is to follow."""
        if rollout is not self._rollout:
            self.finish()
        self._rollout = rollout
        columns = matter.on_host()[0, :, : matter.robot, 5:8, :3].copy()
        self._waiting.append(columns)
        self._frames.append(frame)
        if len(self._frames) * columns.nbytes >= _MOST_BYTES:
            self.finish()

    def finish(self) -> None:
        """Write the potentials of all frames that were noted into their rollout."""
        if self._rollout is not None:
            potential = self._potential(np.stack(self._waiting), self._rollout.body["muscle_membership"])
            self._rollout.muscle_potential[self._frames] = potential
            self._rollout = None
            self._waiting.clear()
            self._frames.clear()

    def _potential(self, columns: Array, membership: Array) -> Array:
        """Active energy per unit of activity `[frames, worlds, muscles]` [J]; see `Rollout.muscle_work`.

        Args:
            columns: of F `[frames, worlds, robot, 3, 3]`, the column before the row.
        """
        # sums and products of our own: the libraries' products are rounded by the processor's make
        x, y, z = (columns[..., j, :] * self._fibre[..., j, None] for j in range(3))
        stretched = (x + y + z) ** 2
        square = stretched[..., 0] + stretched[..., 1] + stretched[..., 2]
        density = self._energy * square
        return np.asarray((membership * density[..., None]).sum(axis=2))
