"""Motions whose scores are known in closed form."""

import math
from dataclasses import replace

import torch

from zoobench.tasks.base import Motion, ObjectMotion

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


def block(count: int = 40, seed: int = 0) -> torch.Tensor:
    """Random particles `[n, 3]` in a box 0.1 m long, mirrored at its middle planes."""
    box = torch.rand(count, 3, dtype=torch.float64, generator=torch.Generator().manual_seed(seed))
    signs = [[x, 1.0, z] for x in (1.0, -1.0) for z in (1.0, -1.0)]
    corners = box * torch.tensor([0.05, 0.03, 0.02], dtype=torch.float64)
    return torch.cat([corners * torch.tensor(sign, dtype=torch.float64) for sign in signs])


def motion(
    rest: torch.Tensor,
    positions: torch.Tensor,
    velocities: torch.Tensor | None = None,
    work: torch.Tensor | None = None,
) -> Motion:
    """One world of particles of 1 kg that were at `rest` `[n, 3]`; their path is `[frames + 1, n, 3]`.

    The outer thirds of the body are labelled head and tail. Velocities and work are zero if not given.
    """
    third = float(rest[:, 0].max()) / 3
    return Motion(
        positions=positions[:, None],
        velocities=torch.zeros_like(positions[:, None]) if velocities is None else velocities[:, None],
        masses=torch.ones(1, len(rest), dtype=torch.float64),
        frame_seconds=SECONDS,
        rest=rest,
        head=(rest[:, 0] > third).double(),
        tail=(rest[:, 0] < -third).double(),
        muscle_work=torch.zeros(len(positions) - 1, 1, 2, dtype=torch.float64) if work is None else work,
    )


def with_object(motion: Motion, rest: torch.Tensor, positions: torch.Tensor) -> Motion:
    """The motion with an object of equal particles that is without strain at `rest` `[n, 3]`.

    Args:
        positions: its path `[frames + 1, n, 3]`.
    """
    masses = torch.full((len(rest),), 0.01, dtype=torch.float64)
    thing = ObjectMotion(positions[:, None], torch.zeros_like(positions[:, None]), masses, rest)
    return replace(motion, objects={"object": thing})


def carried(
    ways: list[list[float]], turns: list[torch.Tensor] | None = None, robot: torch.Tensor | None = None
) -> Motion:
    """A motion with a rigid object whose centre has these ways since the start, one a state [m].

    Args:
        ways: `[frames + 1, 3]`.
        turns: its rotation at each state; none by default.
        robot: ways of the robot `[frames + 1, 3]`; at rest by default.
    """
    points, rest = disc(rings=1, spokes=3), block(count=3)
    rest = rest - rest.mean(dim=0)
    path = torch.tensor(ways, dtype=torch.float64)[:, None]
    spins = torch.stack(turns or [torch.eye(3, dtype=torch.float64)] * len(ways))
    own = torch.zeros_like(path) if robot is None else robot[:, None]
    return with_object(motion(points, points + own), rest + 0.3, rest @ spins.transpose(1, 2) + 0.3 + path)


def yaw(angle: float) -> torch.Tensor:
    """The matrix of a rotation about y, counter-clockwise from above."""
    c, s = math.cos(angle), math.sin(angle)
    return torch.tensor([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]], dtype=torch.float64)


def rigid(points: torch.Tensor, spin: float, velocity: tuple[float, float, float], frames: int = 20) -> Motion:
    """Points that spin about y at `spin` [rad/s], counter-clockwise from above, while they translate; one world."""
    positions, velocities = [], []
    drift = torch.tensor(velocity, dtype=torch.float64)
    for frame in range(frames + 1):
        time = frame * SECONDS
        turned = points @ yaw(spin * time).T
        rate = spin * torch.stack([turned[:, 2], torch.zeros(len(points)), -turned[:, 0]], dim=1)
        positions.append(turned + time * drift)
        velocities.append(rate + drift)
    return motion(points, torch.stack(positions), torch.stack(velocities))


def scattered(count: int = 12, seed: int = 3) -> torch.Tensor:
    """Random particles `[n, 3]` in a box of 0.1 x 0.05 x 0.04 m on the ground, no two of which share a coordinate."""
    box = torch.rand(count, 3, dtype=torch.float64, generator=torch.Generator().manual_seed(seed))
    return (box - torch.tensor([0.5, 0.0, 0.5])) * torch.tensor([0.1, 0.05, 0.04], dtype=torch.float64)


def lattice(length: float = 0.1, height: float = 0.05, width: float = 0.04, spacing: float = 0.005) -> torch.Tensor:
    """Particles `[n, 3]` in the middles of the cubes of a box that stands on y = 0."""
    sides = [torch.arange(spacing / 2, side, spacing, dtype=torch.float64) for side in (length, height, width)]
    return torch.cartesian_prod(*sides) - torch.tensor([length / 2, 0.0, width / 2], dtype=torch.float64)


def pitch(angle: float) -> torch.Tensor:
    """The matrix of a rotation about z by which what is ahead goes down: forward, as in a somersault."""
    c, s = math.cos(angle), math.sin(angle)
    return torch.tensor([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]], dtype=torch.float64)


def roll(angle: float) -> torch.Tensor:
    """The matrix of a rotation about x by which the right side goes down."""
    c, s = math.cos(angle), math.sin(angle)
    return torch.tensor([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]], dtype=torch.float64)


def mapped(rest: torch.Tensor, maps: list[torch.Tensor]) -> Motion:
    """Points at rest, and then under each of these linear maps about the origin; velocities by differences."""
    positions = torch.stack([rest, *(rest @ each.T for each in maps)])
    return motion(rest, positions, torch.gradient(positions, spacing=SECONDS, dim=0)[0])
