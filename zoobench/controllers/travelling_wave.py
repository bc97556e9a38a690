"""The travelling wave: a wave of bending that runs along the body, as swimmers drive their muscles."""

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from zoobench.controllers.base import MusclePlaces
from zoobench.errors import UsageError
from zoobench.registry import Kind, register

if TYPE_CHECKING:
    from torch import Tensor

_RANGE = 4.0
"""Factor by which the frequency can differ from its reference, so that no wave is faster than control frames show."""


@register(Kind.CONTROLLER, "travelling-wave", tags=("open-loop",), added=("steering",))
@dataclass(frozen=True, kw_only=True)
class TravellingWave:
    """A wave of bending from head to tail with four parameters: frequency, waves along the body, strength, growth.

    A muscle whose centre lies a share b of the body's length behind its foremost point, and which bends the body to
    the side s, has the activity a = s tanh(p2 exp(p3 (b - 1/2))) sin(2 pi (f t - n b)), with the frequency
    f = `frequency` 4^tanh(p0) and the number of waves along the body n = 1 / `wavelength` + p1. Below 0 it runs from
    tail to head. Antagonists act in opposition; s is 0 for a muscle that does not bend the body, which rests. The plane
    of bending, sideways or up and down, is that in which the muscles have the larger moments.

    With `steering` two more parameters bend the foremost half of the body steadily: a muscle there that bends it to the
    right by r and up by u has the activity b = tanh(p4 r + p5 u), and 1 - |b| is left for the wave. A swimmer turns to
    the right where p4 is positive and rises where p5 is, if it has the muscles for it.

    * `frequency`: where p0 = 0 [Hz].
    * `wavelength`: where p1 = 0, by the body's length [-].
    * `scale`: standard deviation of the parameters' prior, whose mean is 0, but 1 for p2.
    * `steering`: whether there are p4 and p5 [-].
    """

    frequency: float = 4.0
    wavelength: float = 1.0
    scale: float = 0.3
    steering: bool = False
    _places: MusclePlaces | None = field(default=None, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if self.frequency <= 0.0 or self.wavelength == 0.0 or self.scale <= 0.0:
            raise UsageError(
                f"A wave of {self.frequency:g} Hz, {self.wavelength:g} lengths of the body, with an initial scale of "
                f"{self.scale:g} is not possible. Give a positive frequency and scale, and a wavelength other than 0."
            )

    def placed(self, places: MusclePlaces) -> "TravellingWave":
        """The wave along a body with its muscles there; without, they are in a row, all on the right."""
        found = replace(self)
        object.__setattr__(found, "_places", places)
        return found

    def parameter_count(self, muscle_count: int) -> int:
        """Four, for any body, or six with steering."""
        return 4 + 2 * self.steering

    def initial(self, rng: np.random.Generator, muscle_count: int) -> NDArray[np.float64]:
        """Normal parameters about a wave of moderate strength at the reference frequency and wavelength."""
        return rng.normal((0.0, 0.0, 1.0, 0.0, 0.0, 0.0)[: 4 + 2 * self.steering], self.scale)

    def actuation(self, parameters: "Tensor", times: "Tensor", muscle_count: int) -> "Tensor":
        """Activity `[frames, worlds, muscle_count]`."""
        import torch

        row = (np.arange(muscle_count) + 0.5) / muscle_count
        ones = np.ones(muscle_count)
        places = self._places or MusclePlaces(row, ones, right=ones, up=0.0 * ones)
        back, side = parameters.new_tensor(places.back), parameters.new_tensor(places.side)
        rate, waves, strength, growth, *steered = parameters[:, :, None].unbind(dim=1)  # [worlds, 1]
        frequency = self.frequency * torch.exp(math.log(_RANGE) * torch.tanh(rate))
        envelope = side * torch.tanh(strength * torch.exp(growth * (back - 0.5)))  # [worlds, muscles]
        cycles = frequency * times[:, None, None] - (1.0 / self.wavelength + waves) * back
        wave = envelope * torch.sin(2.0 * math.pi * cycles)
        if not steered:
            return wave
        right, up = parameters.new_tensor(places.right), parameters.new_tensor(places.up)
        bend = torch.tanh(steered[0] * right + steered[1] * up) * (back < 0.5)
        return bend + (1.0 - bend.abs()) * wave
