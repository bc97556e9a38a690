"""Solids: closed forms of distance and volume."""

import numpy as np
import pytest

from zoobench.designs.sampling import Shape
from zoobench.designs.shapes import (
    UPRIGHT,
    Distance,
    Plane,
    above_and_below,
    capsule,
    ellipsoid,
    fin,
    loft,
    mirrored,
    smooth_union,
)

RNG = np.random.default_rng(0)
POINTS = RNG.uniform(-0.06, 0.06, size=(400, 3))


def volume(solid: Distance, reach: float = 0.06) -> float:
    """The measured volume [m^3]."""
    return Shape(lambda points: solid(points) <= 0.0, (-reach,) * 3, (reach,) * 3).volume()


def test_an_ellipsoid_has_its_volume_and_a_ball_its_distance() -> None:
    """4/3 pi a b c; equal radii give the Euclidean distance."""
    assert volume(ellipsoid((0.0, 0.0, 0.0), (0.05, 0.03, 0.02))) == pytest.approx(4 / 3 * np.pi * 3e-5, rel=5e-3)
    ball = ellipsoid((0.01, 0.0, 0.0), (0.02, 0.02, 0.02))
    np.testing.assert_allclose(ball(POINTS), np.linalg.norm(POINTS - (0.01, 0.0, 0.0), axis=1) - 0.02, atol=1e-12)
    assert ball(np.array([[0.01, 0.0, 0.0]])) == pytest.approx(-0.02)


def test_a_capsule_is_a_cylinder_with_two_half_balls() -> None:
    """pi r^2 l + 4/3 pi r^3; a tapered one has a radius at each end."""
    rod = capsule((-0.02, 0.0, 0.0), (0.02, 0.0, 0.0), 0.015, 0.015)
    assert volume(rod, 0.036) == pytest.approx(np.pi * 0.015**2 * (0.04 + 4 / 3 * 0.015), rel=5e-3)
    taper = capsule((-0.02, 0.0, 0.0), (0.02, 0.0, 0.0), 0.015, 0.005)
    assert taper(np.array([[-0.035, 0.0, 0.0], [0.025, 0.0, 0.0]])) == pytest.approx([0.0, 0.0], abs=1e-12)


def test_a_loft_passes_through_its_stations() -> None:
    """The distance is zero on each ellipse, and a constant section gives an elliptic cylinder."""
    stations = [(-0.03, 0.0, 0.01, 0.02), (0.0, 0.005, 0.02, 0.01), (0.03, 0.0, 0.0, 0.0)]
    trunk = loft(stations)
    angles = np.linspace(0.0, 2 * np.pi, 9)
    for x, centre, high, wide in stations[:2]:
        ring = np.stack([np.full(9, x), centre + high * np.cos(angles), wide * np.sin(angles)], axis=1)
        assert trunk(ring) == pytest.approx(0.0, abs=1e-12)
    assert trunk(np.array([[0.035, 0.0, 0.0], [-0.034, 0.0, 0.0]])) == pytest.approx([0.005, 0.004], abs=2e-4)
    even = loft([(-0.03, 0.0, 0.01, 0.02), (0.03, 0.0, 0.01, 0.02)])
    assert volume(even) == pytest.approx(np.pi * 0.01 * 0.02 * 0.06, rel=2e-2)


def test_a_fin_is_a_prism_over_its_outline() -> None:
    """Area of a concave polygon times thickness, in a tilted plane as well."""
    outline = [(-0.03, -0.02), (0.03, -0.02), (0.03, 0.02), (0.0, -0.005), (-0.03, 0.02)]
    area = 0.06 * 0.04 - 0.5 * 0.06 * 0.025
    for plane in (UPRIGHT, Plane((0.004, 0.0, 0.002), (1.0, 0.3, 0.2), (0.0, 1.0, 0.5))):
        assert volume(fin(plane, outline, 0.0096), 0.04) == pytest.approx(area * 0.0096, rel=3e-2)
    level = Plane((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    square = fin(level, [(-0.01, -0.01), (0.01, -0.01), (0.01, 0.01), (-0.01, 0.01)], 0.02)
    assert square(np.array([[0.0, 0.0, 0.0], [0.03, 0.0, 0.0], [0.0, 0.015, 0.0]])) == pytest.approx(
        [-0.01, 0.02, 0.005]
    )


def test_mirrored_puts_the_right_side_on_both() -> None:
    """The same distance at z and -z."""
    limb = capsule((0.0, 0.0, 0.02), (0.02, 0.0, 0.04), 0.01, 0.005)
    pair, flip = mirrored(limb), np.array([1.0, 1.0, -1.0])
    np.testing.assert_array_equal(pair(POINTS), pair(POINTS * flip))
    right = POINTS[:, 2] > 0
    np.testing.assert_array_equal(pair(POINTS)[right], limb(POINTS)[right])


def test_above_and_below_puts_the_upper_side_on_both() -> None:
    """The same distance as far above a height as below."""
    limb = capsule((0.0, 0.02, 0.0), (0.02, 0.04, 0.0), 0.01, 0.005)
    pair, below = above_and_below(limb, 0.01), POINTS * [1.0, -1.0, 1.0] + [0.0, 0.02, 0.0]
    np.testing.assert_allclose(pair(POINTS), pair(below), atol=1e-15)
    upper = POINTS[:, 1] > 0.01
    np.testing.assert_allclose(pair(POINTS)[upper], limb(POINTS)[upper], atol=1e-15)


def test_a_smooth_union_is_the_union_but_near_the_seam() -> None:
    """It adds a quarter of the blend at most, and nothing far from the other surface."""
    first = ellipsoid((-0.015, 0.0, 0.0), (0.02, 0.02, 0.02))(POINTS)
    second = ellipsoid((0.015, 0.0, 0.0), (0.02, 0.02, 0.02))(POINTS)
    both, sharp = smooth_union([first, second], 0.008), np.minimum(first, second)
    assert (both <= sharp).all()
    assert (sharp - both).max() <= 0.002 + 1e-12
    far = np.abs(first - second) > 0.008
    np.testing.assert_array_equal(both[far], sharp[far])
    assert (both < sharp).any()
