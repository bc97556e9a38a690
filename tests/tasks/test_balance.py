"""Standing on the tail."""

import math

import pytest
import torch

from tests.tasks.motions import lattice, mapped, motion, pitch, roll, yaw
from zoobench.tasks.balance import BalanceTask

BOX = lattice(spacing=0.01)


@pytest.mark.parametrize("angle", [0.3, math.pi / 2, -0.4])
def test_the_score_is_the_mean_elevation_of_the_head(angle: float) -> None:
    """Up is positive, half of the time counts half, and neither heading nor a roll before matter."""
    up = pitch(-angle)
    found = mapped(BOX, [up, yaw(2.0) @ up, up @ roll(0.5), *[torch.eye(3).double()] * 3])
    assert BalanceTask().score(found).item() == pytest.approx(angle / 2, abs=1e-5)
    assert BalanceTask().metrics(found)["final_elevation"][0].item() == pytest.approx(0.0, abs=1e-9)


def test_falling_over_backward_is_not_standing() -> None:
    """The elevation falls again beyond the vertical."""
    assert BalanceTask().score(mapped(BOX, [pitch(-math.pi + 0.2)])).item() == pytest.approx(0.2)


def test_a_bent_neck_counts_in_part_and_a_torn_head_hardly() -> None:
    """A head, a fifth of the body, bent up by a quarter turn is less than a sixth of that; a particle is nothing."""
    bent = BOX.clone()
    neck = bent[:, 0] > 0.03
    pivot = torch.tensor([0.03, 0.025, 0.0], dtype=torch.float64)
    bent[neck] = pivot + (bent[neck] - pivot) @ pitch(-math.pi / 2).T
    assert 0.0 < BalanceTask().score(motion(BOX, torch.stack([BOX, bent]))).item() < math.pi / 12
    torn = BOX.clone()
    torn[BOX[:, 0].argmax(), 1] += 0.05
    assert BalanceTask().score(motion(BOX, torch.stack([BOX, torn]))).item() < 0.02


def test_the_derivative_is_finite_upright() -> None:
    """Where the elevation has a maximum with a corner."""
    still = mapped(BOX, [pitch(-math.pi / 2)])
    still.positions.requires_grad_()
    (gradient,) = torch.autograd.grad(BalanceTask().objective(still).sum(), still.positions)
    assert torch.isfinite(gradient).all()
