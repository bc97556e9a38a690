"""Every fidelity simulates the same robot: mass, muscles, length, inertia and clearance are those of the solid."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import binary_opening

from zoobench import registry
from zoobench.arrays import Array
from zoobench.designs.base import Body
from zoobench.registry import Kind
from zoobench.spec import Ref

NAMES = ("block", "caterpillar", "panda", "baby-seal", "fish", "orca", "shark", "clownfish", "tuna")
LEVELS = ("smoke", "draft", "standard", "paper", "fine", "reference")
NOISY = {("block", "fine"), ("shark", "reference"), ("tuna", "reference")}
POINTS = 500_000  # by which a solid is measured: muscles of a fiftieth of it to 0.5 %, all of it to 0.03 %


@cache
def design(name: str) -> Any:
    """A registered design."""
    return registry.create(Kind.DESIGN, Ref(name))


@cache
def body_of(name: str, level: str) -> Body:
    """Its body at a fidelity."""
    body: Body = design(name).body(registry.create(Kind.FIDELITY, Ref(level)))
    return body


@dataclass(frozen=True)
class Measure:
    """A solid, or the particles of a body: volume [m^3], muscles' volumes [m^3], mean distance of matter from the
    planes x = 0, y = 0 and z = 0 [m], second moments about the centre of mass `[3]` [m^2], and the box around it."""

    volume: float
    muscles: Array
    spread: Array
    moments: Array
    size: Array


@cache
def solid(name: str) -> Measure:
    """By points of an additive recurrence over the whole box, which knows no lattice."""
    shape, root = design(name).shape, 1.2207440846057596
    lower, upper = np.array(shape.lower), np.array(shape.upper)
    places = (0.5 + np.arange(POINTS)[:, None] / root ** np.arange(1, 4)) % 1.0
    blocks = np.array_split(lower + (upper - lower) * places, 50)
    blocks = [block[shape.inside(block)] for block in blocks]
    each = (upper - lower).prod() / POINTS
    points = np.concatenate(blocks)
    muscles = sum(design(name).membership(block).sum(axis=0) for block in blocks) * each
    return Measure(
        len(points) * each,
        muscles,
        np.abs(points).mean(axis=0),
        points.var(axis=0),
        np.ptp(points, axis=0),
    )


def particles(body: Body) -> Measure:
    """The same of a body.

    A particle is a point: a cube's own inertia, edge^2 / 12 times its mass along each axis, less where it is partly
    filled, is added. The simulator gives every particle the larger second moment of its kernel instead, which is an
    error of the grid and not of the body.
    """
    volumes, places = body.volumes, body.positions
    total = volumes.sum()
    centre = volumes @ places / total
    own = volumes @ np.cbrt(volumes) ** 2 / 12 / total
    return Measure(
        total,
        volumes @ body.muscle_membership,
        volumes @ np.abs(places) / total,
        volumes @ (places - centre) ** 2 / total + own,
        body.size,
    )


def inertia(measure: Measure) -> Array:
    """Principal moments per mass about x, y and z [m^2]; the designs are symmetric, and z is exact."""
    found: Array = measure.moments.sum() - measure.moments
    return found


@pytest.mark.parametrize(
    ("name", "level"),
    [
        # one of them at the first three levels
        pytest.param(name, level, marks=() if name == "panda" and level in LEVELS[:3] else pytest.mark.slow)
        for name in NAMES
        for level in LEVELS
    ],
)
def test_it_is_the_solid(name: str, level: str, request: pytest.FixtureRequest) -> None:
    """Volume to 1 %, muscles to 2 %, inertia to 2 %, mean distances from the middle to 1 %, the box to 0.3 cubes."""
    if (name, level) in NOISY:
        reason = (
            "Few points sample a cube there: its fill is right in the mean alone, and the box too wide by 2 to 3 %."
        )
        request.applymarker(pytest.mark.xfail(strict=True, reason=reason))
    body, expected = body_of(name, level), solid(name)
    found = particles(body)
    coarse = level == "smoke"  # a cube is 16 mm, a third of the body's height
    assert found.volume == pytest.approx(expected.volume, rel=0.01)
    np.testing.assert_allclose(found.muscles, expected.muscles, rtol=0.04 if coarse else 0.02)
    np.testing.assert_allclose(inertia(found), inertia(expected), rtol=0.02)
    np.testing.assert_allclose(found.spread, expected.spread, rtol=0.02 if coarse else 0.01)
    if not coarse:
        np.testing.assert_allclose(found.size, expected.size, rtol=0.01, atol=0.3 * body.edge)
    assert body.masses(1000.0).sum() == pytest.approx(1000.0 * expected.volume, rel=0.01)


@pytest.mark.parametrize("name", ["caterpillar", "panda", "baby-seal"])
def test_it_stands_on_soles_that_the_levels_resolve(name: str) -> None:
    """Discs of 20 mm, two cells of `standard`, cover four fifths of what touches the ground."""
    x, z = np.meshgrid(np.arange(-60, 61) * 1e-3, np.arange(-50, 51) * 1e-3, indexing="ij")
    ground = np.stack([x, np.full_like(x, 1e-6), z], axis=-1).reshape(-1, 3)
    sole = np.asarray(design(name).shape.inside(ground)).reshape(x.shape)
    disc = np.hypot(*np.mgrid[-10:11, -10:11]) <= 10
    assert binary_opening(sole, disc).sum() >= 0.8 * sole.sum() > 0


def test_the_pandas_belly_clears_the_ground() -> None:
    """By 8 mm in the solid, and by as much, to a sixth of a cube, in the particles beside the middle plane."""
    shape = design("panda").shape
    x, y = np.meshgrid(np.linspace(-0.03, 0.02, 101), np.linspace(0.0, 0.02, 401), indexing="ij")
    middle = np.stack([x, y, np.full_like(x, 1e-4)], axis=-1).reshape(-1, 3)
    assert middle[shape.inside(middle), 1].min() == pytest.approx(0.008, abs=1e-4)
    body = body_of("panda", "paper")  # the coarsest with a cube between the middle plane and the feet
    own = (np.abs(body.sites[:, 2]) < body.edge) & (body.sites[:, 0] > -0.03) & (body.sites[:, 0] < 0.02)
    underside = (body.positions[:, 1] - body.volumes / (2.0 * body.edge**2))[own].min()
    assert underside == pytest.approx(0.008, abs=body.edge / 6)


@pytest.mark.parametrize("name", NAMES)
def test_a_muscle_is_a_mean_over_its_cube(name: str) -> None:
    """Shares are in [0, 1] and sum to 1 at most; fibres are unit vectors."""
    body = body_of(name, "draft")
    assert body.muscle_membership.min() >= 0.0
    assert body.muscle_membership.sum(axis=1).max() <= 1.0 + 1e-9
    np.testing.assert_allclose(np.linalg.norm(body.fibres, axis=1), 1.0)
