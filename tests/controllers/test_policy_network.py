"""The policy network: its formula, its prior, and the phase."""

import math

import numpy as np
import pytest
import torch

from zoobench.controllers.base import with_phase
from zoobench.controllers.policy_network import PolicyNetwork
from zoobench.controllers.sine_basis import SineBasis

FELT = torch.as_tensor(np.random.default_rng(0).normal(size=21))


def test_with_the_last_biases_alone_it_is_the_sine_basis() -> None:
    """For any observation."""
    policy, basis = PolicyNetwork(hidden=5), SineBasis()
    weights = basis.initial(np.random.default_rng(1), 2)
    params = np.zeros(policy.parameter_count(2, len(FELT)))
    params[-len(weights) :] = weights
    expected = basis.actuation(torch.as_tensor(weights)[None], torch.tensor([0.3], dtype=torch.float64), 2)[0, 0]
    found = policy.response(torch.as_tensor(params), 0.3, FELT, 2)
    np.testing.assert_array_equal(found.numpy(), expected.numpy())


def test_it_is_the_network_that_torch_builds() -> None:
    """Weights and biases by layers in torch's order; the outputs are clipped."""
    policy = PolicyNetwork(hidden=5)
    seen = with_phase(FELT, 0.1)
    layers = torch.nn.Sequential(
        torch.nn.Linear(len(seen), 5), torch.nn.Tanh(), torch.nn.Linear(5, 5), torch.nn.Tanh(), torch.nn.Linear(5, 18)
    ).double()
    params = torch.as_tensor(np.random.default_rng(2).normal(size=policy.parameter_count(2, len(FELT))))
    torch.nn.utils.vector_to_parameters(params, layers.parameters())
    expected = layers(seen).clamp(-1.0, 1.0)
    assert (expected.abs() == 1.0).any()
    torch.testing.assert_close(policy.action(params, seen, 2), expected, rtol=1e-12, atol=1e-12)


def test_the_phase_tells_where_the_waves_are() -> None:
    """Sine and cosine of 20 rad/s times the time follow the observation."""
    seen = with_phase(FELT, 0.7)
    np.testing.assert_array_equal(seen[:-2].numpy(), FELT.numpy())
    assert seen[-2:].tolist() == pytest.approx([math.sin(14.0), math.cos(14.0)])
