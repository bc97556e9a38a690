"""Readings of swimming against motions in closed form."""

import dataclasses
import math

import pytest
import torch

from tests.tasks.motions import SECONDS, block, motion
from zoobench.tasks.base import Motion
from zoobench.tasks.readings import common_readings

FREQUENCY, SPEED, TAIL, HEAD = 4.0, 0.1, 0.012, 0.003


def eel(waves: float, *, upright: bool = False, turned: float = 0.0, frames: int = 250) -> Motion:
    """A body 0.1 m long in a wave of so many lengths, whose amplitude grows from `HEAD` to `TAIL`, on its way."""
    rest = block(count=200)
    back = (0.05 - rest[:, 0]) / 0.1
    times = torch.arange(frames + 1, dtype=torch.float64)[:, None] * SECONDS
    swing = (HEAD + (TAIL - HEAD) * back) * torch.cos(2 * math.pi * (FREQUENCY * times - waves * back))
    path = rest.expand(frames + 1, -1, -1).clone()
    path[..., 1 if upright else 2] += swing
    path[..., 0] += SPEED * times
    c, s = math.cos(turned), math.sin(turned)
    path = path @ torch.tensor([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]], dtype=torch.float64)
    return dataclasses.replace(motion(rest, path), swims=True)


def readings(made: Motion) -> dict[str, float]:
    """Their values by name."""
    return {name: value.item() for name, (value, _) in common_readings(made).items()}


@pytest.mark.parametrize("upright", [False, True])
@pytest.mark.parametrize("waves", [1.0, 0.6, -0.8])
def test_a_wave_along_the_body_is_measured(waves: float, upright: bool) -> None:
    """Frequency, amplitudes of the outer tenths, Strouhal number and phase, wherever it heads and however it bends."""
    found = readings(eel(waves, upright=upright, turned=0.7))
    back = torch.arange(10, dtype=torch.float64) / 10 + 0.05
    wave = torch.polar(HEAD + (TAIL - HEAD) * back, -2 * math.pi * waves * back)
    seen = wave - wave.mean()  # from the centre of mass, which swings, too
    tail, head = float(seen[-1].abs()), float(seen[0].abs())
    lag = -float(torch.angle(seen[1:] * seen[:-1].conj()).sum())
    assert found["beat_frequency"] == pytest.approx(FREQUENCY, rel=0.02)
    assert found["tail_amplitude"] == pytest.approx(tail, rel=0.08)
    assert found["head_amplitude"] == pytest.approx(head, rel=0.15)
    assert found["strouhal_number"] == pytest.approx(2 * FREQUENCY * tail / SPEED, rel=0.1)
    assert found["wave_phase"] == pytest.approx(lag, abs=0.3)


def test_what_drifts_without_swinging_has_no_wave() -> None:
    """All readings are none."""
    still = dataclasses.replace(eel(1.0), positions=block(count=200).expand(251, 1, -1, -1).clone())
    names = ("beat_frequency", "tail_amplitude", "head_amplitude", "strouhal_number", "wave_phase")
    assert [readings(still)[name] for name in names] == pytest.approx([0.0] * 5, abs=1e-9)


def test_an_episode_too_short_for_a_beat_has_readings() -> None:
    """They are 0, and not missing."""
    assert readings(eel(1.0, frames=6))["tail_amplitude"] == 0.0


def test_bodies_on_land_have_none() -> None:
    """A tail beat on the ground says nothing about swimming."""
    assert "strouhal_number" not in readings(dataclasses.replace(eel(1.0), swims=False))
