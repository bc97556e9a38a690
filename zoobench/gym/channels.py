"""Observation and action spaces of a policy, and their relation to observations and activity of a session."""

import math
from functools import lru_cache
from typing import TYPE_CHECKING, get_args

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from zoobench.arrays import Array
from zoobench.cell.observation import Layout
from zoobench.cell.vector_parts import Action, action_parts
from zoobench.controllers.base import PHASE_COUNT, WAVE_RATE
from zoobench.controllers.sine_basis import SineBasis
from zoobench.errors import UsageError

if TYPE_CHECKING:
    from torch import Tensor

Floats = NDArray[np.float32]

LARGEST = 100.0
"""Bound of an observation [body lengths] or [20 body lengths/s]: far beyond the motion of intact robots."""

_BASIS = SineBasis()


class Channels:
    """Observations and actions of a policy.

    An observation is that of `zoobench.cell.observation.ObservationModel`, task and time left included, followed by the
    phase of the waves, and clipped to its bounds: 1 for the time left and the phase, else `LARGEST`. An action is given
    for every frame, in [-1, 1]:

    * `waves`: the parameters of the sine basis (SoftZoo's paper, G): weights, muscle by muscle and slow waves first,
      then biases. The activity of muscle k is tanh(b_k + sum_j W_kj wave_j(t)) at the start t of the frame;
    * `muscles`: the activity of every muscle.

    Args:
        muscle_count: of the robot.
        layout: of the observations.
        action: the kind of action.

    Raises:
        UsageError: there are no such actions.
    """

    def __init__(self, muscle_count: int, layout: Layout, action: Action) -> None:
        if action not in get_args(Action):
            raise UsageError(f"Actions {action!r} are not offered. Choose one of {', '.join(get_args(Action))}.")
        self._action = action
        self.action_space = spaces.Box(-1.0, 1.0, (action_parts(muscle_count, action)[-1].stop,), np.float32)
        high = _bounds(layout)
        self.observation_space = spaces.Box(-high, high, dtype=np.float32)

    def inputs(self, observations: Array, times: Array) -> Floats:
        """Inputs of the policy `[worlds, count]`, from observations `[worlds, observation_count]` and the waves' times
        `[worlds]` [s]."""
        seen = np.empty((len(observations), *self.observation_space.shape), np.float32)
        seen[:, :-PHASE_COUNT] = observations
        # by `math`, as the controllers' phase: NumPy's sine is rounded by the processor's make
        angles = [WAVE_RATE * time for time in times.tolist()]
        seen[:, -PHASE_COUNT:] = [(math.sin(angle), math.cos(angle)) for angle in angles]
        return np.clip(seen, self.observation_space.low, self.observation_space.high)

    def activity(self, actions: Floats, times: Array) -> Array:
        """Muscle activity `[worlds, muscle_count]` for actions `[worlds, count]`, which are clipped to [-1, 1]."""
        clipped = np.clip(np.asarray(actions, np.float64), -1.0, 1.0)
        if self._action == "muscles":
            return clipped
        # one world at a time, as controllers are computed: no rounding may depend on the other worlds
        worlds = zip(clipped, times.tolist(), strict=True)
        return np.stack([_BASIS.weighted_once(parameters, _waves(time)) for parameters, time in worlds])


@lru_cache(maxsize=1024)  # every world and every episode asks for the same times
def _waves(time: float) -> "Tensor":
    import torch

    return _BASIS.waves(torch.tensor([time], dtype=torch.float64))[None]


def _bounds(layout: Layout) -> Floats:
    """The bound of every number of an observation and of the phase `[count]`."""
    parts = [np.full(count, 1.0 if name == "time_left" else LARGEST) for name, count in layout]
    return np.concatenate([*parts, np.ones(PHASE_COUNT)]).astype(np.float32)
