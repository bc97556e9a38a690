"""Metrics that every task reports besides its score: distance, speed and energy."""

from typing import TYPE_CHECKING

from zoobench.tasks.base import Motion
from zoobench.tasks.swimming_readings import swimming_readings

if TYPE_CHECKING:
    from torch import Tensor

Readings = dict[str, tuple["Tensor", str]]

GRAVITY = 9.81
"""[m/s^2] of the weight in the cost of transport; by convention in water and under another gravity, too."""


def common_readings(motion: Motion) -> Readings:
    """The readings, `[worlds]` each with its unit; all of them are of horizontal motion.

    * `distance`: from start to end of the centre of mass; `distance_travelled`: length of its trajectory.
    * `mean_speed`: of the centre of mass, averaged over frames.
    * `actuation_energy`: see `actuation_energy`.
    * `cost_of_transport`: that energy per weight and distance travelled (Gabrielli and von Karman 1950); 0 if no energy
      is spent.
    * of a body in water those of `swimming_readings`.
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
        **(swimming_readings(motion) if motion.swims else {}),
    }


def actuation_energy(motion: Motion) -> "Tensor":
    """Positive mechanical work of the muscles on the body `[worlds]` [J].

    Each muscle's work over a control frame counts if it is positive; work done on a stretched muscle is not recovered.
    Losses of an actuator are not included.
    """
    return motion.muscle_work.clamp(min=0.0).sum(dim=(0, 2))


def late_mean(rewards: "Tensor") -> "Tensor":
    """The mean of rewards `[frames, worlds]` over the last quarter of the frames `[worlds]`."""
    return rewards[-max(1, len(rewards) // 4) :].mean(dim=0)
