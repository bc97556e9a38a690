"""What a robot feels of itself: the input of every controller that closes its loop."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from zoobench.controllers.base import WAVE_RATE
from zoobench.designs.base import Body

if TYPE_CHECKING:
    from torch import Tensor


@dataclass(frozen=True)
class ObservationModel:
    """The senses of one body.

    An observation is, in units of the body's length L and of 20 L/s, and along its present heading, up and right:

    * velocity of the centre of mass (3), its displacement since the start (3, along the heading at rest);
    * the heading: cosine and sine of its level angle from that at rest (2);
    * of each muscle the displacement of its centre from where it is at rest (3) and its velocity (3), both relative
      to the body's centre of mass.

    It turns with the robot, but for displacement and heading, which tell it where it is and where it looks.
    """

    body: Body

    def observe(self, positions: "Tensor", velocities: "Tensor", start: "Tensor", presence: "Tensor") -> "Tensor":
        """The observation `[observation_count]`; differentiable by everything given.

        Args:
            positions: of the particles `[particle_count, 3]` [m].
            velocities: `[particle_count, 3]` [m/s].
            start: their positions when the episode began [m].
            presence: how much of every particle is there `[particle_count]`.
        """
        import torch

        masses = presence * torch.as_tensor(self.body.density_ratio * self.body.volumes)
        share = masses / masses.sum()
        length = float(np.ptp(self.body.positions[:, 0]))
        frame, angle = self._frame(positions, share)
        centre, speed = share @ positions, share @ velocities
        muscles = masses[:, None] * torch.as_tensor(self.body.muscle_membership)
        weights = muscles / muscles.sum(dim=0).clamp(min=torch.finfo(masses.dtype).tiny)
        rest = torch.as_tensor(self.body.positions)
        apart = (weights.T @ positions - centre) @ frame.T - (weights.T @ rest - share @ rest)
        faster = (weights.T @ velocities - speed) @ frame.T
        moved = centre - share @ start
        own = (frame @ speed / (WAVE_RATE * length), moved / length, angle)
        return torch.cat([*own, (apart / length).reshape(-1), (faster / (WAVE_RATE * length)).reshape(-1)])

    def _frame(self, positions: "Tensor", share: "Tensor") -> tuple["Tensor", "Tensor"]:
        """Rows ahead, up and right `[3, 3]`, and cosine and sine of the level angle `[2]`.

        Ahead is the level direction from the centre of the tail to that of the head.
        """
        import torch

        ends = []
        for label in (self.body.head, self.body.tail):
            weights = share * torch.as_tensor(label.astype(np.float64))
            ends.append(weights @ positions / weights.sum().clamp(min=torch.finfo(share.dtype).tiny))
        level = (ends[0] - ends[1]) * share.new_tensor([1.0, 0.0, 1.0])
        # a robot that stands on its head looks nowhere: the small length keeps the direction finite
        ahead = level / torch.sqrt(level.square().sum() + 1e-12)
        up = share.new_tensor([0.0, 1.0, 0.0])
        return torch.stack([ahead, up, torch.linalg.cross(ahead, up)]), ahead[[0, 2]] * share.new_tensor([1.0, -1.0])
