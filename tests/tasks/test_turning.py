"""Turning against closed forms."""

import dataclasses
import math

import pytest
import torch

from tests.tasks.motions import disc, rigid
from zoobench.tasks.turning import Turning, net_rotation


def test_a_spinning_disc_scores_its_mean_tangential_velocity() -> None:
    """Rings at r = R/5 ... R with equal numbers of particles: omega times the mean radius, 0.6 R."""
    motion = rigid(disc(radius=0.05), spin=7.0, velocity=(0.4, 0.1, -0.2))
    assert Turning().score(motion).item() == pytest.approx(7.0 * 0.6 * 0.05, rel=1e-12)


def test_clockwise_is_negative() -> None:
    """The sign follows the right-hand rule about the upward direction."""
    assert Turning().score(rigid(disc(), spin=-7.0, velocity=(0.0, 0.0, 0.0))).item() < 0.0


def test_pure_translation_scores_nothing() -> None:
    """A symmetric body that translates does not rotate."""
    assert Turning().score(rigid(disc(), 0.0, (0.5, 0.0, 0.1))).item() == pytest.approx(0.0, abs=1e-12)


def test_the_net_angle_goes_past_half_turns() -> None:
    """The angle is the sum over frames: three quarters of a turn and more are positive."""
    motion = rigid(disc(), spin=40.0, velocity=(0.3, 0.0, 0.0), frames=50)
    assert net_rotation(motion).item() == pytest.approx(40.0 * 50 * 0.008)
    assert 2 * math.pi < 40.0 * 50 * 0.008
    assert Turning().metrics(motion)["heading_angle"][1] == "rad"


def test_a_particle_on_the_axis_passes_a_finite_gradient() -> None:
    """At r = 0 there is no tangent: value and gradient are finite, and others are unaffected."""
    motion = rigid(disc(on_axis=True), spin=7.0, velocity=(0.0, 0.0, 0.0))
    positions = motion.positions.clone().requires_grad_()
    velocities = motion.velocities.clone().requires_grad_()
    score = Turning().objective(dataclasses.replace(motion, positions=positions, velocities=velocities))
    slopes = torch.autograd.grad(score.sum(), (positions, velocities))
    assert all(bool(torch.isfinite(gradient).all()) for gradient in slopes)
    assert score.item() == pytest.approx(7.0 * 0.6 * 0.05 * 60 / 61)
