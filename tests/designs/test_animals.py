"""The animals and the primitives: size, symmetry, muscles, connectedness and stability."""

from functools import cache

import numpy as np
import pytest
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull, KDTree

from zoobench import registry
from zoobench.arrays import Array
from zoobench.designs.anatomy import MIDDLE, REFERENCE_LENGTH, SWIMMER_LENGTH, Animal
from zoobench.designs.base import Body
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.spec import Ref

NAMES = ("baby-seal", "fish", "panda", "orca", "shark", "clownfish", "tuna")
SPACING = 0.0015
SMOKE, DRAFT, PAPER = Fidelity(1 / 32), Fidelity(1 / 64), Fidelity(1 / 128)


@cache
def animal(name: str, **params: float) -> Animal:
    """A registered animal."""
    made = registry.create(Kind.DESIGN, Ref(name, params=tuple(params.items())))
    assert isinstance(made, Animal)
    return made


@cache
def body_of(name: str, fidelity: Fidelity) -> Body:
    """Its body, cached."""
    return animal(name).body(fidelity)


def solid_points(made: Animal) -> Array:
    """Points inside it, on a lattice of 1.5 mm that reaches beyond its box `[n, 3]` [m]."""
    edges = zip(made.shape.lower, made.shape.upper, strict=True)
    axes = [np.arange(low - 0.004, high + 0.004, SPACING) for low, high in edges]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return points[made.distance(points) <= 0.0]


def centre_of_mass(body: Body) -> Array:
    """[m]."""
    masses = body.masses(1000.0)
    centre: Array = masses @ body.positions / masses.sum()
    return centre


@pytest.mark.parametrize("name", NAMES)
def test_it_fills_its_box_and_stands_on_the_ground(name: str) -> None:
    """The animal is within its box, nearly as large, and touches y = 0, but for those whose bellies are above it."""
    made = animal(name)
    clearance = {"orca": 0.014, "shark": 0.0045}.get(name, 0.0)
    lower, upper = np.array(made.shape.lower), np.array(made.shape.upper)
    inside = solid_points(made)
    assert (inside.min(axis=0) >= lower - 1e-9).all()
    assert (inside.max(axis=0) <= upper + 1e-9).all()
    slack = (upper - lower) - np.ptp(inside, axis=0)
    assert (slack <= (0.002, 0.003 + clearance, 0.006)).all(), slack
    assert clearance - 2 * SPACING <= inside[:, 1].min() <= SPACING + clearance


@pytest.mark.parametrize("name", NAMES)
def test_left_and_right_are_mirror_images(name: str) -> None:
    """Every particle has a counterpart with mirrored fibre and the muscles of the other side."""
    body = body_of(name, DRAFT)
    flip = np.array([1.0, 1.0, -1.0])
    gap, twin = KDTree(body.positions).query(body.positions * flip)
    assert gap.max() < 1e-9
    np.testing.assert_allclose(body.fibres[twin], body.fibres * flip, atol=1e-9)
    np.testing.assert_allclose(body.stiffness[twin], body.stiffness, atol=1e-9)
    np.testing.assert_allclose(body.density_ratio[twin], body.density_ratio, atol=1e-9)
    swap = {"left": "right", "right": "left"}
    order = [
        body.muscles.index("-".join(swap.get(word, word) for word in muscle.split("-"))) for muscle in body.muscles
    ]
    np.testing.assert_allclose(body.muscle_membership[twin][:, order], body.muscle_membership, atol=1e-9)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    "fidelity", [DRAFT, *(pytest.param(fidelity, marks=pytest.mark.slow) for fidelity in (SMOKE, PAPER))]
)
def test_it_is_one_piece_with_every_muscle(name: str, fidelity: Fidelity) -> None:
    """Connected over faces and edges of the lattice; every muscle has more than 1 % of the particles."""
    body = body_of(name, fidelity)
    near = 1.45 * fidelity.grid_spacing / 2
    tree = KDTree(body.sites)
    assert connected_components(tree.sparse_distance_matrix(tree, near, output_type="coo_matrix"))[0] == 1
    shares = body.muscle_membership.sum(axis=0) / body.particle_count
    assert shares.min() > 0.01
    assert len(set(body.muscles)) == len(body.muscles) <= 12


@pytest.mark.parametrize("name", NAMES)
def test_every_part_has_particles_on_the_draft_grid(name: str) -> None:
    """At least two."""
    made = animal(name)
    for part in made.parts:
        assert (part.solid(body_of(name, DRAFT).positions / made.scale) <= 0.0).sum() >= 2


