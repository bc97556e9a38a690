"""The primitives in their workspace: the box, their tissues inside and outside, and refused names."""

from functools import cache

import numpy as np
import pytest
import torch
from scipy.spatial import KDTree

from zoobench import registry
from zoobench.designs.anatomy import SWIMMER_LENGTH, Animal
from zoobench.designs.primitives import DEFAULT_PRIMITIVES, Primitives, simplex
from zoobench.errors import SceneError, UnknownNameError, UsageError
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.spec import Ref

SMOKE, DRAFT, PAPER = Fidelity(1 / 32), Fidelity(1 / 64), Fidelity(1 / 128)


@cache
def primitives(names: str = DEFAULT_PRIMITIVES, length: float = SWIMMER_LENGTH) -> Primitives:
    """The default primitives, cached."""
    return Primitives(names, length)


@pytest.mark.slow
@pytest.mark.parametrize("names", [DEFAULT_PRIMITIVES, "orca+panda", "baby-seal+fish+shark"])
def test_the_workspace_holds_every_primitive_with_room_to_spare(names: str) -> None:
    """It has particles beyond every primitive in every direction."""
    made = primitives(names)
    body = made.workspace(PAPER)
    assert body.malleable
    assert body.positions[:, 1].min() > 0.0
    tree = KDTree(body.positions)
    for animal in made.animals:
        own = animal.body(PAPER).positions
        shift = tree.query(own)[0]
        assert shift.max() <= body.edge / 2 * np.sqrt(3.0) + 1e-9
        assert (own.max(axis=0) < body.positions.max(axis=0)).all()
        assert (own.min(axis=0)[[0, 2]] > body.positions.min(axis=0)[[0, 2]]).all()


@pytest.mark.parametrize(
    "names",
    [DEFAULT_PRIMITIVES, *(pytest.param(names, marks=pytest.mark.slow) for names in ("orca+panda", "baby-seal+panda"))],
)
def test_the_workspace_fills_its_box_at_every_fidelity(names: str) -> None:
    """With equal particles in whole cells, the fewest that hold the box; an even number of them across the middle."""
    made = primitives(names)
    lower, upper = made.box
    for name in registry.names(Kind.FIDELITY):
        fidelity = registry.create(Kind.FIDELITY, Ref(name))
        body = made.workspace(fidelity)
        size = np.ptp(body.positions, axis=0) + body.edge
        room = (size - (upper - lower)) / fidelity.grid_spacing
        assert (room > -1e-9).all()
        assert (room < (1.0, 1.0, 2.0)).all()
        assert body.volumes.sum() == pytest.approx(size.prod(), rel=1e-9)
        assert (np.abs(body.positions[:, 2]) > 0.4 * body.edge).all()


def test_the_workspace_has_as_many_particles_in_a_cell_as_a_primitive() -> None:
    """27 with a swimmer among them, those of the fidelity without."""
    for names, count in ((DEFAULT_PRIMITIVES, 27), ("orca+panda", 27), ("baby-seal+panda", 8)):
        assert primitives(names).workspace(PAPER).volumes[0] == pytest.approx(PAPER.grid_spacing**3 / count)


def test_the_workspace_is_as_stiff_as_the_stiffest_fin() -> None:
    """The stiffness of a form is relative to it; the softest is the fin on the orca's back."""
    made = primitives()
    body = made.workspace(DRAFT)
    assert (body.stiffness == 2.0).all()
    assert (made.tissues(body).stiffness.amax(dim=1) == 1.0).all()
    assert made.tissues(body).stiffness.min() == pytest.approx(0.025)


@pytest.mark.slow
def test_inside_its_skin_a_primitive_is_itself() -> None:
    """Stiffness everywhere, muscles and fibres in muscle, and the sign of the distance."""
    made = primitives()
    body = made.workspace(PAPER)
    tissues = made.tissues(body)
    for n, animal in enumerate(made.animals):
        inside = animal.shape.inside(body.positions)
        np.testing.assert_array_equal(tissues.distances[n].numpy() <= 0.0, inside)
        np.testing.assert_allclose(2.0 * tissues.stiffness[n][inside], animal.stiffness(body.positions[inside]))
        own = animal.membership(body.positions)
        muscled = inside & (own.sum(axis=1) > 1.0 - 1e-9)
        assert muscled.sum() > 0.3 * inside.sum()
        np.testing.assert_allclose(tissues.membership[n][muscled], own[muscled])
        np.testing.assert_allclose(tissues.fibres[n][muscled], animal.fibres(body.positions[muscled]), atol=1e-9)


