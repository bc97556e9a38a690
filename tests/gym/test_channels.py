"""Inputs and actions of a policy."""

import numpy as np
import pytest
import torch

from zoobench.controllers.base import with_phase
from zoobench.controllers.sine_basis import SineBasis
from zoobench.errors import UsageError
from zoobench.gym.channels import LARGEST, Channels

LAYOUT = (("body", 8), ("time_left", 1))
TIMES = np.array([0.008, 0.0])


@pytest.mark.parametrize("muscles", [1, 4, 60])
def test_waves_are_those_of_the_sine_basis_at_every_worlds_own_time(muscles: int) -> None:
    """The action is the basis' parameter vector, clipped to [-1, 1]; bit for bit, for few muscles and many."""
    actions = np.random.default_rng(0).normal(size=(2, 9 * muscles)).astype(np.float32)
    activity = Channels(muscles, LAYOUT, "waves").activity(actions, TIMES)
    for world in range(2):
        weights = torch.as_tensor(actions[world : world + 1].astype(np.float64).clip(-1.0, 1.0))
        expected = SineBasis().actuation(weights, torch.as_tensor(TIMES[world : world + 1]), muscles)[0, 0]
        np.testing.assert_array_equal(activity[world], expected.numpy())


def test_muscle_actions_are_activities() -> None:
    """Clipped to [-1, 1]."""
    channels = Channels(1, LAYOUT, "muscles")
    np.testing.assert_array_equal(channels.activity(np.float32([[0.25], [-3.0]]), TIMES), [[0.25], [-1.0]])


def test_inputs_end_with_the_phase() -> None:
    """They are what the controller `policy-network` is given, at every world's own time."""
    observations = np.random.default_rng(0).uniform(-1.0, 1.0, (2, 9))
    seen = Channels(1, LAYOUT, "waves").inputs(observations, TIMES)
    for world in range(2):
        expected = with_phase(torch.as_tensor(observations[world]), TIMES[world])
        np.testing.assert_array_equal(seen[world], expected.numpy().astype(np.float32))


def test_observations_are_bounded() -> None:
    """By 1 for the time left and the phase; what goes beyond is clipped to its bound."""
    channels = Channels(1, LAYOUT, "waves")
    high = channels.observation_space.high
    np.testing.assert_array_equal(high, [*[LARGEST] * 8, 1.0, 1.0, 1.0])
    seen = channels.inputs(np.full((2, 9), -1e6), TIMES)
    np.testing.assert_array_equal(seen[:, :9], np.tile(-high[:9], (2, 1)))
    assert channels.observation_space.contains(seen[0])


def test_actions_of_another_kind_are_refused() -> None:
    """With those that are offered."""
    with pytest.raises(UsageError, match="waves, muscles"):
        Channels(1, LAYOUT, "wave")  # type: ignore[arg-type]
