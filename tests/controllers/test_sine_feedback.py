"""The sine basis in a closed loop."""

import numpy as np
import torch

from zoobench.controllers.sine_basis import SineBasis
from zoobench.controllers.sine_feedback import SineFeedback

SEEN = torch.as_tensor(np.random.default_rng(0).normal(size=27))


def test_without_a_network_it_is_the_sine_basis() -> None:
    """The first parameters are those of the basis."""
    basis = SineBasis().initial(np.random.default_rng(1), 3)
    params = torch.zeros(SineFeedback().parameter_count(3, len(SEEN)), dtype=torch.float64)
    params[: len(basis)] = torch.as_tensor(basis)
    expected = SineBasis().actuation(torch.as_tensor(basis)[None], torch.tensor([0.4], dtype=torch.float64), 3)[0, 0]
    torch.testing.assert_close(SineFeedback().response(params, 0.4, SEEN, 3), expected)


def test_the_network_is_the_formula() -> None:
    """w + V tanh(U o + c), with matrices row by row."""
    rng, hidden, seen = np.random.default_rng(2), 2, 15
    w, v, u, c = rng.normal(size=9), rng.normal(size=(9, hidden)), rng.normal(size=(hidden, seen)), rng.normal(size=2)
    felt = rng.normal(size=seen)
    params = torch.as_tensor(np.concatenate([w, v.ravel(), u.ravel(), c]))
    weights = torch.as_tensor(w + v @ np.tanh(u @ felt + c))[None]
    expected = SineBasis().actuation(weights, torch.tensor([0.1], dtype=torch.float64), 1)[0, 0]
    found = SineFeedback(hidden=hidden).response(params, 0.1, torch.as_tensor(felt), 1)
    torch.testing.assert_close(found, expected)


def test_it_starts_near_the_open_loop() -> None:
    """A draw differs from its open loop by less than the open loop's activity."""
    params = torch.as_tensor(SineFeedback().initial(np.random.default_rng(3), 3, len(SEEN)))
    closed = SineFeedback().response(params, 0.3, SEEN, 3)
    open_loop = SineBasis().actuation(params[None, :27], torch.tensor([0.3], dtype=torch.float64), 3)[0, 0]
    assert 0.0 < (closed - open_loop).abs().max() < 0.5 * open_loop.abs().max()
