"""The travelling wave, term by term."""

import math

import numpy as np
import pytest
import torch

from zoobench.controllers.base import MusclePlaces
from zoobench.controllers.travelling_wave import TravellingWave

TIMES = torch.arange(125, dtype=torch.float64) * 0.008
PLACES = MusclePlaces(
    back=np.array([0.2, 0.2, 0.8, 0.5]),
    side=np.array([-1.0, 1.0, 0.6, 0.0]),
    right=np.array([0.3, 0.9, 0.8, 0.0]),
    up=np.array([-1.0, 1.0, 0.6, 0.0]),
)


def activity(*parameters: float, wave: TravellingWave | None = None) -> np.ndarray:
    """Of the four muscles over a second `[125, 4]`."""
    row = torch.tensor([parameters], dtype=torch.float64)
    return (wave or TravellingWave()).placed(PLACES).actuation(row, TIMES, 4)[:, 0].numpy()


def test_it_is_the_formula() -> None:
    """Frequency, waves along the body, strength and growth, by hand, for every muscle."""
    found = activity(0.3, -0.4, 0.8, 1.5, wave=TravellingWave(frequency=3.0, wavelength=0.8))
    frequency, waves = 3.0 * 4.0 ** math.tanh(0.3), 1 / 0.8 - 0.4
    for frame, muscle in [(0, 0), (17, 1), (60, 2), (124, 3)]:
        back, side = PLACES.back[muscle], PLACES.side[muscle]
        strength = math.tanh(0.8 * math.exp(1.5 * (back - 0.5)))
        wave = math.sin(2 * math.pi * (frequency * frame * 0.008 - waves * back))
        assert found[frame, muscle] == pytest.approx(side * strength * wave, rel=1e-9, abs=1e-12)


def test_antagonists_oppose_and_what_does_not_bend_rests() -> None:
    """The first two muscles lie left and right at one place; the last bends the body to no side."""
    found = activity(0.0, 0.0, 1.0, 0.0)
    np.testing.assert_allclose(found[:, 0], -found[:, 1])
    assert not found[:, 3].any()
    assert np.abs(found[:, 2]).max() > 0.4


def test_the_wave_runs_to_the_tail_or_to_the_head() -> None:
    """The hind muscle does later what the front one does, and earlier where the number of waves is negative."""
    for waves, lag in ((-0.5, 0.3), (-1.5, -0.3)):  # half a wave along the body, over 0.6 of it
        found = activity(0.0, waves, 1.0, 0.0, wave=TravellingWave(frequency=1.0))
        peaks = TIMES.numpy()[[found[:, 1].argmax(), found[:, 2].argmax()]]
        assert (peaks[1] - peaks[0]) % 1.0 == pytest.approx(lag % 1.0, abs=0.01)


def test_the_range_holds_for_any_parameters() -> None:
    """Activity is in [-1, 1], and the frequency within a factor of four of its reference."""
    assert np.abs(activity(1e6, 1e3, 1e6, 10.0)).max() <= 1.0
    found = activity(1e6, 0.0, 1.0, 0.0, wave=TravellingWave(frequency=2.0))[:, 1]
    assert int((np.diff(np.sign(found)) != 0.0).sum()) in (15, 16)  # zeros of 8 Hz in a second


def test_steering_bends_the_front_steadily() -> None:
    """Two more parameters move the mean of the front muscles to the right and up, by where they lie, and leave the rest
    of the range to the wave; at 0 they are none, and hind muscles do not heed them."""
    steered = TravellingWave(steering=True)
    plain = activity(0.0, 0.0, 1.0, 0.0)
    np.testing.assert_array_equal(activity(0.0, 0.0, 1.0, 0.0, 0.0, 0.0, wave=steered), plain)
    bend = np.tanh(-0.7 * PLACES.right + 0.4 * PLACES.up) * (PLACES.back < 0.5)
    np.testing.assert_allclose(
        activity(0.0, 0.0, 1.0, 0.0, -0.7, 0.4, wave=steered), bend + (1.0 - np.abs(bend)) * plain
    )
    assert steered.parameter_count(4) == len(steered.initial(np.random.default_rng(0), 4)) == 6
