"""The caterpillar: size, mass, muscles and labels at every resolution."""

from functools import cache

import numpy as np
import pytest

from zoobench import registry
from zoobench.designs.caterpillar import Caterpillar
from zoobench.errors import SceneError, UsageError
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.spec import Ref


@cache
@cache
def _true_volume() -> float:
    """By counting [m^3]."""
    lattice = (np.indices((250, 125, 125)).reshape(3, -1).T + 0.5) * 0.0004 + (-0.05, 0.0, -0.025)
    return float(Caterpillar().shape.inside(lattice).sum() * 0.0004**3)


@pytest.mark.parametrize("spacing", [1 / 64, *(pytest.param(1 / n, marks=pytest.mark.slow) for n in (40, 100, 128))])
@pytest.mark.parametrize(
    "particles_per_cell", [1, 4, *(pytest.param(count, marks=pytest.mark.slow) for count in (8, 27))]
)
def test_the_mass_does_not_depend_on_the_sampling(spacing: float, particles_per_cell: int) -> None:
    """Density times true volume within 1 %, against a finer count than the design's own."""
    true_mass = 1000.0 * _true_volume()
    body = Caterpillar().body(Fidelity(spacing, particles_per_cell=particles_per_cell))
    assert body.masses(1000.0).sum() == pytest.approx(true_mass, rel=0.01)


def test_it_has_its_size() -> None:
    """0.10 x 0.05 x 0.05 m within a particle spacing, above the ground, and at least three cells across at 1/64 m."""
    fidelity = Fidelity(1 / 64)
    positions = Caterpillar().body(fidelity).positions
    assert positions[:, 1].min() >= 0.0
    extent = np.ptp(positions, axis=0) + fidelity.grid_spacing / 2
    assert extent == pytest.approx([0.1, 0.05, 0.05], abs=fidelity.grid_spacing / 2)
    assert (extent >= 2.95 * fidelity.grid_spacing).all()


def test_muscles_share_out_every_particle() -> None:
    """Ten muscles with shares that sum up to 1, unit fibres, and equal sides."""
    body = Caterpillar().body(Fidelity(1 / 64))
    assert len(set(body.muscles)) == body.muscle_membership.shape[1] == 10
    assert body.muscle_membership.sum(axis=1) == pytest.approx(1.0)
    assert np.linalg.norm(body.fibres, axis=1) == pytest.approx(1.0)
    amount = dict(zip(body.muscles, body.muscle_membership.sum(axis=0), strict=True))
    for name in body.muscles:
        assert amount[name] == pytest.approx(amount[name.replace("left", "right")])


def test_the_head_is_in_front_of_the_tail() -> None:
    """The labels define the heading."""
    body = Caterpillar().body(Fidelity(1 / 64))
    assert body.positions[body.head, 0].min() > body.positions[body.tail, 0].max()
    assert body.head.sum() == body.tail.sum() > 0


def test_a_size_of_zero_is_refused() -> None:
    """With the remedy."""
    with pytest.raises(UsageError, match="positive"):
        Caterpillar(width=0.0)


@pytest.mark.parametrize(
    "name", ["caterpillar[height=0.001,length=0.002,width=0.001]", "block[height=0.01,length=0.015,width=0.01]",
             "panda[length=0.015]", "tuna[length=0.015]"]
)  # fmt: skip
def test_a_body_shorter_than_a_cell_is_refused(name: str) -> None:
    """Of every design, with the remedy: one of four particles was scored."""
    with pytest.raises(SceneError, match=r"shorter than a cell of 0\.01562 m.*finer fidelity or a larger body"):
        registry.create(Kind.DESIGN, Ref.parse(name)).body(Fidelity(1 / 64))
