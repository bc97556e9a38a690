"""What a task is: a number to make large, computed from how the robot's particles moved.

Everything here is written in torch and differentiable, so that score, reward and objective cannot disagree.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Protocol

if TYPE_CHECKING:
    from torch import Tensor

UP = (0.0, 1.0, 0.0)


@dataclass(frozen=True)
class Metric:
    """A measured number with its unit."""

    value: float
    unit: str


@dataclass(frozen=True)
class Motion:
    """How the robot moved in every world; the first frame is the state before any control.

    Attributes:
        positions: `[frames + 1, worlds, particle_count, 3]` [m].
        velocities: the same shape [m/s].
        masses: `[worlds, particle_count]` [kg]; 0 marks a particle that does not exist.
        frame_seconds: length of a control frame [s].
        rest: positions in the design's own frame, x ahead and y up, `[particle_count, 3]` [m].
        head, tail: 1 where a particle is labelled so, else 0 `[particle_count]`.
        muscle_work: work that every muscle did on the body in every frame `[frames, worlds, muscle_count]` [J];
            negative where the body stretched it. It carries no gradient.
        presence: how much of every particle exists, in [0, 1] `[worlds, particle_count]`; None for all of what has
            mass.
        numbers: of the control frames that the states are at the end of, `[frames + 1]`, if not 0, 1, 2 and so on: a
            motion may be told in part, from the start.
    """

    positions: "Tensor"
    velocities: "Tensor"
    masses: "Tensor"
    frame_seconds: float
    rest: "Tensor"
    head: "Tensor"
    tail: "Tensor"
    muscle_work: "Tensor"
    presence: "Tensor | None" = None
    numbers: "Tensor | None" = None

    @property
    def existing(self) -> "Tensor":
        """How much of a particle counts: all of one with mass, none of one without, a share between them.

        `[worlds, particle_count]`.
        """
        return (self.masses > 0).to(self.positions.dtype) if self.presence is None else self.presence

    def clock(self) -> "Tensor":
        """Simulated time of every state `[frames + 1]` [s], each the product of two exact numbers: it never drifts."""
        import torch

        counted = torch.arange(len(self.positions)) if self.numbers is None else self.numbers
        return counted.to(self.positions.dtype) * self.frame_seconds

    def mean_over_existing(self, values: "Tensor") -> "Tensor":
        """Average over the existing particles, the third axis of `values`, each by how much of it exists."""
        existing = self.existing.reshape(1, *self.existing.shape, *(1,) * (values.dim() - 3))
        return (values * existing).sum(dim=2) / existing.sum(dim=2)

    def centre_of_mass(self) -> "Tensor":
        """`[frames + 1, worlds, 3]` [m]."""
        weights = self.masses / self.masses.sum(dim=1, keepdim=True)
        return (self.positions * weights[None, :, :, None]).sum(dim=2)

    def second_moments(self) -> "Tensor":
        """Of the mass about its centre, by the mass: the gyration tensor `[frames + 1, worlds, 6]` [m^2].

        In the order xx, yy, zz, yz, xz, xy.
        """
        import torch

        weights = (self.masses / self.masses.sum(dim=1, keepdim=True))[None]
        offset = self.positions - self.centre_of_mass()[:, :, None]
        pairs = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
        return torch.stack([(weights * offset[..., i] * offset[..., j]).sum(dim=2) for i, j in pairs], dim=-1)


class Task(Protocol):
    """What to do. All functions are torch, run over all worlds at once and keep gradients.

    Attributes:
        unit: of score, reward and objective.
    """

    unit: ClassVar[str]

    def reward(self, motion: Motion) -> "Tensor":
        """Reward of every control frame, from the state at its end `[frames, worlds]`; higher is better.

        It may depend on the start of the episode too, and on no other state, so that it can be told at once.
        """
        ...

    def score(self, motion: Motion) -> "Tensor":
        """The episode's result `[worlds]`: what tables show; higher is better."""
        ...

    def objective(self, motion: Motion) -> "Tensor":
        """What gradient methods make large `[worlds]`: the score or a smoother stand-in for it."""
        ...

    def metrics(self, motion: Motion) -> Mapping[str, tuple["Tensor", str]]:
        """Readings of the episode by name, each `[worlds]` with its unit."""
        ...
