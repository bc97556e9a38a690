"""The sine basis (SoftZoo's paper, G): an open loop of weighted sine waves."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array
from zoobench.errors import UsageError
from zoobench.registry import Kind, register

if TYPE_CHECKING:
    from torch import Tensor


@register(Kind.CONTROLLER, "sine-basis", tags=("open-loop",))
@dataclass(frozen=True, kw_only=True)
class SineBasis:
    """Sine waves of two frequencies and four phases, weighted for every muscle.

    a_k = tanh(b_k + sum_ij W_kij sin(omega_i t + 2 pi j / phases)) over the control frame that starts at t. The
    parameter vector is W, muscle by muscle and slow waves first, then b.

    * `slow`, `fast`: omega [rad/s]; 20 and 80 in SoftZoo's paper.
    * `phases`: per frequency; 4 in SoftZoo's paper.
    * `scale`: standard deviation of the initial weights; biases start at 0.
    """

    slow: float = 20.0
    fast: float = 80.0
    phases: int = 4
    scale: float = 0.3

    def __post_init__(self) -> None:
        if self.phases < 1 or self.scale <= 0:
            raise UsageError(
                f"A sine basis with {self.phases} phases and initial scale {self.scale:g} is not possible. "
                "Give at least 1 phase and a positive scale."
            )

    @property
    def wave_count(self) -> int:
        """Number of waves of a muscle."""
        return 2 * self.phases

    def parameter_count(self, muscle_count: int) -> int:
        """One weight per wave and one bias for every muscle."""
        return muscle_count * (self.wave_count + 1)

    def initial(self, rng: np.random.Generator, muscle_count: int) -> NDArray[np.float64]:
        """Normal weights, zero biases."""
        weights = rng.normal(0.0, self.scale, muscle_count * self.wave_count)
        return np.concatenate([weights, np.zeros(muscle_count)])

    def actuation(self, parameters: "Tensor", times: "Tensor", muscle_count: int) -> "Tensor":
        """Activity `[frames, worlds, muscle_count]`."""
        return self.weighted(parameters, self.waves(times), muscle_count)

    def waves(self, times: "Tensor") -> "Tensor":
        """The waves `[frames, wave_count]`, slow ones first."""
        import torch

        offsets = times.new_tensor([2.0 * math.pi * phase / self.phases for phase in range(self.phases)])
        omegas = times.new_tensor([self.slow, self.fast])
        angles = times[:, None, None] * omegas[:, None] + offsets
        return torch.sin(angles).reshape(len(times), self.wave_count)

    def weighted(self, parameters: "Tensor", waves: "Tensor", muscle_count: int) -> "Tensor":
        """Activity `[frames, worlds, muscle_count]` by these waves."""
        import torch

        split = muscle_count * self.wave_count
        weights = parameters[:, :split].reshape(-1, muscle_count, self.wave_count)
        return torch.tanh(torch.einsum("fb,wkb->fwk", waves, weights) + parameters[:, split:])

    def weighted_once(self, parameters: Array, waves: "Tensor") -> Array:
        """Activity `[muscle_count]` by these waves in one frame of one world: the same bits, in a quarter of the time.

        Args:
            parameters: `[parameter_count]`.
            waves: `[1, 1, wave_count]`.
        """
        import torch

        muscle_count = len(parameters) // (self.wave_count + 1)
        weights, biases = torch.split(torch.tensor(parameters), [muscle_count * self.wave_count, muscle_count])
        drive = torch.bmm(waves, weights.view(1, muscle_count, self.wave_count).mT)[0, 0]
        activity: Array = torch.tanh(drive + biases).numpy()
        return activity
