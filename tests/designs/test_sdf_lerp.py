"""SDF-Lerp: the ends of the simplex, the volume between them, mean lines, and gradients."""

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from tests.designs.test_mixture import COUNT, ORCA, TUNA, mixture, workspace
from zoobench.designs.sdf_lerp import mean_line, sdf_lerp

SPACE = sdf_lerp()


def lines(count: int, size: int, seed: int = 0) -> torch.Tensor:
    """Random unit vectors `[count, size, 3]`."""
    drawn = np.random.default_rng(seed).normal(size=(count, size, 3))
    return torch.as_tensor(drawn / np.linalg.norm(drawn, axis=2, keepdims=True))


@pytest.mark.parametrize("end", [0, *(pytest.param(end, marks=pytest.mark.slow) for end in range(1, COUNT))])
def test_an_end_of_the_simplex_is_a_primitive(end: int) -> None:
    """Exactly its particles, its tissues, and its volume within 5 %."""
    body, tissues = workspace(64), SPACE.primitives.tissues(workspace(64))
    form = mixture(SPACE, np.eye(COUNT)[end], 64)
    np.testing.assert_array_equal(form.occupancy[0] > 0.5, tissues.distances[end] < 0.0)
    volume = (form.occupancy[0].numpy() * body.volumes).sum()
    assert volume == pytest.approx(SPACE.primitives.volumes[end], rel=0.05)
    np.testing.assert_allclose(form.stiffness[0], tissues.stiffness[end], atol=1e-12)
    np.testing.assert_allclose(form.muscle_membership[0], tissues.membership[end], atol=1e-12)
    along = (form.fibres[0] * tissues.fibres[end]).sum(dim=1).abs()
    np.testing.assert_allclose(along, 1.0, atol=1e-9)


@pytest.mark.slow
def test_volume_is_lost_between_primitives() -> None:
    """Half way from orca to tuna, fins that do not overlap vanish: more than 5 % of the mean volume."""
    weights = np.zeros(COUNT)
    weights[[ORCA, TUNA]] = 0.5
    volume = (mixture(SPACE, weights, 128).occupancy[0].numpy() * workspace(128).volumes).sum()
    assert volume < 0.95 * weights @ SPACE.primitives.volumes


def test_the_mean_line_is_the_chordal_mean_of_half_turns() -> None:
    """Against SciPy's mean of rotations, with random lines and weights."""
    directions = lines(4, 50)
    weights = np.array([0.4, 0.1, 0.2, 0.3])
    found = mean_line(torch.as_tensor(weights), directions)
    np.testing.assert_allclose(found.norm(dim=1), 1.0, rtol=1e-12)
    for n in range(50):
        theirs = Rotation.from_rotvec(np.pi * directions[:, n].numpy()).mean(weights).as_rotvec()
        assert abs(theirs @ found[n].numpy()) == pytest.approx(np.pi, rel=1e-9)


def test_the_sign_of_a_line_has_no_influence() -> None:
    """The same mean from d and from -d, bit for bit."""
    directions = lines(3, 20)
    weights = torch.tensor([0.5, 0.3, 0.2], dtype=torch.float64)
    senses = torch.as_tensor(np.random.default_rng(1).choice([-1.0, 1.0], size=(3, 20, 1)))
    torch.testing.assert_close(mean_line(weights, senses * directions), mean_line(weights, directions), rtol=0, atol=0)


def test_half_way_between_two_lines() -> None:
    """Equal weights bisect the smaller angle."""
    angle = np.radians(70.0)
    two = torch.tensor([[[1.0, 0.0, 0.0]], [[-np.cos(angle), -np.sin(angle), 0.0]]], dtype=torch.float64)
    found = mean_line(torch.tensor([0.5, 0.5], dtype=torch.float64), two)[0]
    assert abs(found @ torch.tensor([np.cos(angle / 2), np.sin(angle / 2), 0.0])) == pytest.approx(1.0, abs=1e-12)


def test_the_gradient_of_a_mean_line_is_right() -> None:
    """By the weights, at the ends of the simplex, too."""
    directions = lines(3, 6)
    for weights in ([0.5, 0.3, 0.2], [1.0, 0.0, 0.0]):
        free = torch.tensor(weights, dtype=torch.float64, requires_grad=True)
        assert torch.autograd.gradcheck(lambda w: mean_line(w, directions), free)


def test_lines_at_right_angles_have_a_finite_gradient() -> None:
    """There is no nearest line; the gradient is bounded."""
    free = torch.tensor([0.5, 0.5], dtype=torch.float64, requires_grad=True)
    mean_line(free, torch.eye(3, dtype=torch.float64)[:2, None]).sum().backward()
    assert free.grad is not None
    assert torch.isfinite(free.grad).all()
