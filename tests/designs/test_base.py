"""Sampling of shapes: the mass does not depend on the lattice."""

import numpy as np
import pytest

from zoobench.designs import base
from zoobench.designs.block import Block
from zoobench.designs.caterpillar import Caterpillar
from zoobench.designs.sampling import Shape
from zoobench.errors import SceneError
from zoobench.sim.model.fidelity import Fidelity

BALL = Shape(
    inside=lambda points: ((points - (0.0, 0.03, 0.0)) ** 2).sum(axis=1) <= 0.03**2,
    lower=(-0.03, 0.0, -0.03),
    upper=(0.03, 0.06, 0.03),
    points=2_000_000,
)


def test_the_measured_volume_is_the_closed_form() -> None:
    """4/3 pi r^3 for a ball."""
    assert BALL.volume() == pytest.approx(4 / 3 * np.pi * 0.03**3, rel=1e-3)


@pytest.mark.parametrize(
    "particles_per_cell", [1, 4, *(pytest.param(count, marks=pytest.mark.slow) for count in (8, 27))]
)
def test_particles_share_the_true_volume(particles_per_cell: int) -> None:
    """The volumes sum up to the ball's, and inside it each is the cell's share."""
    spacing = 1 / 160
    volumes = BALL.sample(Fidelity(spacing, particles_per_cell=particles_per_cell)).volumes
    assert volumes.sum() == pytest.approx(4 / 3 * np.pi * 0.03**3, rel=1e-3)
    assert np.isclose(volumes, spacing**3 / particles_per_cell).mean() > 0.3


def test_a_symmetric_shape_is_sampled_symmetrically() -> None:
    """The mirror image is the same set of particles."""
    positions = BALL.sample(Fidelity(1 / 64)).positions
    mirrored = positions * (1.0, 1.0, -1.0)
    assert {tuple(p) for p in np.round(positions, 9) + 0.0} == {tuple(p) for p in np.round(mirrored, 9) + 0.0}


def test_a_shape_too_small_for_the_grid_is_refused() -> None:
    """The message has the size in plain numbers, and the remedy."""
    speck = Shape(inside=lambda points: np.zeros(len(points), bool), lower=(0, 0, 0), upper=(0.001, 0.001, 0.001))
    with pytest.raises(SceneError, match=r"A body of 0\.001 x 0\.001 x 0\.001 m .*finer fidelity"):
        speck.sample(Fidelity(1 / 64))


@pytest.mark.parametrize("design", [Block(), Caterpillar()], ids=["block", "caterpillar"])
def test_an_odd_lattice_keeps_left_and_right_alike(design: Block | Caterpillar) -> None:
    """Particles on the middle plane belong to both sides equally."""
    body = design.body(Fidelity(1 / 64, particles_per_cell=27))
    amount = dict(zip(body.muscles, body.muscle_membership.sum(axis=0), strict=True))
    for muscle, found in amount.items():
        assert found == pytest.approx(amount[muscle.replace("left", "right")])


@pytest.mark.parametrize("make", [Block, pytest.param(Caterpillar, marks=pytest.mark.slow)])
def test_a_body_is_sampled_once_for_a_lattice(
    make: type[Block] | type[Caterpillar], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is that of a design of its own; what does not change the lattice does not change the body."""
    design = make()
    body, finer = design.body(Fidelity(1 / 32)), design.body(Fidelity(1 / 40))
    assert design.body(Fidelity(1 / 32, precision=64, courant=0.3, transfer="aflip")) is body
    assert design.body(Fidelity(1 / 40)) is finer
    coarser = design.body(Fidelity(1 / 32, particles_per_cell=1))
    assert coarser.particle_count < body.particle_count < finer.particle_count
    np.testing.assert_array_equal(make().body(Fidelity(1 / 40)).positions, finer.positions)
    monkeypatch.setattr(base, "_MOST_KEPT", finer.particle_count)
    other = design.body(Fidelity(1 / 20, particles_per_cell=1))
    assert design.body(Fidelity(1 / 20, particles_per_cell=1)) is other
    assert design.body(Fidelity(1 / 32)) is not body, "no more than so many particles are kept"
    monkeypatch.setattr(base, "_MOST_KEPT", 0)
    large = Fidelity(1 / 24, particles_per_cell=1)
    assert design.body(large) is not design.body(large)
