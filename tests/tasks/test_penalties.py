"""Power and sideways speed in closed form."""

import dataclasses
import math

import pytest
import torch

from tests.tasks.motions import SECONDS, block, motion, rigid
from zoobench.tasks.penalties import MusclePower, SidewaysSpeed
from zoobench.tasks.readings import actuation_energy


def _with_work(work: list[list[float]]) -> torch.Tensor:
    return torch.tensor(work, dtype=torch.float64)[:, None]


def test_power_is_the_positive_work_of_a_frame_by_its_length() -> None:
    """Muscles of 3 mJ and -5 mJ, then of 0 and 2 mJ; over the episode it is the actuation energy by the time."""
    rest = block(count=1)
    still = motion(rest, rest.expand(3, -1, -1).clone(), work=_with_work([[3e-3, -5e-3], [0.0, 2e-3]]))
    torch.testing.assert_close(MusclePower().reward(still)[:, 0], _with_work([[3e-3], [2e-3]])[:, 0, 0] / SECONDS)
    assert MusclePower().score(still).item() == pytest.approx(actuation_energy(still).item() / (2 * SECONDS))


def test_the_power_has_a_gradient_where_work_is_positive() -> None:
    """By the length of all frames there, and none where a muscle is stretched."""
    rest = block(count=1)
    work = _with_work([[3e-3, -5e-3], [1e-3, 2e-3]]).requires_grad_()
    still = motion(rest, rest.expand(3, -1, -1).clone(), work=work)
    (gradient,) = torch.autograd.grad(MusclePower().objective(still).sum(), work)
    torch.testing.assert_close(gradient, _with_work([[1.0, 0.0], [1.0, 1.0]]) / (2 * SECONDS))


@pytest.mark.parametrize("heading", [0.0, 30.0, -120.0])
@pytest.mark.parametrize("speed", [0.3, -0.3])
def test_straight_motion_is_not_sideways(heading: float, speed: float) -> None:
    """Ahead or back along the heading, and up or down."""
    angle = math.radians(heading)
    straight = rigid(block(), spin=0.0, velocity=(speed * math.cos(angle), 0.1, -speed * math.sin(angle)))
    assert SidewaysSpeed(heading=heading).score(straight).item() == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("side", [0.2, -0.2])
def test_both_sides_count_alike(side: float) -> None:
    """At 0.2 m/s across the heading of 30 degrees, whatever the speed along it."""
    angle = math.radians(30.0)
    velocity = (0.5 * math.cos(angle) + side * math.sin(angle), 0.0, -0.5 * math.sin(angle) + side * math.cos(angle))
    aside = rigid(block(), spin=0.0, velocity=velocity)
    torch.testing.assert_close(SidewaysSpeed(heading=30.0).reward(aside), torch.full((20, 1), 0.2).double())


def test_swinging_from_side_to_side_is_sideways() -> None:
    """A body that recoils at 0.1 m/s to the right and to the left in turn goes nowhere, and has 0.1 m/s."""
    ahead = rigid(block(), spin=0.0, velocity=(0.3, 0.0, 0.0))
    velocities = ahead.velocities.clone()
    velocities[..., 2] = 0.1 * (-1.0) ** torch.arange(21, dtype=torch.float64)[:, None, None]
    swinging = dataclasses.replace(ahead, velocities=velocities)
    assert SidewaysSpeed().score(swinging).item() == pytest.approx(0.1)
