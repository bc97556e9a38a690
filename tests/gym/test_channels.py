"""Inputs and actions of a policy."""

import numpy as np
import pytest
import torch

from tests.methods.toy_session import Mirror
from zoobench.controllers.sine_basis import SineBasis
from zoobench.gym.channels import Channels


def test_waves_are_those_of_the_sine_basis_at_every_worlds_own_time() -> None:
    """The action is the basis' parameter vector, clipped to [-1, 1]."""
    session = Mirror(worlds=2)
    session.begin()
    session.step(np.zeros((2, 1)))
    session.begin([1])
    actions = np.random.default_rng(0).normal(size=(2, 9)).astype(np.float32)
    activity = Channels(session, "waves").activity(actions)  # type: ignore[arg-type]
    for world, time in ((0, 0.008), (1, 0.0)):
        weights = torch.as_tensor(actions[world : world + 1].astype(np.float64).clip(-1.0, 1.0))
        expected = SineBasis().actuation(weights, torch.tensor([time], dtype=torch.float64), 1)[0, 0]
        np.testing.assert_array_equal(activity[world], expected.numpy())


def test_muscle_actions_are_activities() -> None:
    """Clipped to [-1, 1]."""
    channels = Channels(Mirror(worlds=2), "muscles")  # type: ignore[arg-type]
    np.testing.assert_array_equal(channels.activity(np.float32([[0.25], [-3.0]])), [[0.25], [-1.0]])


def test_inputs_end_with_the_phase() -> None:
    """The phase follows the observation, at every world's own time."""
    session = Mirror(worlds=2)
    observations = session.begin()
    seen = Channels(session, "waves").inputs(observations)  # type: ignore[arg-type]
    np.testing.assert_array_equal(seen[:, :-2], observations.astype(np.float32))
    assert seen[:, -2:].tolist() == [[0.0, 1.0], [0.0, 1.0]]
    session.step(np.zeros((2, 1)))
    later = Channels(session, "waves").inputs(observations)  # type: ignore[arg-type]
    assert later[0, -2:].tolist() == pytest.approx([np.sin(0.16), np.cos(0.16)])