@pytest.mark.parametrize("fidelity", [SMOKE, DRAFT, pytest.param(PAPER, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", ["baby-seal", "panda"])
def test_it_stands_stably(name: str, fidelity: Fidelity) -> None:
    """The centre of mass is above the sole; tilting by 25 degrees does not topple it. Swimmers fall over."""
    body = body_of(name, fidelity)
    half = fidelity.grid_spacing / 4
    lowest = body.positions[body.positions[:, 1] < body.positions[:, 1].min() + half]
    outline = ConvexHull(lowest[:, [0, 2]]).equations
    centre = centre_of_mass(body)
    margin = -(outline[:, :2] @ centre[[0, 2]] + outline[:, 2]).max() + half
    assert np.degrees(np.arctan2(margin, centre[1])) > 25.0


@pytest.mark.parametrize("name", NAMES)
def test_it_weighs_what_muscle_weighs(name: str) -> None:
    """The mean density is that of muscle, and the centre of mass is not above the centre of volume."""
    body = body_of(name, DRAFT)
    assert np.average(body.density_ratio, weights=body.volumes) == pytest.approx(1.0, rel=1e-12)
    assert centre_of_mass(body)[1] <= np.average(body.positions[:, 1], weights=body.volumes) + 1e-9


@pytest.mark.parametrize("name", NAMES)
def test_tissues_differ(name: str) -> None:
    """Some matter is passive; stiffness is within the range allowed by the time step."""
    body = body_of(name, DRAFT)
    active = body.muscle_membership.sum(axis=1)
    assert np.average(1.0 - active, weights=body.volumes) > 0.05
    assert (active > 1.0 - 1e-9).mean() > 0.3
    softest = 0.05 * (1 - 1e-12) if name == "orca" else 0.5  # the fin on its back
    assert softest <= body.stiffness.min() <= body.stiffness.max() <= 2.0
    assert body.stiffness.max() > 1.9


@pytest.mark.parametrize("name", NAMES)
def test_fibres_are_smooth(name: str) -> None:
    """Over 1.5 mm on one side, the direction changes by less than 45 degrees."""
    made = animal(name)
    points = solid_points(made)
    points = points[points[:, 2] > 0.002]
    fibres = made.fibres(points)
    pairs = KDTree(points).query_pairs(1.01 * SPACING, output_type="ndarray")
    cosine = np.abs((fibres[pairs[:, 0]] * fibres[pairs[:, 1]]).sum(axis=1))
    assert np.degrees(np.arccos(np.clip(cosine, 0.0, 1.0))).max() < 45.0


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in ("panda", "clownfish") else pytest.mark.slow) for name in NAMES]
)
def test_the_head_leads(name: str) -> None:
    """Head and tail are labelled at the ends, the head in front."""
    body = body_of(name, SMOKE)
    assert body.positions[body.head, 0].min() > body.positions[body.tail, 0].max()


@pytest.mark.slow
def test_a_longer_animal_is_the_same_animal() -> None:
    """Twice as long on a grid twice as coarse: the same particles and eight times the mass."""
    small, large = animal("panda").body(PAPER), animal("panda", length=2 * REFERENCE_LENGTH).body(DRAFT)
    np.testing.assert_allclose(large.positions, 2 * small.positions, atol=1e-12)
    np.testing.assert_allclose(large.muscle_membership, small.muscle_membership, atol=1e-12)
    assert large.masses(1000.0).sum() == pytest.approx(8 * small.masses(1000.0).sum())


@pytest.mark.parametrize("length", [0.0, -1.0, float("inf")])
def test_a_length_without_a_body_is_refused(length: float) -> None:
    """Lengths that are not positive and finite."""
    with pytest.raises(UsageError, match=r"positive length|must be a finite number"):
        animal("fish", length=length)


@pytest.mark.parametrize(
    ("name", "apart"), [("fish", 1e-9), ("tuna", 0.0061), ("shark", 1e-9), ("clownfish", 1e-9), ("orca", 0.1)]
)
def test_swimmers_in_their_rest_frame_have_the_same_mass_above_and_below(name: str, apart: float) -> None:
    """But for points on the very edge of a fin, and the orca's on its back, so that they do not dive by sampling.

    By this share of a cube, which is sampled by 166 points.
    """
    body = animal(name).body(Fidelity(1 / 64, robot="lagrangian"))
    level = MIDDLE * SWIMMER_LENGTH / REFERENCE_LENGTH
    offset = np.rint((body.sites - (0.0, level, 0.0)) / (body.edge / 2.0)).astype(int)
    volume = {tuple(site): each for site, each in zip(offset.tolist(), body.volumes, strict=True)}
    back_fin = 0.006 if name == "orca" else 0.0
    for (x, y, z), each in volume.items():
        if abs(z) * body.edge / 2.0 < back_fin:
            continue
        assert volume[x, -y, z] == pytest.approx(each, abs=apart * body.edge**3)
