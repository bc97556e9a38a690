"""Actuation of studies."""

import numpy as np
import pytest

from zoobench import registry
from zoobench.cell.driving import random_actuation, travelling_wave
from zoobench.controllers.sine_feedback import SineFeedback
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.spec import Ref


def test_all_muscles_are_driven_in_turn() -> None:
    """The phases of the muscles are spread over one period, and the wave stays in bounds."""
    wave = travelling_wave(100, 4)
    assert wave.shape == (100, 1, 4)
    assert abs(wave).max() <= 1.0
    assert wave[0, 0] == pytest.approx([0.0, 1.0, 0.0, -1.0])


def test_random_controllers_follow_the_seed() -> None:
    """The first world is the same, up to rounding, for any number of worlds; worlds and seeds differ."""
    driver = registry.create(Kind.CONTROLLER, Ref("sine-basis"))
    three = random_actuation(driver, 4, 50, 3, seed=1)
    assert three.shape == (50, 3, 4)
    np.testing.assert_allclose(three[:, :1], random_actuation(driver, 4, 50, 1, seed=1), rtol=0, atol=1e-12)
    assert not np.array_equal(three[:, 0], three[:, 1])
    assert not np.array_equal(three, random_actuation(driver, 4, 50, 3, seed=2))


def test_a_closed_loop_has_no_actuation_of_its_own() -> None:
    """A closed loop is refused, with the remedy."""
    with pytest.raises(UsageError, match="open-loop"):
        random_actuation(SineFeedback(), 4, 50, 1, seed=1)
