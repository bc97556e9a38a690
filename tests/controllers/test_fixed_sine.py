"""The fixed sine: a draw of the sine basis without parameters."""

import numpy as np
import torch

from zoobench.controllers.fixed_sine import FixedSine
from zoobench.controllers.sine_basis import SineBasis

TIMES = torch.arange(30, dtype=torch.float64) * 0.008


def test_it_is_a_draw_of_the_sine_basis() -> None:
    """The activity of the basis with the weights of the seed, in every world."""
    activity = FixedSine(seed=3).actuation(torch.zeros(2, 0, dtype=torch.float64), TIMES, 4)
    weights = SineBasis().initial(np.random.default_rng(3), 4)
    assert torch.equal(activity, SineBasis().actuation(torch.tensor(np.array([weights, weights])), TIMES, 4))
    assert activity.abs().mean() > 0.1


def test_seeds_give_different_waves() -> None:
    """Equal seeds give equal ones."""
    none = torch.zeros(1, 0, dtype=torch.float64)
    first, again, other = (FixedSine(seed=seed).actuation(none, TIMES, 2) for seed in (0, 0, 1))
    assert torch.equal(first, again)
    assert not torch.allclose(first, other, atol=0.1)


def test_it_has_no_parameters_and_an_empty_gradient() -> None:
    """The gradient has length 0."""
    controller = FixedSine()
    assert controller.parameter_count(5) == 0
    assert controller.initial(np.random.default_rng(0), 5).shape == (0,)
    none = torch.zeros(2, 0, dtype=torch.float64, requires_grad=True)
    (gradient,) = torch.autograd.grad(controller.actuation(none, TIMES, 5).sum(), none)
    assert gradient.shape == (2, 0)
