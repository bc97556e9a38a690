"""Adam of our own against torch's."""

import numpy as np
import torch

from zoobench.methods.adam import Adam
from zoobench.methods.base import pack, unpack


def _gradients(count: int) -> list[torch.Tensor]:
    """Of lengths from 1e-12 to 1e3, some zero."""
    rng = np.random.default_rng(0)
    scales = 10.0 ** rng.uniform(-12.0, 3.0, size=(count, 1))
    values = rng.standard_normal((count, 37)) * scales * (rng.random((count, 37)) > 0.1)
    return [torch.from_numpy(value) for value in values]


def test_its_steps_are_those_of_torch_bit_for_bit() -> None:
    """For 300 steps with gradients of any length; an interruption in between changes nothing."""
    start = torch.from_numpy(np.random.default_rng(1).standard_normal(37))
    point, peer = start.clone(), start.clone().requires_grad_()
    ours, theirs = Adam(0.03), torch.optim.Adam([peer], lr=0.03)
    for number, gradient in enumerate(_gradients(300)):
        ours.step(point, gradient)
        peer.grad = gradient
        theirs.step()
        assert torch.equal(point, peer.detach())
        if number % 100 == 50:
            ours = Adam.from_state(0.03, unpack(pack({"adam": ours.state()}))["adam"])
    assert not torch.equal(point, start)


def test_it_goes_on_from_what_torch_has_stored() -> None:
    """A run that was interrupted when it used torch's."""
    peer = torch.zeros(37, dtype=torch.float64, requires_grad=True)
    theirs = torch.optim.Adam([peer], lr=0.1)
    gradients = _gradients(20)
    for gradient in gradients[:10]:
        peer.grad = gradient
        theirs.step()
    point = peer.detach().clone()
    ours = Adam.from_state(0.1, theirs.state_dict()["state"][0])
    for gradient in gradients[10:]:
        ours.step(point, gradient)
        peer.grad = gradient
        theirs.step()
    assert torch.equal(point, peer.detach())


def test_before_the_first_step_there_is_no_state() -> None:
    """And from none it begins anew."""
    assert Adam(0.1).state() == {}
    point = torch.zeros(2, dtype=torch.float64)
    Adam.from_state(0.1, {}).step(point, torch.tensor([3.0, -1e-3], dtype=torch.float64))
    np.testing.assert_allclose(point.numpy(), [-0.1, 0.1], rtol=1e-4)
