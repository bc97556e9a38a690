"""Observations."""

import math

import numpy as np
import pytest
import torch

from zoobench.cell.observation import ObservationModel
from zoobench.controllers.base import observation_count
from zoobench.designs.caterpillar import Caterpillar
from zoobench.sim.model.fidelity import Fidelity

BODY = Caterpillar().body(Fidelity(1 / 64))
REST = torch.as_tensor(BODY.positions)
WHOLE = torch.ones(BODY.particle_count, dtype=torch.float64)


def _turn(angle: float) -> torch.Tensor:
    """Counter-clockwise seen from above, by `angle` [rad]."""
    c, s = math.cos(angle), math.sin(angle)
    return torch.tensor([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]], dtype=torch.float64)


def test_a_body_at_rest_observes_its_heading_only() -> None:
    """Zeros, and a heading of 1 and 0."""
    seen = ObservationModel(BODY).observe(REST, torch.zeros_like(REST), REST, WHOLE).numpy()
    assert len(seen) == observation_count(BODY.muscle_count)
    assert seen[6:8] == pytest.approx([1.0, 0.0], abs=1e-9)
    assert np.delete(seen, [6, 7]) == pytest.approx(0.0, abs=1e-9)


def test_a_rigid_rotation_changes_heading_and_displacement_only() -> None:
    """Velocities and muscles are observed in the body's frame."""
    rng = np.random.default_rng(0)
    positions = REST + torch.as_tensor(0.002 * rng.normal(size=REST.shape))
    velocities = torch.as_tensor(0.1 * rng.normal(size=REST.shape))
    turn, model = _turn(0.7), ObservationModel(BODY)
    before = model.observe(positions, velocities, positions, WHOLE)
    after = model.observe(positions @ turn.T, velocities @ turn.T, positions @ turn.T, WHOLE)
    np.testing.assert_allclose(after[[0, 1, 2]], before[[0, 1, 2]], atol=1e-9)
    np.testing.assert_allclose(after[8:], before[8:], atol=1e-9)
    angles = [math.atan2(float(seen[7]), float(seen[6])) for seen in (before, after)]
    assert angles[1] - angles[0] == pytest.approx(0.7, abs=1e-6)


def test_velocity_and_displacement_are_those_of_the_centre_of_mass() -> None:
    """In units of the body length L and of 20 L/s; muscles do not observe a common motion."""
    shift = torch.tensor([0.03, 0.01, -0.02], dtype=torch.float64)
    seen = ObservationModel(BODY).observe(REST + shift, torch.zeros_like(REST) + shift, REST, WHOLE).numpy()
    length = float(np.ptp(BODY.positions[:, 0]))
    assert seen[:3] == pytest.approx(shift.numpy() / (20.0 * length))
    assert seen[3:6] == pytest.approx(shift.numpy() / length)
    assert seen[8:] == pytest.approx(0.0, abs=1e-9)


def test_empty_particles_are_not_observed() -> None:
    """A particle without occupancy may be anywhere, and an empty muscle is at rest."""
    gone = torch.as_tensor((BODY.muscle_membership[:, 0] == 0.0).astype(np.float64))
    wild = torch.where(gone[:, None] > 0, REST, 1e3 * torch.ones_like(REST))
    model = ObservationModel(BODY)
    seen = model.observe(wild, torch.zeros_like(REST), REST, gone)
    assert torch.isfinite(seen).all()
    np.testing.assert_allclose(seen, model.observe(REST, torch.zeros_like(REST), REST, gone), atol=1e-9)


def test_the_derivative_is_right_on_a_robot_that_stands_on_its_head() -> None:
    """It is finite where the horizontal heading has no direction."""
    stand = torch.tensor([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], dtype=torch.float64)
    positions = (REST @ stand.T).requires_grad_()
    model = ObservationModel(BODY)
    seen = model.observe(positions, torch.zeros_like(REST), REST, WHOLE)
    (gradient,) = torch.autograd.grad(seen.sum(), positions)
    assert torch.isfinite(gradient).all()