@pytest.mark.slow
def test_outside_its_skin_a_primitive_is_what_its_nearest_point_is() -> None:
    """Against brute force among the particles of a fine body, of a primitive that bends up and down and one sideways.

    A muscle's nearest cube is up to a cube's diagonal further away than the muscle itself; two are compared.
    """
    made = primitives()
    body = made.workspace(DRAFT)
    tissues = made.tissues(body)
    for n, animal in enumerate(made.animals[:2]):
        fine = animal.body(Fidelity(1 / 192))
        shares = fine.muscle_membership
        # a cube on the border of two muscles, or more, is of each that has half as much of it as the largest
        owns = (shares >= 0.5 * shares.max(axis=1, keepdims=True)) & (shares.sum(axis=1) > 0.5)[:, None]
        gaps = np.stack([KDTree(fine.positions[own]).query(body.positions)[0] for own in owns.T], axis=1)
        chosen = tissues.membership[n].numpy().argmax(axis=1)
        excess = gaps[np.arange(len(gaps)), chosen] - gaps.min(axis=1)
        assert excess.max() <= 2.0 * np.sqrt(3.0) * Fidelity(1 / 192).particle_edge


@pytest.mark.parametrize("names", [DEFAULT_PRIMITIVES, pytest.param("orca+panda", marks=pytest.mark.slow)])
def test_tissues_are_whole_and_mirrored(names: str) -> None:
    """Shares with sum 1, unit fibres, and symmetric sides."""
    made = primitives(names)
    body = made.workspace(DRAFT)
    tissues = made.tissues(body)
    np.testing.assert_allclose(tissues.membership.sum(dim=2), 1.0, rtol=1e-12)
    np.testing.assert_allclose(tissues.fibres.norm(dim=2), 1.0, rtol=1e-12)
    flip = np.array([1.0, 1.0, -1.0])
    gap, twin = KDTree(body.positions).query(body.positions * flip)
    assert gap.max() < 1e-9
    np.testing.assert_allclose(tissues.distances[:, twin], tissues.distances, atol=1e-12)
    np.testing.assert_allclose(tissues.stiffness[:, twin], tissues.stiffness, atol=1e-12)
    np.testing.assert_allclose(tissues.fibres[:, twin], tissues.fibres * torch.as_tensor(flip), atol=1e-9)


@pytest.mark.slow
def test_muscles_are_matched_by_number() -> None:
    """Equal names are kept, others numbered; a primitive with fewer muscles does not use the last ones."""
    agreed = primitives("shark+tuna+clownfish")
    assert agreed.muscles == agreed.animals[0].muscles
    assert primitives().muscles == tuple(f"muscle-{n + 1}" for n in range(8))
    mixed = primitives("orca+panda")
    counts = [len(animal.muscles) for animal in mixed.animals]
    assert len(mixed.muscles) == max(counts)
    used = mixed.tissues(mixed.workspace(DRAFT)).membership.sum(dim=1) > 0.0
    for n, count in enumerate(counts):
        assert used[n, :count].all()
        assert not used[n, count:].any()


@pytest.mark.slow
def test_a_longer_workspace_is_the_same_workspace() -> None:
    """Twice the length on a grid twice as coarse: the same tissues, twice the distances."""
    small, large = primitives(), primitives(length=2 * SWIMMER_LENGTH)
    one, two = small.tissues(small.workspace(DRAFT)), large.tissues(large.workspace(SMOKE))
    np.testing.assert_allclose(two.distances, 2.0 * one.distances, atol=1e-12)
    np.testing.assert_allclose(two.membership, one.membership, atol=1e-12)


def test_coefficients_are_on_the_simplex() -> None:
    """Positive with sum 1 in each block, for any parameters."""
    weights = simplex(torch.tensor([1000.0, -1000.0, 0.0, 1.0, 2.0, 3.0], dtype=torch.float64), 2)
    assert weights.shape == (2, 3)
    np.testing.assert_allclose(weights.sum(dim=1), 1.0, rtol=1e-12)
    np.testing.assert_array_equal(weights[0], [1.0, 0.0, 0.0])


@pytest.mark.parametrize("space", ["sdf-lerp", "barycenter"])
@pytest.mark.parametrize(
    ("names", "error", "message"),
    [
        ("orca", UsageError, "two or more"),
        ("orca+orca", UsageError, "two or more"),
        ("orca+", UsageError, "Cannot read"),
        ("orca+unicorn", UnknownNameError, "unicorn"),
        ("orca+caterpillar", UsageError, "signed distance"),
        ("orca+mesh", UsageError, "signed distance"),
        ("orca+sdf-lerp", UsageError, "signed distance"),
    ],
)
def test_names_that_cannot_be_mixed_are_refused(space: str, names: str, error: type[UsageError], message: str) -> None:
    """When the design is created, with the remedy."""
    with pytest.raises(error, match=message):
        registry.create(Kind.DESIGN, Ref(space, params=(("primitives", names),)))


def test_a_grid_that_holds_no_primitive_is_refused() -> None:
    """As for every design."""
    with pytest.raises(SceneError, match="finer fidelity"):
        primitives().workspace(Fidelity(0.5))


def test_all_primitives_are_animals_of_one_length() -> None:
    """They are scaled."""
    for animal in primitives(length=0.07).animals:
        assert isinstance(animal, Animal)
        assert animal.length == 0.07
