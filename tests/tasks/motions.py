"""Motions whose scores are known in closed form."""

import math

import torch

from zoobench.tasks.base import Motion

SECONDS = 0.008


def disc(radius: float = 0.05, rings: int = 5, spokes: int = 12, on_axis: bool = False) -> torch.Tensor:
    """Particles `[n, 3]` of a level disc about the y axis, on rings of equal spacing."""
    points = [[0.0, 0.02, 0.0]] if on_axis else []
    for ring in range(1, rings + 1):
        for spoke in range(spokes):
            angle = 2 * math.pi * spoke / spokes
            r = radius * ring / rings
            points.append([r * math.cos(angle), 0.02, -r * math.sin(angle)])
    return torch.tensor(points, dtype=torch.float64)


def rigid(points: torch.Tensor, spin: float, velocity: tuple[float, float, float], frames: int = 20) -> Motion:
    """Points that spin about y at `spin` [rad/s], counter-clockwise from above, while they translate; one world."""
    positions, velocities = [], []
    drift = torch.tensor(velocity, dtype=torch.float64)
    for frame in range(frames + 1):
        time = frame * SECONDS
        c, s = math.cos(spin * time), math.sin(spin * time)
        turned = points @ torch.tensor([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]], dtype=torch.float64)
        rate = spin * torch.stack([turned[:, 2], torch.zeros(len(points)), -turned[:, 0]], dim=1)
        positions.append(turned + time * drift)
        velocities.append(rate + drift)
    masses = torch.ones(1, len(points), dtype=torch.float64)
    return Motion(torch.stack(positions)[:, None], torch.stack(velocities)[:, None], masses, SECONDS)
