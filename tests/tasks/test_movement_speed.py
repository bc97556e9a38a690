"""Movement speed against closed forms."""

import dataclasses
import math

import pytest
import torch

from tests.tasks.motions import disc, rigid
from zoobench.tasks.movement_speed import MovementSpeed


def test_a_translating_body_scores_its_speed() -> None:
    """Only the component along the target counts."""
    motion = rigid(disc(), spin=0.0, velocity=(0.3, -1.0, 0.2))
    assert MovementSpeed().score(motion).item() == pytest.approx(0.3)
    assert MovementSpeed(heading=-90.0).score(motion).item() == pytest.approx(0.2)
    assert MovementSpeed().reward(motion).squeeze(1).tolist() == pytest.approx([0.3] * 20)


def test_spinning_on_the_spot_scores_nothing() -> None:
    """The mean velocity of a spinning disc is zero."""
    assert MovementSpeed().score(rigid(disc(), spin=10.0, velocity=(0.0, 0.0, 0.0))).item() == pytest.approx(0.0)


def test_looking_away_from_the_target_is_measured() -> None:
    """A robot that rotates uniformly by 0.8 rad has half of that, and of a frame's angle, as its mean error."""
    metrics = MovementSpeed().metrics(rigid(disc(), spin=5.0, velocity=(0.3, -1.0, 0.4)))
    assert metrics["heading_error"][0].item() == pytest.approx(5.0 * 0.008 * (1 + 20) / 2)
    aside = MovementSpeed(heading=-30.0).metrics(rigid(disc(), spin=0.0, velocity=(0.0, 0.0, 0.0)))
    assert aside["heading_error"][0].item() == pytest.approx(math.radians(30.0))


def test_particles_without_mass_do_not_exist() -> None:
    """The velocity of a massless particle has no influence."""
    motion = rigid(disc(), spin=0.0, velocity=(0.3, 0.0, 0.0))
    motion.velocities[:, :, 0] = 1e6
    motion.masses[:, 0] = 0.0
    assert MovementSpeed().score(motion).item() == pytest.approx(0.3)


def test_existing_particles_count_alike() -> None:
    """The mean is over particles and not over mass (A.1)."""
    motion = rigid(disc(rings=1, spokes=2), spin=0.0, velocity=(0.0, 0.0, 0.0))
    motion.velocities[:, 0, 0, 0] = 1.0
    heavy = dataclasses.replace(motion, masses=torch.tensor([[9.0, 1.0]], dtype=torch.float64))
    assert MovementSpeed().score(heavy).item() == pytest.approx(0.5)
