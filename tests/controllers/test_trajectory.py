"""The trajectory controller."""

import numpy as np
import torch

from zoobench.controllers.sine_basis import SineBasis
from zoobench.controllers.trajectory import Trajectory
from zoobench.spec import FRAME_SECONDS


def test_every_frame_has_values_of_its_own_and_begins_again() -> None:
    """tanh of the frame's parameters, also at times that are rounded down, and repeated."""
    params = torch.as_tensor(np.random.default_rng(0).normal(size=(2, 30)))
    times = torch.arange(25, dtype=torch.float64) * FRAME_SECONDS
    activity = Trajectory(frames=10).actuation(params, times, 3)
    values = torch.tanh(params.reshape(2, 10, 3))
    assert activity.shape == (25, 2, 3)
    for frame in range(25):
        torch.testing.assert_close(activity[frame], values[:, frame % 10])


def test_it_starts_as_the_sine_basis_does() -> None:
    """The same draw gives the same activity."""
    times = torch.arange(200, dtype=torch.float64) * FRAME_SECONDS
    drawn = Trajectory().initial(np.random.default_rng(4), 2)
    waves = torch.as_tensor(SineBasis().initial(np.random.default_rng(4), 2))[None]
    expected = SineBasis().actuation(waves, times, 2)
    torch.testing.assert_close(Trajectory().actuation(torch.as_tensor(drawn)[None], times, 2), expected)
