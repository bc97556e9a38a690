"""Jumping against closed forms."""

import math

import pytest
import torch

from tests.tasks.motions import SECONDS, lattice, mapped, motion, pitch
from zoobench.tasks.jump import Jump

FRAMES = 60


def _thrown(speed: float, drift: float) -> torch.Tensor:
    """The path of a box that leaves the ground at this upward speed and flies ahead at `drift` [m/s]."""
    times = torch.arange(FRAMES + 1, dtype=torch.float64) * SECONDS
    heights = (speed * times - 9.81 / 2 * times**2).clamp(min=0.0)
    way = torch.stack([drift * times, heights, torch.zeros_like(times)], dim=1)
    return lattice() + way[:, None]


def test_a_ballistic_jump_scores_its_height() -> None:
    """v^2 / 2 g, to the height lost in half a frame at the top."""
    found = motion(lattice(), _thrown(1.0, 0.0))
    assert Jump().score(found).item() == pytest.approx(1.0 / (2 * 9.81), abs=9.81 / 2 * (SECONDS / 2) ** 2)
    assert Jump().metrics(found)["centre_rise"][0].item() == pytest.approx(Jump().score(found).item(), rel=1e-12)


def test_half_of_the_way_is_taken_off() -> None:
    """The maximum of v t - g t^2 / 2 - u t / 2."""
    wanted = (1.0 - 0.2) ** 2 / (2 * 9.81)
    assert Jump().score(motion(lattice(), _thrown(1.0, 0.4))).item() == pytest.approx(wanted, abs=1e-4)


def test_the_smooth_substitute_is_near_the_score_and_never_above() -> None:
    """Nearer than h log(frames); nothing for a body that does nothing."""
    high = motion(lattice(), _thrown(1.0, 0.1))
    score, objective = (float(value) for value in (Jump().score(high), Jump().objective(high)))
    assert score - 2e-3 * math.log(FRAMES) < objective < score
    still = motion(lattice(), lattice().expand(FRAMES + 1, -1, -1))
    assert float(Jump().objective(still)) == pytest.approx(0.0, abs=1e-15)
    assert float(Jump().score(still)) == 0.0


@pytest.mark.parametrize("angle", [-0.3, -math.pi / 4, -math.pi / 2])
def test_rearing_up_is_no_jump(angle: float) -> None:
    """A box that turns up on its lower edge lifts its centre by up to a quarter of its length, and scores 0."""
    rest = lattice()
    edge = torch.tensor([-0.05, 0.0, 0.0], dtype=torch.float64)
    reared = edge + (rest - edge) @ pitch(angle).T
    reared[:, 1] += float(rest[:, 1].min() - reared[:, 1].min())  # particles are within the box
    found = motion(rest, torch.stack([rest, reared]))
    assert Jump().metrics(found)["centre_rise"][0].item() > 0.01
    assert Jump().score(found).item() <= 1e-12


def test_stretching_is_no_jump() -> None:
    """All but its sole goes up."""
    tall = torch.diag(torch.tensor([0.9, 1.5, 0.9], dtype=torch.float64))
    found = mapped(lattice(), [tall])
    assert Jump().metrics(found)["centre_rise"][0].item() == pytest.approx(0.0125)
    assert Jump().score(found).item() == pytest.approx(0.5 * 0.0025)  # of the lowest particle in its cell


def test_a_part_thrown_up_is_no_jump() -> None:
    """Nor does a torn body gain that leaves a particle on the ground."""
    rest = lattice()
    flown = rest + torch.tensor([0.0, 0.3, 0.0], dtype=torch.float64)
    flown[rest[:, 1].argmin()] = rest[rest[:, 1].argmin()]
    found = motion(rest, torch.stack([rest, flown]))
    assert Jump().score(found).item() == 0.0
