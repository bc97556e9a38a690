"""The direct trajectory: one number for every control frame and muscle."""

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
    """A value of its own for every control frame and muscle, with no wave to begin with: a = tanh(parameter).

    The parameter vector is frame by frame. It starts as a draw of the sine basis, so that all controllers start alike.

    * `frames`: how many there are; an episode that is longer begins again, and of one that is shorter the rest does
      not matter. The default is a whole standard episode.
    """

    frames: int = 200

    def __post_init__(self) -> None:
        if self.frames < 1:
            raise UsageError(f"A trajectory of {self.frames} frames moves nothing. Give at least 1.")

    def parameter_count(self, muscle_count: int) -> int:
        """One for every frame and muscle."""
        return self.frames * muscle_count

    def initial(self, rng: np.random.Generator, muscle_count: int) -> NDArray[np.float64]:
        """The activity of a sine basis drawn from its own prior."""
        import torch

        waves = SineBasis()
        parameters = torch.as_tensor(waves.initial(rng, muscle_count))[None]
        times = torch.arange(self.frames, dtype=torch.float64) * FRAME_SECONDS
        drawn: NDArray[np.float64] = torch.atanh(waves.actuation(parameters, times, muscle_count)).numpy().reshape(-1)
        return drawn

    def actuation(self, parameters: "Tensor", times: "Tensor", muscle_count: int) -> "Tensor":
        """Activity `[frames, worlds, muscle_count]`."""
        import torch

        values = parameters.reshape(-1, self.frames, muscle_count)
        # the middle of the frame: its start is a product that may have been rounded down
        frame = torch.floor(times / FRAME_SECONDS + 0.5).long() % self.frames
        return torch.tanh(values[:, frame]).transpose(0, 1)
