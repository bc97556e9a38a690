"""Somersaults against closed forms."""

import math
from itertools import pairwise

import pytest
import torch

from tests.tasks.motions import SECONDS, lattice, mapped, pitch, roll, yaw
from zoobench.tasks.base import Motion
from zoobench.tasks.flipping import Flip

BOX = lattice(spacing=0.01)
STEP = 0.05
COUNT = 150  # 7.5 rad: more than a turn


def _angle(motion: Motion) -> float:
    return Flip().score(motion).item()


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_angle_goes_past_half_turns_with_its_sign(sign: float) -> None:
    """A sum of sines of its steps, smaller than the angle by a sixth of their squares."""
    turns = [pitch(sign * STEP * n) for n in range(1, COUNT + 1)]
    assert _angle(mapped(BOX, turns)) == pytest.approx(sign * COUNT * math.sin(STEP), rel=1e-9)
    assert Flip().metrics(mapped(BOX, turns))["greatest_tilt"][0].item() == pytest.approx(math.pi, abs=STEP)


def test_rewards_add_up_to_the_score() -> None:
    """Each is the angle that the velocities at the end of its frame make in a frame."""
    angles = [math.pi / 2 * (1.0 - math.cos(math.pi * n / 60)) for n in range(1, 61)]
    motion = mapped(BOX, [pitch(angle) for angle in angles])
    assert Flip().reward(motion).sum().item() == pytest.approx(_angle(motion), rel=0.01)
    assert _angle(motion) == pytest.approx(math.pi, rel=2e-3)


@pytest.mark.parametrize("before", [0.4, math.pi / 2, 3.0])
def test_it_does_not_matter_which_way_the_body_looks(before: float) -> None:
    """The axis is the body's own, whatever the heading that it has turned to."""
    looks = [yaw(before * n / 20) for n in range(1, 21)]
    turns = [looks[-1] @ pitch(STEP * n) for n in range(1, 41)]
    assert _angle(mapped(BOX, looks + turns)) == pytest.approx(40 * math.sin(STEP), rel=1e-9)


@pytest.mark.parametrize("wobble", [0.0, 0.2])
def test_turning_and_rolling_over_a_side_is_no_flip(wobble: float) -> None:
    """Two turns about the vertical gain nothing, though the body nods; a roll gains in proportion to its wobble."""
    turns = [yaw(2 * STEP * n) @ pitch(wobble * math.sin(STEP * n)) for n in range(1, 126)]
    assert abs(_angle(mapped(BOX, turns))) < 0.01
    rolls = [yaw(1.3) @ pitch(wobble * math.sin(STEP * n)) @ roll(STEP * n) for n in range(1, 126)]
    assert abs(_angle(mapped(BOX, rolls))) <= 2 * math.pi * wobble + 1e-3


def test_swinging_while_wide_and_back_while_thin_gains_nothing() -> None:
    """The sum of best fits from frame to frame, in its place, would grow with every cycle."""
    cycle = [2 * math.pi * n / 20 for n in range(1, 101)]
    maps = []
    for phase in cycle:
        shear, wide = 0.3 * math.sin(phase), math.exp(0.3 * math.cos(phase))
        maps.append(torch.tensor([[wide, 0.0, 0.0], [shear, 1.0 / wide, 0.0], [0.0, 0.0, 1.0]], dtype=torch.float64))
    start = BOX @ maps[-1].T
    motion = mapped(start, [each @ maps[-1].inverse() for each in maps])
    assert abs(_angle(motion)) < 0.02
    centred = [positions - positions.mean(dim=0) for positions in motion.positions[:, 0]]
    drift = sum(
        math.atan2(float((a[:, 1] * b[:, 0] - a[:, 0] * b[:, 1]).sum()), float((a[:, :2] * b[:, :2]).sum()))
        for a, b in pairwise(centred)
    )
    assert abs(drift) > 0.3


def test_the_time_of_a_frame_is_in_the_reward() -> None:
    """A body that spins at w in its place is worth sin(w dt) in every frame, by its velocities alone."""
    spin = 3.0
    motion = mapped(BOX, [pitch(spin * SECONDS * n) for n in range(1, 20)])
    assert Flip().reward(motion)[:-1, 0].tolist() == pytest.approx([spin * SECONDS] * 18, rel=2e-3)
