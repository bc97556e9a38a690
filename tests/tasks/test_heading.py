"""The heading of rigid and deformed bodies whose rotation is known."""

import dataclasses
import math

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tests.tasks.motions import block, disc, motion, yaw
from zoobench.tasks.heading import heading, heading_error, rotation

_COMPONENTS = st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: sum(x * x for x in q) > 0.01)
_DEVIATION = torch.tensor([[0.0, 0.5, 0.2], [-0.1, 0.0, 0.3], [0.4, -0.6, 0.0]], dtype=torch.float64)


@settings(deadline=None)
@given(quaternion=_COMPONENTS, shift=st.tuples(*[st.floats(-2.0, 2.0)] * 3))
def test_the_heading_turns_with_a_rigid_body(quaternion: tuple[float, ...], shift: tuple[float, float, float]) -> None:
    """For any rotation and translation, to 1e-6, for a flat disc and a solid body."""
    turn = torch.from_numpy(Rotation.from_quat(quaternion).as_matrix())
    for rest in (block(count=3), disc(rings=1, spokes=6)):
        moved = rest @ turn.T + torch.tensor(shift, dtype=torch.float64)
        found = heading(motion(rest, torch.stack([rest, moved])))[:, 0]
        torch.testing.assert_close(found[0], torch.tensor([1.0, 0.0, 0.0]).double(), atol=1e-6, rtol=0.0)
        torch.testing.assert_close(found[1], turn[:, 0], atol=1e-6, rtol=0.0)


def test_half_turns_and_reflections_give_rotations() -> None:
    """Half turns about all axes, and a flattened, mirrored body."""
    for axis in ([0, 0, 1], [0, 1, 0], [1, 0, 0]):
        turn = torch.from_numpy(Rotation.from_rotvec(np.pi * np.array(axis)).as_matrix())
        torch.testing.assert_close(rotation(turn), turn, atol=1e-12, rtol=0.0)
    assert torch.linalg.det(rotation(torch.diag(torch.tensor([3.0, 2.0, -1.0]).double()))).item() == pytest.approx(1.0)


def test_a_rotation_alone_has_the_bits_that_it_has_among_others() -> None:
    """One matrix is worked on as plain numbers, many as arrays."""
    moments = torch.from_numpy(np.random.default_rng(2).normal(size=(7, 1, 3, 3)))
    torch.testing.assert_close(rotation(moments[4:5]), rotation(moments)[4:5], atol=0.0, rtol=0.0)


def test_deformation_without_rotation_is_no_turn() -> None:
    """Stretching does not change the heading; a shear rotates it by half its angle."""
    rest = block()
    stretched = rest * torch.tensor([1.3, 0.7, 0.9])
    assert heading(motion(rest, torch.stack([rest, stretched])))[1, 0].tolist() == pytest.approx([1.0, 0.0, 0.0])
    turned = stretched @ yaw(0.4).T
    found = heading(motion(rest, torch.stack([rest, turned])))[1, 0]
    assert found.tolist() == pytest.approx([math.cos(0.4), 0.0, -math.sin(0.4)])


def test_only_labelled_particles_with_mass_count() -> None:
    """Particles without label, and empty particles of the head, have no influence."""
    rest = block()
    path = torch.stack([rest, rest @ yaw(0.3).T])
    labelled = motion(rest, path)
    head = int(labelled.head.nonzero()[0])
    path[1, (labelled.head + labelled.tail) == 0] += 1.0
    path[1, head] -= 5.0
    masses = torch.ones(1, len(rest), dtype=torch.float64)
    masses[0, head] = 0.0
    found = heading(dataclasses.replace(labelled, positions=path[:, None], masses=masses))[1, 0]
    assert found.tolist() == pytest.approx([math.cos(0.3), 0.0, -math.sin(0.3)])


def test_without_a_labelled_particle_there_is_no_heading() -> None:
    """It is NaN, which no method takes as a score."""
    rest = block()
    empty = motion(rest, torch.stack([rest, rest]))
    masses = 1.0 - (empty.head + empty.tail)[None]
    assert heading(dataclasses.replace(empty, masses=masses)).isnan().all()


def test_labels_on_a_line_still_point() -> None:
    """With one particle each of head and tail, value and gradient are finite."""
    rest = torch.tensor([[0.05, 0.0, 0.0], [-0.05, 0.0, 0.0]], dtype=torch.float64)
    path = torch.stack([rest, rest @ yaw(1.2).T]).requires_grad_()
    found = heading(motion(rest, path))
    (gradient,) = torch.autograd.grad(found[1, 0, 2], path)
    assert found[1, 0].tolist() == pytest.approx([math.cos(1.2), 0.0, -math.sin(1.2)])
    # the head moved to the right by d turns the robot by d / 0.1 m
    assert gradient[1, 0, 2].item() == pytest.approx(math.cos(1.2) ** 2 / 0.1)


@pytest.mark.parametrize(
    "singular",
    [(1.0, 1.0, 1.0), (2.0, 1.0, 1.0), (2.0, 2.0, 1.0), (3.0, 1.0, 0.0), (3.0, 2.0, 1.0), (3.0, 2.0, -1.0)],
)
def test_the_gradient_of_the_rotation_is_exact(singular: tuple[float, float, float]) -> None:
    """Against finite differences, also at equal singular values, for flat and for mirrored bodies."""
    turns = [torch.from_numpy(Rotation.from_rotvec(vector).as_matrix()) for vector in ([0.3, -0.8, 0.5], [1, 1, 0])]
    moments = turns[0] @ torch.diag(torch.tensor(singular).double()) @ turns[1]
    assert torch.autograd.gradcheck(rotation, (moments.requires_grad_(),))


def test_the_gradient_of_the_heading_is_exact() -> None:
    """Against finite differences, in the positions of a rotated and bent body."""
    rest = block(count=2)
    path = torch.stack([rest, rest @ (yaw(0.5).T + 0.3 * _DEVIATION)]).requires_grad_()
    assert torch.autograd.gradcheck(lambda positions: heading(motion(rest, positions)), (path,))


def test_the_heading_error_is_a_level_angle() -> None:
    """0.4 rad to the left or right of a target are 0.4 rad; pitching does not count."""
    rest = block()
    for angle in (0.4, -0.4, 3.0):
        turned = motion(rest, torch.stack([rest, rest @ yaw(angle).T]))
        assert heading_error(turned, torch.tensor([7.0, 0.0, 0.0])).item() == pytest.approx(abs(angle))
    pitch = torch.from_numpy(Rotation.from_rotvec([0.0, 0.0, 0.5]).as_matrix())
    nodding = motion(rest, torch.stack([rest, rest @ pitch.T]))
    assert heading_error(nodding, torch.tensor([1.0, 0.0, 0.0])).item() == pytest.approx(0.0, abs=1e-12)
