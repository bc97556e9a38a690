"""The sine basis, term by term."""

import math

import numpy as np
import pytest
import torch

from zoobench.controllers.sine_basis import SineBasis

TIMES = torch.arange(30, dtype=torch.float64) * 0.008


def test_it_is_the_formula() -> None:
    """tanh of bias plus weighted sines of two frequencies and four phases, summed by hand."""
    rng = np.random.default_rng(3)
    params = rng.normal(size=(2, SineBasis().parameter_count(3)))
    activity = SineBasis().actuation(torch.as_tensor(params), TIMES, 3).numpy()
    for frame, world, muscle in [(0, 0, 0), (7, 1, 2), (29, 0, 1)]:
        time = frame * 0.008
        waves = [math.sin(w * time + 2 * math.pi * j / 4) for w in (20.0, 80.0) for j in range(4)]
        bias = params[world, 24 + muscle]
        drive = bias + sum(a * b for a, b in zip(params[world, 8 * muscle : 8 * muscle + 8], waves, strict=True))
        assert activity[frame, world, muscle] == pytest.approx(math.tanh(drive), rel=1e-12)


def test_the_range_holds_for_any_parameters() -> None:
    """Activity is in [-1, 1] for any weights."""
    params = torch.full((1, SineBasis().parameter_count(2)), 1e6, dtype=torch.float64)
    assert SineBasis().actuation(params, TIMES, 2).abs().max().item() <= 1.0


def test_the_prior_is_a_function_of_the_generator() -> None:
    """Equal seeds give equal draws; the scale is the weights' deviation, and biases are zero."""
    draws = [SineBasis(scale=0.5).initial(np.random.default_rng(1), 200) for _ in range(2)]
    np.testing.assert_array_equal(draws[0], draws[1])
    assert draws[0][:1600].std() == pytest.approx(0.5, rel=0.1)
    assert not draws[0][1600:].any()
