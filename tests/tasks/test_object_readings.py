"""Axes of objects, and what a closed loop sees of them."""

import math

import pytest
import torch

from tests.tasks.motions import block, carried, yaw
from zoobench.tasks.base import ObjectState, Situation, axes_of
from zoobench.tasks.object_readings import OBJECT_PARTS, object_readings, object_seen, object_tilt

REST = block(count=5)
SHARE = torch.full((len(REST),), 1.0 / len(REST), dtype=torch.float64)


def _rotation(seed: int) -> torch.Tensor:
    """A random rotation."""
    made = torch.linalg.qr(torch.randn(3, 3, dtype=torch.float64, generator=torch.Generator().manual_seed(seed)))[0]
    return made * torch.linalg.det(made)


@pytest.mark.parametrize("seed", range(4))
def test_axes_are_those_of_an_exact_rotation(seed: int) -> None:
    """Wherever the body is, and whatever its particles weigh."""
    turn = _rotation(seed)
    weights = torch.rand(len(REST), dtype=torch.float64, generator=torch.Generator().manual_seed(9))
    for share in (SHARE, weights / weights.sum()):
        found = axes_of(REST @ turn.T + torch.tensor([3.0, -1.0, 0.5]), REST + 0.2, share)
        torch.testing.assert_close(found, turn.T, rtol=0.0, atol=1e-10)


def test_axes_are_unit_vectors_of_a_strained_body() -> None:
    """And perpendicular to each other, the first along its own image."""
    strain = torch.eye(3, dtype=torch.float64) + 0.1 * torch.tensor([[0, 1, 0], [0, 0, 2], [0.5, 0, 0]])
    found = axes_of(REST @ strain.T, REST, SHARE)
    torch.testing.assert_close(found @ found.T, torch.eye(3, dtype=torch.float64), rtol=0.0, atol=1e-12)
    torch.testing.assert_close(found[0], strain[:, 0] / strain[:, 0].norm(), rtol=0.0, atol=1e-12)


def test_axes_are_differentiable() -> None:
    """By the positions, against finite differences."""
    places = (REST[:6] @ _rotation(1).T).requires_grad_()
    assert torch.autograd.gradcheck(lambda x: axes_of(x, REST[:6], torch.full((6,), 1 / 6).double()), (places,))


def test_what_is_seen_turns_with_the_robot() -> None:
    """A robot that is turned with everything around it sees the same."""
    thing = ObjectState(
        *(torch.tensor([x, 0.1, z]).double() for x, z in ((0.2, 0.1), (0.3, 0.1), (0.5, -0.2))), _rotation(2)
    )
    centre, ahead, right = (torch.tensor(each).double() for each in ([0.1, 0.0, 0.2], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]))
    seen = object_seen(Situation(0.5, centre, centre, ahead, right, 0.1, {"object": thing}))
    assert seen.keys() == OBJECT_PARTS.keys()
    assert seen["object_place"].tolist() == pytest.approx([2.0, 1.0, -1.0])
    assert seen["object_velocity"].tolist() == pytest.approx([0.25, 0.05, -0.1])
    assert seen["object_axes"].tolist() == pytest.approx(thing.axes[:2].reshape(-1).tolist())
    turn = yaw(1.1)
    moved = ObjectState(turn @ thing.start, turn @ thing.centre, turn @ thing.velocity, thing.axes @ turn.T)
    again = object_seen(Situation(0.5, centre, turn @ centre, turn @ ahead, turn @ right, 0.1, {"object": moved}))
    for name, values in seen.items():
        torch.testing.assert_close(again[name], values, rtol=0.0, atol=1e-12)


def test_an_upright_object_has_no_tilt_and_a_derivative() -> None:
    """The angle's root has one where it is zero."""
    made = carried([[0.0, 0.0, 0.0]] * 2)
    assert object_tilt(made)[:, 0].tolist() == pytest.approx([0.0, 0.0], abs=2e-9)
    assert object_readings(made)["object_tilt"][0].item() < math.radians(1e-6)
