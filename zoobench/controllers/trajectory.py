"""The trajectory controller: one parameter for every control frame and muscle."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from zoobench.controllers.sine_basis import SineBasis
from zoobench.errors import UsageError
from zoobench.registry import Kind, register
from zoobench.spec import FRAME_SECONDS

if TYPE_CHECKING:
    from torch import Tensor


@register(Kind.CONTROLLER, "trajectory", tags=("open-loop",))
@dataclass(frozen=True, kw_only=True)
class Trajectory:
    """One parameter for every control frame and muscle: a = tanh(parameter).

    The parameter vector is ordered by frames. The prior is the activity of the sine basis, as for all controllers.

    * `frames`: length of the trajectory, by default a standard episode. A longer episode repeats it; in a shorter one
      the rest is unused.
    """

    frames: int = 200

    def __post_init__(self) -> None:
        if self.frames < 1:
            raise UsageError(f"A trajectory of {self.frames} frames is empty. Give at least 1.")

    def parameter_count(self, muscle_count: int) -> int:
        """Frames times muscles."""
        return self.frames * muscle_count

    def initial(self, rng: np.random.Generator, muscle_count: int) -> NDArray[np.float64]:
        """The activity of a draw of the sine basis."""
        import torch

        waves = SineBasis()
        parameters = torch.as_tensor(waves.initial(rng, muscle_count))[None]
        times = torch.arange(self.frames, dtype=torch.float64) * FRAME_SECONDS
        return torch.atanh(waves.actuation(parameters, times, muscle_count)).numpy().reshape(-1)

    def actuation(self, parameters: "Tensor", times: "Tensor", muscle_count: int) -> "Tensor":
        """Activity `[frames, worlds, muscle_count]`."""
        import torch

        values = parameters.reshape(-1, self.frames, muscle_count)
        # the middle of the frame: its start is a product that may be rounded down
        frame = torch.floor(times / FRAME_SECONDS + 0.5).long() % self.frames
        return torch.tanh(values[:, frame]).transpose(0, 1)
