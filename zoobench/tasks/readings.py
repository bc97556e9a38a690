"""What every task reports beside its score: the way over the ground, and what it cost."""

from typing import TYPE_CHECKING

from zoobench.tasks.base import Motion

if TYPE_CHECKING:
    from torch import Tensor

Readings = dict[str, tuple["Tensor", str]]

GRAVITY = 9.81
"""[m/s^2] of the weight in the cost of transport, in water too: the quotient is a convention that compares robots."""


def common_readings(motion: Motion) -> Readings:
    """Of every task, each `[worlds]` with its unit.

    * `distance`: the horizontal line from start to end of the centre of mass; `distance_travelled`: its horizontal way.
    * `mean_speed`: the horizontal speed of the centre of mass, averaged over frames.
    * `actuation_energy`: the mechanical work that the muscles put into the body.
    * `cost_of_transport`: that energy per weight and distance travelled (Gabrielli and von Karman 1950); 0 for a robot
      that spends none, wherever it drifts.
    """
    import torch

    centre = motion.centre_of_mass()[..., [0, 2]]
    steps = torch.linalg.vector_norm(centre[1:] - centre[:-1], dim=-1)
    travelled = steps.sum(dim=0)
    energy = actuation_energy(motion)
    weight = GRAVITY * motion.masses.sum(dim=1)
    return {
        "distance": (torch.linalg.vector_norm(centre[-1] - centre[0], dim=-1), "m"),
        "distance_travelled": (travelled, "m"),
        "mean_speed": (steps.mean(dim=0) / motion.frame_seconds, "m/s"),
        "actuation_energy": (energy, "J"),
        "cost_of_transport": (torch.where(energy > 0, energy / (weight * travelled), 0.0), "1"),
    }


def actuation_energy(motion: Motion) -> "Tensor":
    """Mechanical work that the muscles put into the body `[worlds]` [J].

    Each muscle's work over a control frame counts where it is positive: what a muscle takes up while it is stretched
    is lost to it. This is work at the muscle, not what it would draw from a battery.
    """
    return motion.muscle_work.clamp(min=0.0).sum(dim=(0, 2))
