"""The observation: the input of closed-loop controllers and policies."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from zoobench.controllers.base import WAVE_RATE
from zoobench.designs.base import Body

if TYPE_CHECKING:
    from torch import Tensor


@dataclass(frozen=True)
class ObservationModel:
    """Observations of one body.

    Lengths are in units of the body's length L and velocities in 20 L/s. Vectors have the components ahead, up and
    right of the present heading, except the displacement, whose components are those of the heading at rest.

    * the centre of mass: velocity (3) and displacement since the start (3);
    * the heading: cosine and sine of its horizontal angle from that at rest (2);
    * each muscle: displacement of its centre from its place at rest (3) and velocity (3), both relative to the centre
      of mass.
    """

    body: Body

    def observe(self, positions: "Tensor", velocities: "Tensor", start: "Tensor", occupancy: "Tensor") -> "Tensor":
        """The observation `[observation_count]`; differentiable by all arguments.

        Args:
            positions: of the particles `[particle_count, 3]` [m].
            velocities: `[particle_count, 3]` [m/s].
            start: positions at the start of the episode `[particle_count, 3]` [m].
            occupancy: `[particle_count]` in [0, 1].
        """
        import torch

        masses = occupancy * torch.as_tensor(self.body.density_ratio * self.body.volumes)
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
        """Unit vectors ahead, up and right as rows `[3, 3]`, and cosine and sine of the heading `[2]`.

        Ahead is the horizontal direction from the centre of the tail to that of the head.
        """
        import torch

        ends = []
        for label in (self.body.head, self.body.tail):
            weights = share * torch.as_tensor(label.astype(np.float64))
            ends.append(weights @ positions / weights.sum().clamp(min=torch.finfo(share.dtype).tiny))
        level = (ends[0] - ends[1]) * share.new_tensor([1.0, 0.0, 1.0])
        # a robot whose head is above its tail has no heading: the small constant [m^2] keeps the division finite
        ahead = level / torch.sqrt(level.square().sum() + 1e-12)
        up = share.new_tensor([0.0, 1.0, 0.0])
        return torch.stack([ahead, up, torch.linalg.cross(ahead, up)]), ahead[[0, 2]] * share.new_tensor([1.0, -1.0])
